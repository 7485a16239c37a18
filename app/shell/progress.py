"""Progress on stderr: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Any, Protocol

_SECONDS_BETWEEN_LINES = 5.0


class Steps(Protocol):
    """Who hears of a job that has several steps."""

    def step(self, name: str) -> None:
        """Begin the next step; the one before is done."""

    def __call__(self, fraction: float, note: str = "") -> None:
        """The fraction done (0..1) of the present step."""


class Silent:
    """Says nothing."""

    def step(self, name: str) -> None:
        """Nothing is told of a step."""

    def __call__(self, fraction: float, note: str = "") -> None:
        """Nor of how far it is."""


class Progress:
    """Reports a job's steps; call it with the fraction done (0..1) of the present step, and perhaps a note.

    with Progress("run paper_fe") as progress:
        progress.step("simulating")
        simulate(..., progress)
    """

    def __init__(self, title: str) -> None:
        self.title = title
        self._bar: Any = None
        self._task: Any = None
        self._step = ""
        self._began = self._spoke = time.monotonic()
        self._paced: tuple[float, float] | None = None  # when and where the step's first piece was done

    def __enter__(self) -> Progress:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
            from rich.progress import Progress as Bar

            columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
            self._bar = Bar(*columns, console=Console(stderr=True), transient=True)
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close_step(done=error is None)
        if self._bar is not None:
            self._bar.stop()

    def step(self, name: str) -> None:
        """Begin the next step; the one before is done."""
        self._close_step(done=True)
        self._step = name
        self._began = self._spoke = time.monotonic()
        self._paced = None
        if self._bar is not None:
            self._task = self._bar.add_task(f"{self.title}: {name}", total=None)

    def __call__(self, fraction: float, note: str = "") -> None:
        """The fraction done (0..1) of the present step."""
        now = time.monotonic()
        if self._paced is None and fraction > 0.0:
            self._paced = (now, fraction)
        if self._bar is not None:
            text = f"{self.title}: {self._step}" + (f", {note}" if note else "")
            self._bar.update(self._task, completed=fraction, total=1.0, description=text)
        else:
            done = f"{100 * fraction:.0f} %{self._left(now, fraction)}"
            self._now_and_then(now, f"{self._step}{f', {note}' if note else ''}: {done}")

    def doing(self, what: str) -> None:
        """What the present step is at, which has no known end; several may be at something side by side."""
        if self._bar is not None:
            self._bar.update(self._task, description=f"{self.title}: {self._step}, {what}")
        else:
            now = time.monotonic()
            self._now_and_then(now, f"{self._step}, {what}: {now - self._began:.0f} s")

    def _now_and_then(self, now: float, text: str) -> None:
        """Tell it unless a line was told a moment ago."""
        if now - self._spoke >= _SECONDS_BETWEEN_LINES:
            self._spoke = now
            self._line(text)

    def _left(self, now: float, fraction: float) -> str:
        """How long the step will still take, at its pace since its first piece: that one compiles loops, or comes from
        a checkpoint."""
        began, first = self._paced or (now, fraction)
        if fraction - first < 0.02:
            return ""
        seconds = (now - began) * (1 - fraction) / (fraction - first)
        return f", {seconds:.0f} s left" if seconds < 120 else f", {seconds / 60:.0f} min left"

    def _close_step(self, done: bool) -> None:
        if not self._step:
            return
        if done:
            self._line(f"{self._step}: done in {time.monotonic() - self._began:.1f} s")
        if self._bar is not None:
            self._bar.remove_task(self._task)
        self._step = ""

    def _line(self, text: str) -> None:
        line = f"{self.title}: {text}"
        if self._bar is not None:
            self._bar.console.print(line, highlight=False, markup=False)
        else:
            print(line, file=sys.stderr, flush=True)

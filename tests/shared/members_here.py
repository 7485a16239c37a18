"""Members of a study in this process, where starting another one, a second or two, is not what is tested."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import pytest

from gearbench.bench.study.member import Found, Task, compute


def members_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have members computed one after another by whoever starts the study."""

    def compute_here(tasks: Iterable[Task], workers: int) -> Iterator[Found]:
        yield from map(compute, tasks)

    monkeypatch.setattr("gearbench.bench.study.processes.compute_here", compute_here)

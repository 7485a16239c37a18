"""Members on the processors of this machine: a few processes that each compute one member at a time."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from selectors import EVENT_READ, DefaultSelector
from typing import IO, Any

from gearbench.bench.errors import BenchError
from gearbench.bench.study.member import Found, Task, found_from, task_data

ATTEMPTS = 2  # at a member whose process dies: it may have been killed for want of memory by another's doing
_ALONE = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "GEARBENCH_PROCESSORS")


@dataclass
class Worker:
    """One process, what it is computing, and where its complaints go."""

    process: subprocess.Popen[bytes]
    complaints: IO[bytes]
    task: Task | None = None
    buffer: bytes = field(default=b"")

    def give(self, task: Task) -> None:
        """Hand it a task; whether it is still there to take it shows when it is read."""
        self.task, self.buffer = task, b""
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.write(json.dumps(task_data(task)).encode() + b"\n")
            self.process.stdin.flush()

    def last_words(self) -> str:
        """How it ended."""
        code = self.process.wait()
        self.complaints.seek(0)
        lines = [line for line in self.complaints.read().decode(errors="replace").splitlines() if line.strip()]
        how = f"was killed by signal {-code}" if code < 0 else f"ended with code {code}"
        return f"the process that computed this member {how}" + (f" ({lines[-1].strip()[:200]})" if lines else "")


def compute_here(tasks: Iterable[Task], workers: int) -> Iterator[Found]:
    """Results as they come, on so many processes. A member whose process dies twice becomes a sentence.

    Raises BenchError when no process can be started.
    """
    waiting = list(tasks)[::-1]
    attempts: dict[int, int] = {}
    crew: list[Worker] = []
    with DefaultSelector() as selector:
        try:
            for _ in range(min(workers, len(waiting))):
                crew.append(_hire(selector, waiting.pop()))
            while selector.get_map():
                for event, _ in selector.select():
                    worker: Worker = event.data
                    found = _hear(worker)
                    if found is None:
                        continue
                    task = worker.task
                    assert task is not None
                    if isinstance(found, Found):
                        yield found
                        if waiting:
                            worker.give(waiting.pop())
                            continue
                        _dismiss(selector, worker)
                        continue
                    selector.unregister(event.fileobj)
                    crew.remove(worker)
                    words = worker.last_words()
                    attempts[task.number] = attempts.get(task.number, 0) + 1
                    if attempts[task.number] < ATTEMPTS:
                        waiting.append(task)
                    else:
                        yield Found(task.number, {}, words)
                    if waiting:
                        crew.append(_hire(selector, waiting.pop()))
        finally:
            for worker in crew:
                _end(worker)


def _hire(selector: DefaultSelector, task: Task) -> Worker:
    """A new process with its first task."""
    environment = os.environ | dict.fromkeys(_ALONE, "1")
    complaints = tempfile.TemporaryFile()  # noqa: SIM115 (closed with the worker)
    try:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "gearbench.bench.study.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=complaints,
            env=environment,
            start_new_session=True,  # Ctrl-C is for the study, which ends them
        )
    except OSError as error:
        raise BenchError(f"a process for the study's members cannot be started: {error.strerror or error}") from error
    worker = Worker(process, complaints)
    assert process.stdout is not None
    selector.register(process.stdout, EVENT_READ, worker)
    worker.give(task)
    return worker


def _hear(worker: Worker) -> Found | bool | None:
    """The result that has come in whole; None while it has not; False when the process is gone."""
    assert worker.process.stdout is not None
    piece = os.read(worker.process.stdout.fileno(), 1 << 16)
    if not piece:
        return False
    worker.buffer += piece
    if not worker.buffer.endswith(b"\n"):
        return None
    try:
        data: dict[str, Any] = json.loads(worker.buffer)
    except ValueError:
        return None
    worker.buffer = b""
    return found_from(data)


def _dismiss(selector: DefaultSelector, worker: Worker) -> None:
    """A worker for whom there is nothing left to do."""
    assert worker.process.stdout is not None and worker.process.stdin is not None
    selector.unregister(worker.process.stdout)
    with suppress(OSError):
        worker.process.stdin.close()


def _end(worker: Worker) -> None:
    worker.process.kill()
    worker.process.wait()
    for pipe in (worker.process.stdin, worker.process.stdout, worker.complaints):
        if pipe is not None:
            with suppress(OSError):
                pipe.close()

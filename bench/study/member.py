"""One member of a study: a case as text in, its numbers or one sentence out. Runs in any process on any machine."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from gearbench.bench.study.against import Reference
from gearbench.bench.study.quantities import Ask, measure


@dataclass(frozen=True)
class Task:
    """What a worker is handed: the member's number, its whole case as TOML, what is wanted of it."""

    number: int
    case: str
    ask: Ask


@dataclass(frozen=True)
class Found:
    """What it hands back: `numbers` by column, or the `sentence` of what stood in the way; `warnings`; the digest of
    the `sources` that it was computed with, empty where its process died; wall time [s]."""

    number: int
    numbers: dict[str, float]
    sentence: str = ""
    warnings: tuple[str, ...] = ()
    sources: str = ""
    seconds: float = 0.0


def compute(task: Task) -> Found:
    """The member's numbers. What its case does not allow becomes a sentence; a defect of ours does too, marked so."""
    from gearbench.records.provenance import source_digest
    from gearbench.rig import read_case

    began = time.perf_counter()
    numbers: dict[str, float] = {}
    warnings: list[str] = []
    sentence = ""
    try:
        with TemporaryDirectory() as folder:
            path = Path(folder) / "case.toml"
            path.write_text(task.case, encoding="utf-8")
            case = read_case(path)
        numbers, warnings = measure(case, task.ask)
    except Exception as error:  # whatever a member meets, the others go on
        sentence = in_words(error)
    return Found(
        task.number, numbers, sentence, tuple(warnings), source_digest(), round(time.perf_counter() - began, 3)
    )


def in_words(error: Exception) -> str:
    """One line of what went wrong."""
    words = " ".join(str(error).split())[:500]
    # Our own refusals are ValueErrors with one sentence; all else is named by its kind.
    ours = type(error).__module__.startswith("gearbench.")
    return words if ours and words else f"{type(error).__name__}: {words}"


def task_data(task: Task) -> dict[str, Any]:
    """A task as plain data."""
    return {"number": task.number, "case": task.case, "ask": list(task.ask)}


def task_from(data: dict[str, Any]) -> Task:
    """The task in plain data."""
    of, torque, positions, cycles, loads, held = data["ask"]
    against = None if held is None else Reference(tuple(held[0]), *held[1:])
    return Task(data["number"], data["case"], Ask(tuple(of), torque, positions, cycles, tuple(loads), against))


def found_data(found: Found) -> dict[str, Any]:
    """A result as plain data."""
    return asdict(found)


def found_from(data: dict[str, Any]) -> Found:
    """The result in plain data."""
    return Found(**{**data, "warnings": tuple(data["warnings"])})

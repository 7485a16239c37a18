"""Rows of the validation table: what is reached, and what the checks in tests/validation got."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Outcome = Literal["pass", "fail", "not-run"]


class NotRun(Exception):
    """Raised by a check that cannot run here; the message says why."""


@dataclass(frozen=True)
class Got:
    """A number got, and what is to be said with it."""

    value: float
    note: str


@dataclass(frozen=True)
class Check:
    """One row: `measure` returns the number got, which passes when it is at most (or, `least`, at least) `reach`.

    name: short, for `--only`; what: what is measured; unit: of reach and got.
    """

    name: str
    what: str
    reach: float
    unit: str
    measure: Callable[[], float | Got]
    least: bool = False


@dataclass(frozen=True)
class Result:
    """What a check got; `note` says what is to be said with it, or why it did not run."""

    check: Check
    got: float | None
    outcome: Outcome
    note: str = ""


def folder() -> Path:
    """tests/validation of the checkout that this package runs from."""
    return Path(__file__).resolve().parents[3] / "tests" / "validation"


def checks() -> list[Check]:
    """Every check of the modules rows_*.py in `folder()`, in the order of the files' names."""
    # The checks share helpers with the tests.
    shared = str(folder().parent)
    if shared not in sys.path:
        sys.path.append(shared)
    found: list[Check] = []
    for path in sorted(folder().glob("rows_*.py")):
        found.extend(_load(path))
    return found


def _load(path: Path) -> list[Check]:
    name = f"gearbench_validation_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return list(module.CHECKS)


def run(wanted: list[Check]) -> Iterator[Result]:
    """Carry out the checks one after another."""
    for check in wanted:
        try:
            got = check.measure()
        except NotRun as reason:
            yield Result(check, None, "not-run", str(reason))
            continue
        value, note = (got.value, got.note) if isinstance(got, Got) else (got, "")
        good = value >= check.reach if check.least else value <= check.reach
        yield Result(check, value, "pass" if good else "fail", note)

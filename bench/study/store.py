"""Members in a study's folder: members/NUMBER/case.toml and result.json, which appears last and whole."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from gearbench.bench.study.member import Found, Task
from gearbench.files import fingerprint, write_text
from gearbench.records.provenance import provenance, source_digest

FOLDER = "members"
CASE, RESULT = "case.toml", "result.json"


@dataclass(frozen=True)
class Shelf:
    """The members of a study in its output folder; `count` decides how long their names are."""

    out: Path
    count: int

    def folder(self, number: int) -> Path:
        """Where a member lies."""
        return self.out / FOLDER / f"{number:0{max(4, len(str(self.count - 1)))}d}"

    def load(self, task: Task) -> Found | None:
        """What an earlier run left of this very member, its case, wishes and sources the same; else None."""
        try:
            data = json.loads((self.folder(task.number) / RESULT).read_text(encoding="utf-8"))
            found = Found(task.number, data["numbers"], data["sentence"], tuple(data["warnings"]))
            same = data["identity"] == _identity(task) and data["digest"] == _digest(found)
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return found if same else None

    def save(self, task: Task, found: Found, values: dict[str, str], seed: int) -> None:
        """Keep a member. Raises FileError."""
        folder = self.folder(task.number)
        folder.mkdir(parents=True, exist_ok=True)
        if task.case:
            write_text(folder / CASE, task.case)
        else:
            (folder / CASE).unlink(missing_ok=True)
        about = provenance(task.case, seed, {"member": task.number, "ask": list(task.ask), "values": values})
        data = {
            "member": task.number,
            "values": values,
            "numbers": found.numbers,
            "sentence": found.sentence,
            "warnings": list(found.warnings),
            "seconds": found.seconds,
            "identity": _identity(task),
            "digest": _digest(found),
            "provenance": json.loads(about),
        }
        write_text(folder / RESULT, json.dumps(data, indent=1) + "\n")

    def clear(self, keep: Sequence[int]) -> None:
        """Remove the members of a former study that are none of these; nothing but what a study wrote."""
        names = {self.folder(number).name for number in keep}
        with suppress(OSError):
            for folder in (self.out / FOLDER).iterdir():
                if folder.name not in names and folder.name.isdecimal():
                    for name in (CASE, RESULT):
                        (folder / name).unlink(missing_ok=True)
                    with suppress(OSError):  # something of another origin lies in it
                        folder.rmdir()


def _identity(task: Task) -> str:
    return fingerprint(source_digest(), task.case, json.dumps(list(task.ask)))


def _digest(found: Found) -> str:
    return fingerprint(json.dumps([found.numbers, found.sentence, list(found.warnings)]))

"""Parts that several reports share: warnings, how far to trust them, from what they were made."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearbench.files import digest_of, fingerprint
from gearbench.report.html import folded, items, preformatted, table, text
from gearbench.words.limits import left_out

if TYPE_CHECKING:
    from gearbench.rig import Case

DIGITS = 16  # of a SHA-256 that a page shows


def mark(kind: str, title: str) -> str:
    """The small line above everything."""
    return text(f"gearbench {kind} · {title}", style="mark")


def lead(sentences: Iterable[str]) -> list[str]:
    """The answer, a sentence a paragraph."""
    return [text(sentence, style="lead") for sentence in sentences]


def warned(warnings: Sequence[str]) -> list[str]:
    """What is to be kept in mind, marked."""
    return [text(warning, style="warn") for warning in warnings]


def limits(model: str, of_record: str = "") -> list[str]:
    """What the model leaves out."""
    return [text(f"What the {model} model leaves out:"), items(left_out(model, of_record))]


def versions() -> list[tuple[str, str]]:
    """Program and sources as rows of a table."""
    from gearbench.records.provenance import package_version, source_digest

    return [("gearbench", package_version()), ("sources (SHA-256)", source_digest()[:DIGITS])]


def about_record(record_provenance: str) -> list[tuple[str, str]]:
    """What a record says of its origin, as rows of a table; nothing where it says nothing that is known."""
    try:
        held: Any = json.loads(record_provenance)
    except ValueError:
        return []
    if not isinstance(held, dict):
        return []
    rows = [("gearbench", str(held.get("version", ""))), ("sources (SHA-256)", str(held.get("sources", ""))[:DIGITS])]
    rows.append(("seed", str(held.get("seed", ""))))
    settings = held.get("settings")
    if isinstance(settings, dict):
        rows += [(key.replace("_", " "), str(value)) for key, value in settings.items()]
    return [(key, value) for key, value in rows if value]


def provenance(rows: Sequence[tuple[str, str]], case: Case | None = None) -> list[str]:
    """The last part of a page: from what it was made, and the whole case."""
    held = list(rows)
    pieces: list[str] = []
    if case is not None:
        from gearbench.rig import dump_case

        dumped = dump_case(case)
        held += [("case", case.name), ("case (SHA-256)", fingerprint(dumped)[:DIGITS])]
        pieces = [folded("The case with every key", preformatted(dumped))]
    return [text("From what this was made", "h2"), table(("", ""), held, code=(1,)), *pieces]


def files_table(files: Mapping[str, tuple[str, str]]) -> str:
    """Files by name: what each holds, and its SHA-256."""
    rows = [(name, about, digest[:DIGITS]) for name, (about, digest) in files.items()]
    return table(("file", "what it holds", "SHA-256"), rows, code=(0, 2))


def file_row(path: Path, about: str) -> dict[str, tuple[str, str]]:
    """One file for `files_table`."""
    return {path.name: (about, digest_of(path))}

"""What `convert` says: what is in a file, what is guessed of it, what became of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.records import Guess, Source

_MOST_FACTS = 20


def source_lines(source: Source, guess: Guess) -> Iterator[str]:
    """What a file holds: columns with unit, size, clock and range; facts; what is no signal."""
    yield f"{source.path}: {source.format}, {len(source.columns)} column(s)"
    uses = {row.column: row.use for row in guess.rows}
    wide = max(len(name) for name in source.names)
    yield f"  {'column':<{wide}}  {'unit':<8} {'samples':>12}  {'clock':<14} {'least':>12} {'most':>12}  looks like"
    for one in source.columns:
        clock = f"{one.rate:.9g} Hz" if one.rate else ("own times" if one.time is not None else "-")
        size = f"{one.samples}" if one.runs == 1 else f"{one.runs} x {one.samples}"
        yield (
            f"  {one.name:<{wide}}  {one.unit or '-':<8} {size:>12}  {clock:<14} {one.values.min():>12.6g}"
            f" {one.values.max():>12.6g}  {uses.get(one.name) or '-'}"
        )
    for key, value in list(source.facts.items())[:_MOST_FACTS]:
        yield f"  {key} = {str(value)[:60]}"
    for key, reason in source.skipped.items():
        yield f"  {key} {reason}"


def guess_lines(guess: Guess) -> Iterator[str]:
    """The guessed map as a table, and what is doubtful about it."""
    wide = max(12, *(len(row.column) for row in guess.rows))
    yield f"  {'column':<{wide}}  {'unit':<8} {'samples':>12}  {'channel':<22} remark"
    for row in guess.rows:
        line = f"  {row.column:<{wide}}  {row.unit or '-':<8} {row.samples:>12}  {row.use or '-':<22} {row.remark}"
        yield line.rstrip()
    for doubt in guess.doubts:
        yield f"  assumed: {doubt}"
    for name in guess.missing:
        yield f"  missing: {name}"


def record_summary(record: xr.Dataset, files: Sequence[Path]) -> dict[str, Any]:
    """What became of the files."""
    attrs = record.attrs
    return {
        "files": [str(path) for path in files],
        "channels": [str(name) for name in record.data_vars],
        "realisations": record.sizes["realisation"],
        "sampling_rate_hz": attrs["sampling_rate"],
        "samples_per_period": attrs["samples_per_period"],
        "periods": attrs["periods"],
        "mesh_frequency_hz": 1.0 / attrs["mesh_period"] if "mesh_period" in attrs else None,
        "warnings": [line for line in str(attrs.get("warnings", "")).splitlines() if line],
    }


def summary_lines(summary: dict[str, Any]) -> Iterator[str]:
    """The summary in words."""
    mesh = summary["mesh_frequency_hz"]
    yield (
        f"{', '.join(summary['files'])}: {', '.join(summary['channels'])}; {summary['realisations']} realisation(s) of"
        f" {summary['periods']} period(s) of {summary['samples_per_period']} samples at"
        f" {summary['sampling_rate_hz']:g} Hz" + (f", mesh {mesh:.6g} Hz" if mesh else "")
    )
    for warning in summary["warnings"]:
        yield f"warning: {warning}"

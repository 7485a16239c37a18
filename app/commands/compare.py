"""`compare A B --out FOLDER`: two runs, records or results side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.shell.options import JsonOption, print_json
from gearbench.shell.output import claimed, fingerprint

if TYPE_CHECKING:
    from gearbench.bench.results.compare import Results


def compare(
    a: Annotated[Path, typer.Argument(metavar="A", help="folder of a run, a record, or a result")],
    b: Annotated[Path, typer.Argument(metavar="B", help="what it is compared with")],
    out: Annotated[Path, typer.Option("--out", help="folder for compare.csv and pictures")] = Path("out_compare"),
    force: Annotated[bool, typer.Option("--force", help="replace an earlier comparison of other things")] = False,
    as_json: JsonOption = False,
) -> None:
    """Compare two runs, records or results: compare.csv and one picture a quantity."""
    from gearbench.bench.results.compare import align, load_results, write_csv
    from gearbench.bench.results.compare import compare as rows_of
    from gearbench.figures.compare import draw_comparison

    one, two = load_results(a), load_results(b)
    two, sentence = align(one, two)
    rows = rows_of(one, two)
    notes = [note for note in (sentence, *conditions_that_differ(one, two)) if note]
    with claimed(out, "compare", fingerprint(str(a.resolve()), str(b.resolve())), force) as output:
        output.write("compare.csv", lambda path: write_csv(rows, path))
        pictures = draw_comparison(output, one, two)
    whole = [row for row in rows if not row.phase_or_band.endswith("cycles")]
    if as_json:
        keys = ("quantity", "phase_or_band", "unit", "a", "b", "difference", "percent")
        table = [{key: getattr(row, key) for key in keys} for row in whole]
        print_json({"folder": str(out), "pictures": pictures, "notes": notes, "rows": table})
        return
    for row in whole:
        name = f"{row.quantity}, {row.phase_or_band}"
        change = f"{row.percent:>+8.1f} %" if row.of_difference is None else f"{row.difference:>8.3g} {row.unit} apart"
        typer.echo(f"{name:<48} {row.a:>10.5g} {row.b:>10.5g} {row.unit:<5} {change}")
    for note in notes:
        typer.echo(f"note: {note}")
    typer.echo(f"{out}: compare.csv, {', '.join(pictures)}")


def conditions_that_differ(one: Results, two: Results) -> list[str]:
    """Operating conditions in which the records differ: not to be taken for a difference of models."""
    if one.record is None or two.record is None:
        return []
    notes = []
    for key, words, unit in (
        ("torque_mean", "mean torque", "N m"),
        ("mesh_period", "mesh period", "s"),
        ("support_direction", "support direction", ""),
        ("driven_boundary", "boundary of the driven gear", ""),
        ("inertia_driver", "inertia of the driver", "kg m^2"),
        ("inertia_driven", "inertia of the driven gear", "kg m^2"),
    ):
        values = [_shown(result.attrs.get(key)) for result in (one.record, two.record)]
        if values[0] != values[1]:
            notes.append(f"{words} differs: {values[0]} and {values[1]} {unit}".rstrip())
    return notes


def _shown(value: Any) -> str:
    return f"{float(value):.6g}" if isinstance(value, int | float) or hasattr(value, "dtype") else str(value)

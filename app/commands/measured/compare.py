"""`compare A B --out FOLDER`: two runs, records or results side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.files import fingerprint
from gearbench.shell.options import JsonOption, print_json
from gearbench.shell.output import Output, claimed

if TYPE_CHECKING:
    from gearbench.bench import Comparison


def compare(
    a: Annotated[Path, typer.Argument(metavar="A", help="folder of a run, a record, or a result")],
    b: Annotated[Path, typer.Argument(metavar="B", help="what it is compared with")],
    out: Annotated[Path, typer.Option("--out", help="folder for report, table and pictures")] = Path("out_compare"),
    force: Annotated[bool, typer.Option("--force", help="replace an earlier comparison of other things")] = False,
    as_json: JsonOption = False,
) -> None:
    """Compare two runs, records or results: compare.csv and one picture a quantity."""
    import gearbench as gb
    from gearbench.bench.results.compare import write_csv
    from gearbench.figures.records.compare import draw_comparison

    found = gb.compare(a, b)
    with claimed(out, "compare", fingerprint(str(a.resolve()), str(b.resolve())), force) as output:
        output.write("compare.csv", lambda path: write_csv(found.rows, path))
        pictures = draw_comparison(output, found.a, found.b)
        _write_report(output, found)
    if as_json:
        keys = ("quantity", "phase_or_band", "unit", "a", "b", "difference", "percent")
        table = [{key: getattr(row, key) for key in keys} for row in found.totals]
        print_json({"folder": str(out), "pictures": pictures, "notes": found.notes, "rows": table})
        return
    for row in found.totals:
        name = f"{row.quantity}, {row.phase_or_band}"
        change = f"{row.percent:>+8.1f} %" if row.of_difference is None else f"{row.difference:>8.3g} {row.unit} apart"
        typer.echo(f"{name:<48} {row.a:>10.5g} {row.b:>10.5g} {row.unit:<5} {change}")
    for note in found.notes:
        typer.echo(f"note: {note}")
    typer.echo(f"{out}: report.html, compare.csv, {', '.join(pictures)}")


def _write_report(output: Output, found: Comparison) -> None:
    from gearbench.report.compare import compare_page
    from gearbench.report.where import REPORT

    digests = output.files()
    about = {"compare.csv": "every quantity, phase by phase and band by band"}
    files = {name: (about.get(name, "picture"), digest) for name, digest in digests.items() if name != REPORT}
    output.write_text(REPORT, compare_page(found, output.path, files))

"""`validate`: the numbers to reach, and what is got."""

from __future__ import annotations

from typing import Annotated

import typer

from gearbench.shell.failure import DEFECT, InputError
from gearbench.shell.options import JsonOption, print_json


def validate(
    only: Annotated[
        list[str] | None, typer.Option("--only", help="checks whose name begins so; may be repeated")
    ] = None,
    show: Annotated[bool, typer.Option("--list", help="list the checks without running them")] = False,
    as_json: JsonOption = False,
) -> int | None:
    """Measure every number that has a reach: reach, got, pass, fail or not-run. A fail exits 1."""
    from gearbench.commands.house.checks import checks, folder, run

    available = checks()
    if not available:
        raise InputError(f"validate needs the checks in {folder()}, which exist in a checkout only")
    wanted = [c for c in available if not only or any(c.name.startswith(o) for o in only)]
    if not wanted:
        raise InputError(
            f"--only {' '.join(only or [])} matches no check; there are {', '.join(c.name for c in available)}"
        )
    if show:
        for check in wanted:
            typer.echo(f"{check.name:28} {check.what}")
        return None
    rows = []
    failed = False
    if not as_json:
        typer.echo(f"{'check':28} {'reach':>14} {'got':>12}  {'':8} what")
    for result in run(wanted):
        check = result.check
        failed |= result.outcome == "fail"
        rows.append(
            {
                "name": check.name,
                "what": check.what,
                "unit": check.unit,
                "reach": check.reach,
                "least": check.least,
                "got": result.got,
                "outcome": result.outcome,
                "note": result.note,
            }
        )
        if not as_json:
            reach = f"{'>=' if check.least else '<='} {check.reach:g} {check.unit}"
            got = "-" if result.got is None else f"{result.got:.3g}"
            note = f" ({result.note})" if result.note else ""
            typer.echo(f"{check.name:28} {reach:>14} {got:>12}  {result.outcome:8} {check.what}{note}")
    if as_json:
        print_json(rows)
    return DEFECT if failed else None

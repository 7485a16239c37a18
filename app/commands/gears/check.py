"""`check CASE`: the data sheet of a case."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.shell.failure import InputError
from gearbench.shell.options import CaseArgument, JsonOption, SetOption, check_picture, load_case, print_json
from gearbench.shell.progress import Progress
from gearbench.words.combs import comb_data, comb_lines, comb_reports
from gearbench.words.rig import effect_lines

if TYPE_CHECKING:
    from gearbench.geometry.pair.datasheet import Datum
    from gearbench.rig import Case


def check(
    case: CaseArgument,
    diameter: Annotated[
        list[float] | None,
        typer.Option("--diameter-mm", help="give the tooth thickness at this diameter too (may be repeated)"),
    ] = None,
    diagnosis: Annotated[
        bool,
        typer.Option(
            "--diagnosis",
            help="instead: what a diagnosis could tell from this experiment (half a minute): the smallest size of each"
            " effect that it would find, what it would mix up, what each record and channel is worth",
        ),
    ] = False,
    figure: Annotated[
        Path | None, typer.Option("--figure", help="with --diagnosis: picture of it as well (.png, .svg, .pdf)")
    ] = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print the data sheet of a case: diameters, contact ratio, sliding, backlash, gauges, masses; or what is wrong.

    What mesh, static and simulate would refuse is refused here, but for what only a solution can show.
    The rig's effects are named by their keys. For a comb multisine also its residue and which kinds of response then
    share lines.
    """
    loaded = load_case(case, settings)
    from gearbench.bench.elastic.crack import crack_lines
    from gearbench.bench.readiness import check_case
    from gearbench.geometry import data_sheet
    from gearbench.rig import effects_in

    rows = data_sheet(loaded.rig, [1e-3 * number for number in diameter or []])
    check_case(loaded)
    if figure is not None and not diagnosis:
        raise InputError("--figure is the picture of --diagnosis, which is not asked for")
    if diagnosis:
        _check_plan(loaded, case, figure, as_json)
        return
    combs = comb_reports(loaded.experiments() if loaded.stated else [])
    if as_json:
        data = {row.name: {"value": row.value, "unit": row.unit} for row in rows}
        effects = list(effects_in(loaded.rig))
        print_json({"case": loaded.name, "data": data, "effects": effects, "combs": [comb_data(one) for one in combs]})
        return
    typer.echo(f"{loaded.name}\n")
    _print_sheet(rows)
    effects_said = effect_lines(loaded.rig)
    if effects_said:
        typer.echo("\n  " + "\n  ".join(effects_said))
    for line in crack_lines(loaded.rig, loaded.simulation.element_size, loaded.simulation.modes):
        typer.echo(f"\n  {line}")
    for comb in combs:
        typer.echo("\n  " + "\n  ".join(comb_lines(comb)))


def _print_sheet(rows: Sequence[Datum]) -> None:
    """Rows of both gears together, then those of either in columns."""
    shared = [row for row in rows if not row.name.startswith(("driver ", "driven "))]
    for row in shared:
        typer.echo(f"  {row.name:<46} {_figure(row.value):>12}  {row.unit}".rstrip())
    typer.echo(f"\n  {'':<46} {'driver':>12} {'driven':>12}")
    driven = {row.name.removeprefix("driven "): row.value for row in rows if row.name.startswith("driven ")}
    for row in rows:
        name = row.name.removeprefix("driver ")
        if name != row.name:
            both = f"{_figure(row.value):>12} {_figure(driven[name]):>12}"
            typer.echo(f"  {name:<46} {both}  {row.unit}".rstrip())


def _check_plan(loaded: Case, given: str, figure: Path | None, as_json: bool) -> None:
    """What a diagnosis could tell from the case's experiment."""
    from gearbench.diagnosis.planning.plan import plan_of
    from gearbench.words.plan import plan_data, plan_lines

    if figure is not None:
        check_picture(figure, [given])
    with Progress(f"check {loaded.name}") as progress:
        plan = plan_of(loaded, progress.step)
        if figure is not None:
            from gearbench.figures.gaps.plan import draw_plan

            progress.step("figure")
            draw_plan(figure, plan)
    if as_json:
        print_json(plan_data(plan))
        return
    typer.echo("\n".join([loaded.name, "", *plan_lines(plan)]))


def _figure(value: float) -> str:
    return "-" if isnan(value) else f"{value:.6g}"

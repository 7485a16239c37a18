"""`optimise CASE --vary KEY=LOW:HIGH --for RESULT --at-nm T,..`: the values that make a result smallest."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

import typer

from gearbench.shell.options import CaseArgument, JsonOption, SetOption, load_case, print_json
from gearbench.shell.progress import Progress


def optimise(
    case: CaseArgument,
    vary: Annotated[
        list[str] | None,
        typer.Option("--vary", metavar="KEY=LOW:HIGH", help="what may move; KEY1+KEY2 move together"),
    ] = None,
    quantity: Annotated[
        str, typer.Option("--for", metavar="RESULT", help="what is to be small: te-peak-to-peak, te_order_1_um, ..")
    ] = "te-peak-to-peak",
    at_nm: Annotated[
        list[str] | None, typer.Option("--at-nm", metavar="TORQUES", help="loads, 50,100,200; absent: the case's mean")
    ] = None,
    over: Annotated[
        Literal["worst", "mean"], typer.Option("--over", help="of the results at these loads: the worst, or their mean")
    ] = "worst",
    out: Annotated[Path | None, typer.Option("--out", help="output folder; absent: optimum_NAME")] = None,
    positions: Annotated[int, typer.Option("--positions", min=8, help="mesh phases of a mesh cycle")] = 64,
    cycles: Annotated[int, typer.Option("--cycles", min=1, help="mesh cycles, where teeth differ")] = 1,
    workers: Annotated[
        int | None, typer.Option("--workers", help="processes of this machine; absent: as it has processors")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="replace what another search left in the folder")] = False,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find the values of a few keys that make a result smallest at several loads, and how flat the valley is."""
    loaded = load_case(case, settings)
    import gearbench as gb
    from gearbench.words.valley import optimum_data, optimum_lines

    folder = out or Path(f"optimum_{re.sub(r'[^A-Za-z0-9._-]+', '_', loaded.name)}")
    with Progress(f"optimise {loaded.name}") as progress:
        found = gb.optimise(
            case, vary or (), quantity, torques(at_nm), over=over, settings=settings or (), positions=positions,
            cycles=cycles, out=folder, workers=workers, force=force, progress=progress,
        )  # fmt: skip
    if as_json:
        print_json(optimum_data(found))
        return
    typer.echo("\n".join([*optimum_lines(found), f"{folder}: valley.png, valley.csv, best.toml, optimum.json"]))


def torques(given: list[str] | None) -> list[float]:
    """Loads given one by one or with commas. Raises InputError."""
    from gearbench.shell.failure import InputError

    found = []
    for part in (part.strip() for text in given or () for part in text.split(",")):
        try:
            found.append(float(part))
        except ValueError:
            raise InputError(f"--at-nm {part!r} must be a torque in N m: --at-nm 50,100,200") from None
    return found

"""`animate CASE --out FILE`: the gears moving."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gearbench.shell.options import CaseArgument, SetOption, load_case
from gearbench.shell.progress import Progress


def animate(
    case: CaseArgument,
    out: Annotated[Path, typer.Option("--out", help="page (.html), picture (.gif) or film (.mp4, by ffmpeg)")],
    torque_nm: Annotated[
        float | None, typer.Option("--torque-nm", help="driver torque [N m]; absent: the case's mean")
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option("--record", help="follow a record of this case with tooth forces, not static positions"),
    ] = None,
    frames: Annotated[int, typer.Option("--frames", help="number of pictures")] = 24,
    cycles: Annotated[float, typer.Option("--cycles", help="mesh cycles that they cover")] = 1.0,
    settings: SetOption = None,
) -> None:
    """Show the teeth going through the mesh: stress, contact forces, and the transmission error running along.

    Contact and stress are by finite elements, whatever the model of the case. With --record the mesh carries at every
    instant what the tooth forces of the record say (simulation.outputs = "teeth"), and the DTE is the record's.
    """
    loaded = load_case(case, settings)
    from gearbench.animation import animate as animated
    from gearbench.animation import check_animation
    from gearbench.shell.failure import InputError

    check_animation(out, frames, cycles)
    if any(out.resolve() == Path(one).resolve() for one in (case, record) if one is not None):
        raise InputError(f"--out {out} is one of the inputs, which it would replace: choose another name")
    with Progress(f"animate {loaded.name}") as progress:
        animated(
            loaded, out, torque=torque_nm, record=record, frames=frames, cycles=cycles, progress=progress
        )
    typer.echo(str(out))

"""What a data sheet says of a rig beside its gears: its effects by their keys, and what is of no effect."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gearbench.rig import Rig

WIDTH = 110


def effect_lines(rig: Rig) -> list[str]:
    """Lines that name what a rig has beyond an ideal one, and inertias that a prescribed speed makes idle; none for an
    ideal rig."""
    from gearbench.rig import effects_in

    found = effects_in(rig)
    said = f"beyond gears, supports and damping: {', '.join(found)}"
    lines = wrap(said, WIDTH, subsequent_indent="  ") if found else []
    for key, side in (("rig.drive", rig.drive), ("rig.load", rig.load)):
        shaft = side.coupling
        if side.boundary == "speed" and shaft is not None and shaft.inertia:
            lines.append(
                f'{key}.coupling.inertia_kg_m2 = {shaft.inertia:g} is of no effect: {key}.boundary = "speed" holds its'
                " speed"
            )
    return lines

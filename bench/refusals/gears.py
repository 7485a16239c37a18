"""What no model can do with a case's gears."""

from __future__ import annotations

from gearbench.geometry import Profile, body, pair
from gearbench.geometry.tooth.iso1328 import drawn_gear
from gearbench.geometry.tooth.micro import check_micro, check_play
from gearbench.rig import Gear, Rig


def check_gears(rig: Rig) -> None:
    """Raise GeometryError for a pair that cannot run, for masses, and for flanks that no tooth can have: relief and
    tables that miss the involute or are too deep, errors that jam the teeth, a crack that runs out of its tooth, a
    grade that ISO 1328-1 has no tolerance for."""
    meshing = pair(rig)
    sides: tuple[tuple[str, Profile, Gear], ...] = (
        ("rig.driver", meshing.driver, rig.driver),
        ("rig.driven", meshing.driven, rig.driven),
    )
    real = []
    for name, shape, gear in sides:
        body(shape, gear, rig.material.density, name)
        real.append(drawn_gear(gear, name))
        check_micro(shape, real[-1], name)
        if gear.crack is not None and gear.crack.length:
            # Imported on use: few gears have a crack.
            from gearbench.geometry.tooth.crack import slit

            slit(shape, gear, gear.crack, name)
    check_play(meshing.backlash_normal, (real[0], real[1]))

"""The contact law of a pair with its load-approach curves on disk."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearbench.fem.contact.law import Curve, Law, elastic_pair, make_law
from gearbench.fem.gear.body import CondensedGear
from gearbench.fem.gear.store import Arrays, cached, gear_key, key_for
from gearbench.geometry.mesh.sector import Element
from gearbench.rig import Rig, sound_gear


def stored_law(
    rig: Rig,
    gears: tuple[CondensedGear, CondensedGear],
    element_size: float | None = None,
    modes: int = 8,
    element: Element = "triangle",
) -> Law:
    """`make_law(...)` of a rig's pair, its load-approach curves from disk where they have been solved before."""
    meshing = elastic_pair(rig)
    # A crack adds to the flexibility beside the curves of sound teeth.
    parts = [gear_key(sound_gear(g), rig.material, element_size, modes, element) for g in (rig.driver, rig.driven)]
    key = key_for("law", {"driver": parts[0], "driven": parts[1], "centre": meshing.centre_distance})
    made: list[Law] = []
    real = (rig.driver, rig.driven)

    def make() -> Arrays:
        made.append(make_law(meshing, *gears, rig.material, gears=real))
        curves = made[0].curves.driver, made[0].curves.driven
        return {f"{name}{i}": np.asarray(v) for i, c in enumerate(curves) for name, v in c._asdict().items()}

    arrays = cached(key, make)
    if made:
        return made[0]

    def curve(number: int) -> Curve:
        values: list[Any] = [arrays[f"{name}{number}"] for name in Curve._fields]
        plain: list[Any] = [float(v) if v.ndim == 0 else v for v in values]
        return Curve(*plain)

    return make_law(meshing, *gears, rig.material, curves=(curve(0), curve(1)), gears=real)

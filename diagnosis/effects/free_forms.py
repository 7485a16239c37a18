"""Free forms: smooth or tooth-wise departures at a place that name no effect, to compete with those that do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearbench.diagnosis.effects import tooth_crack
from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.forces.basis import KNOTS
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.equations import Equation
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, group

DISSIPATION = "dissipation"
FILTERS = {equation: f"filter-{equation.place}" for equation in Equation}
# Part of the mesh force, at every knot, that an equation misses: 3 % is the error of a sound rig's equations; a free
# one may miss all of it.
FILTER_SD, FILTER_WIDE = 0.03, 1.0
# Quadratic damping, as parts of the mesh's linear damping at 30 mm/s: a tenth, and twice all of it.
DAMPING_SD, DAMPING_WIDE, RATE = 0.1, 2.0, 0.03


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """Smooth filters of each equation, and dissipation with the square of the rate. (Free stiffness of single teeth is
    that of `tooth_crack`, for all teeth at once.)"""
    complex_knots = [f"{part}@{knot:g}" for part in ("re", "im") for knot in KNOTS]
    filters = (
        group(key, "1", complex_knots, FILTER_SD, FILTER_WIDE, slot="filters", first=int(one) * len(complex_knots))
        for one, key in FILTERS.items()
    )
    level = float(np.mean([condition.stiffness_level for condition in conditions]))
    sd = DAMPING_SD * 2 * model.mesh_ratio * float(np.sqrt(level * model.mesh_mass)) / RATE
    wide = DAMPING_WIDE / DAMPING_SD * sd
    return (*filters, group(DISSIPATION, "N s2/m2", ("quadratic",), sd, wide, slot="dissipation"))


def free_forms() -> tuple[Hypothesis, ...]:
    """Competitors that name a place but no effect."""
    return (
        Hypothesis("free mesh", "mesh", (Wide(tooth_crack.KEY),)),
        Hypothesis("free dissipation", "mesh", (Wide(DISSIPATION),)),
        *(Hypothesis(f"free {one.place}", one.place, (Wide(key),)) for one, key in FILTERS.items()),
    )

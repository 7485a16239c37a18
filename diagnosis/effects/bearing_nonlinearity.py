"""A support whose stiffness changes with its deflection, as a power of it."""

from __future__ import annotations

from collections.abc import Sequence

from gearbench.diagnosis.effects.effect import (
    SIDES,
    SUPPORT_PLACES,
    Added,
    Effect,
    Estimate,
    Fitted,
    Hypothesis,
    Wide,
    changed,
    of_gears,
)
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, group
from gearbench.rig import Rig

# Groups by gear.
KEYS = {side: f"bearing-{side}" for side in SIDES}
# Exponent of the secant stiffness over the deflection: 0.35 is severity 1 of the truth rigs; Hertz's point contact in a
# ball bearing has 0.5. Sound supports have a tenth. Bounds: at -1 the force would not change with the deflection.
SD, WIDE = 0.03, 0.35
LOW, HIGH = -0.8, 2.0
RIG_LOW, RIG_HIGH = -0.89, 3.0  # what a rig may have


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """The exponent beyond the nominal one, for either support."""
    return tuple(
        group(key, "1", ("exponent",), SD, WIDE, slot="exponent", first=number, low=LOW, high=HIGH)
        for number, key in enumerate(KEYS.values())
    )


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """One support of the two."""
    return tuple(
        Hypothesis(f"bearing-nonlinearity {side}", SUPPORT_PLACES[side], (Wide(key),), (side,), len(KEYS))
        for side, key in KEYS.items()
    )


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Gives the support in question its exponent, about the deflection at which the stated stiffness holds."""
    (side,) = hypothesis.on
    number, key = SIDES.index(side), KEYS[side]
    exponent = fitted.model.exponent[number] + float(fitted.of(key)[0])
    support = getattr(rig.support, side).model_copy(
        update={
            "exponent": min(max(exponent, RIG_LOW), RIG_HIGH),
            "reference_deflection": fitted.model.reference[number],
        }
    )
    rig = changed(rig, "support", **{side: support})
    return rig, (Estimate(f"{side}.exponent", exponent, float(fitted.std_of(key)[0]), "1", signed=True),)


BEARING_NONLINEARITY = Effect(
    name="bearing-nonlinearity",
    noun="a support that stiffens with its deflection",
    meaning="The support's stiffness changes with its load, as that of rolling bearings with clearance or little"
    " preload does: check bearings and preload.",
    parameters={"exponent": "exponent of stiffness over deflection"},
    fields=of_gears("rig.support.{}.exponent") + of_gears("rig.support.{}.reference_deflection"),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
)

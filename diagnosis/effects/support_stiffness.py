"""A support far stiffer or softer than the nominal one: by more than the nominal uncertainty makes likely."""

from __future__ import annotations

from math import exp, log

from gearbench.diagnosis.effects.effect import (
    BEYOND,
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
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.rig import Rig

KEY = "stiffness"  # of the background: logarithms of the factors on both supports
# Logarithm: a wrong bearing, a loose foot or a missing preload changes a support by a factor of two or so; at least
# five standard deviations of the nominal one, or the prior would not be a wider one.
WIDE, WIDER = log(2.0), 5.0


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """One support of the two."""
    return tuple(
        Hypothesis(
            f"support-stiffness {side}",
            SUPPORT_PLACES[side],
            (Wide(KEY, number, max(WIDE, WIDER * model.sd_stiffness[number])),),
            (side,),
            len(SIDES),
        )
        for number, side in enumerate(SIDES)
    )


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Gives the support in question the stiffness that was fitted."""
    (side,) = hypothesis.on
    number = SIDES.index(side)
    stiffness = fitted.model.stiffness[number] * exp(fitted.of(KEY)[number])
    support = getattr(rig.support, side).model_copy(update={"stiffness": stiffness})
    std = stiffness * float(fitted.std_of(KEY)[number])
    return changed(rig, "support", **{side: support}), (Estimate(f"{side}.stiffness", stiffness, std, "N/m"),)


SUPPORT_STIFFNESS = Effect(
    name="support-stiffness",
    noun="another stiffness of a support",
    meaning="The support is far stiffer or softer than the nominal rig has it: check its fastening, bearings and"
    " preload, and the nominal value itself.",
    parameters={"stiffness": "stiffness of the support"},
    fields=of_gears("rig.support.{}.stiffness"),
    hypotheses_of=hypotheses,
    add=add,
    least_size=BEYOND,
)

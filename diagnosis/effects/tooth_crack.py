"""A cracked tooth: one tooth has lost a part of its bending stiffness."""

from __future__ import annotations

from collections.abc import Sequence

from gearbench.diagnosis.effects.effect import (
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
from gearbench.rig.gear import Crack

KEY = "crack"  # of all teeth, the driver's first
# Part of the bending stiffness that is lost: 0.35 is severity 1 of the truth rigs; 0.02 what teeth of one gear differ
# by. Bounds keep the flexibility 1 / (1 - loss) positive and below ten times the sound one.
SD, WIDE = 0.02, 0.35
LOW, HIGH = -2.0, 0.9
# Of those, in SD, the least that is a crack: the softest tooth of a sound pair of gears is off by two, and told to one.
LEAST = 3.0
LARGEST = 0.95  # loss of a rig's crack


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """The loss of every tooth."""
    return (group(KEY, "1", sum(model.teeth), SD, WIDE, slot="loss", low=LOW, high=HIGH),)


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """One tooth of all."""
    count = sum(model.teeth)
    return tuple(
        Hypothesis(
            f"tooth-crack {number}",
            "mesh",
            (Wide(KEY, number),),
            ("driver" if number < model.teeth[0] else "driven",),
            count,
            representative=number in (0, model.teeth[0]),
        )
        for number in range(count)
    )


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Cracks the tooth in question, within what a rig may have."""
    number, (side,) = hypothesis.wide[0].at, hypothesis.on
    assert number is not None
    tooth = number if side == "driver" else number - fitted.model.teeth[0]
    value, std = float(fitted.of(KEY)[number]), float(fitted.std_of(KEY)[number])
    rig = changed(rig, side, crack=Crack(tooth=tooth, stiffness_loss=min(max(value, 0.0), LARGEST)))
    return rig, (
        Estimate(f"{side}.tooth", float(tooth), 0.0, "1", sized=False),
        Estimate(f"{side}.stiffness_loss", value, std, "1"),
    )


TOOTH_CRACK = Effect(
    name="tooth-crack",
    noun="a cracked tooth",
    meaning="One tooth gives way more than the others: look for a crack at its root.",
    parameters={"tooth": "number of the tooth", "stiffness_loss": "part of the bending stiffness that is lost"},
    fields=of_gears("rig.{}.crack"),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
    least_size=LEAST,
    most_refits=2,  # the quadratic ranks teeth well: more would take the places of other effects
    model_error=0.30,  # rms on the calibration family (benchmarks/diagnosis_log.md)
)

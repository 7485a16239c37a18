"""More (or less) backlash than the nominal gears have. It shows only where flanks separate."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos

from gearbench.diagnosis.effects.effect import (
    SIDES,
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

KEY = "backlash"
# Over the deflection of the mesh. A worn or badly set centre distance: severity 1 of the truth rigs of `challenge`.
# Sound gears keep to a tenth of it.
SD, WIDE = 1.3, 13.0


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """Backlash along the line of action beyond the nominal one."""
    return (group(KEY, "m", ("more",), SD * model.deflection, WIDE * model.deflection, slot="backlash"),)


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """The pair has one backlash."""
    return (Hypothesis("backlash", "mesh", (Wide(KEY),)),)


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Thins the teeth of both gears alike."""
    more, std = float(fitted.of(KEY)[0]), float(fitted.std_of(KEY)[0])
    for side in SIDES:
        gear = getattr(rig, side)
        thinning = gear.thinning + 0.5 * more / cos(gear.pressure_angle)
        rig = changed(rig, side, thinning=max(thinning, 0.0))
    return rig, (Estimate("more", more * 1e6, std * 1e6, "um"),)


BACKLASH = Effect(
    name="backlash",
    noun="backlash",
    meaning="The flanks separate over another distance than the nominal gears allow: check the centre distance and the"
    " thickness of the teeth.",
    parameters={"more": "backlash beyond the nominal one"},
    fields=of_gears("rig.{}.thinning"),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
    model_error=0.06,  # rms on the calibration family (benchmarks/diagnosis_log.md)
)

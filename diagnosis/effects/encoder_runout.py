"""Run-out of an encoder: its grating turns about an axis beside the shaft's, and reads it late and early in turn."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.eccentricity import KEYS as RUNOUTS
from gearbench.diagnosis.effects.effect import (
    SIDES,
    Added,
    Effect,
    Estimate,
    Fitted,
    Hypothesis,
    Wide,
    changed,
    twins_of,
)
from gearbench.diagnosis.effects.once_per_turn import ENCODERS, once_of
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, group
from gearbench.rig import Rig

KEYS = ENCODERS
# Along the base circle over the deflection of the mesh: what grating and centring of a good encoder leave, and an
# encoder set on its shaft like a gear of severity 1 on its own.
SD, WIDE = 0.03, 0.5
# Of what the encoder adds to the transmission error, from which what it lacks in the mesh follows.
ADDS = {"driver": 1.0, "driven": -1.0}


def _lacking(side: str, condition: Condition) -> NDArray[np.float64]:
    """Excess (2, N) that the measured transmission error lacks, per unit of cosine and sine part."""
    return -ADDS[side] * condition.lobes[SIDES.index(side)]


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """Cosine and sine part of what either encoder reads ahead, along its gear's base circle."""
    sound, large = SD * model.deflection, WIDE * model.deflection
    return tuple(
        group(key, "m", ("cos", "sin"), sound, large, slot="closed", basis=partial(_lacking, side))
        for side, key in KEYS.items()
    )


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """One encoder of the two. To forces alone it looks like a gear's run-out, and represents nothing that they could
    tell apart; in simulation both differ by what inertias make of the latter, and gears stand out by more, as a
    rule. Of gears with as many teeth either one may look like either encoder."""
    return tuple(
        Hypothesis(
            f"encoder-runout {side}",
            "sensor",
            (Wide(key),),
            (side,),
            len(KEYS),
            representative=False,
            usual=((RUNOUTS[side], *twins_of(RUNOUTS, side, model.teeth)), -ADDS[side]),
            twins=twins_of(KEYS, side, model.teeth),
        )
        for side, key in KEYS.items()
    )


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Adds what was fitted to the run-out of both encoders; estimates are given of the one in question."""
    out: list[Estimate] = []
    update = {}
    for side, key in KEYS.items():
        field, radius = f"encoder_runout_{side}", fitted.model.base_radius[SIDES.index(side)]
        present = (getattr(rig.sensors, field), getattr(rig.sensors, f"{field}_phase"))
        found = once_of(*present, fitted.of(key) / radius, fitted.std_of(key) / radius)
        update[field], update[f"{field}_phase"] = found.size, found.angle
        if side in hypothesis.on:
            out += found.estimates(f"{side}.encoder_runout", 1e6, "urad")
    return changed(rig, "sensors", **update), tuple(out)


ENCODER_RUNOUT = Effect(
    name="encoder-runout",
    noun="run-out of an encoder",
    meaning="An angle is read ahead and late once per revolution, and nothing else moves with it: check how the"
    " encoder is centred on its shaft. Read at another speed or with a second reading head it stays what it is, while"
    " teeth that stand out shake the gears the more the faster they turn.",
    parameters={
        "encoder_runout": "amplitude of what the encoder reads ahead",
        "encoder_runout_phase": "angle at which the encoder reads farthest ahead",
    },
    fields=tuple(f"rig.sensors.encoder_runout_{side}{part}" for side in SIDES for part in ("", "_phase")),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
)

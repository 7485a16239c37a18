"""Run-out of a gear: its teeth turn about an axis beside its own, once per revolution."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

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
    twins_of,
)
from gearbench.diagnosis.effects.once_per_turn import ENCODERS, once_of
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, group
from gearbench.rig import Rig

# Groups by gear.
KEYS = {side: f"eccentricity-{side}" for side in SIDES}
# Half of the run-out over the deflection of the mesh: truth rigs of severity 1 have 0.8, of which either part is some
# 0.5; sound gears a tenth.
SD, WIDE = 0.05, 0.5


def _turning(side: int, condition: Condition) -> NDArray[np.float64]:
    """Cosine and sine (2, N) of a gear's rotation."""
    return condition.lobes[side]


def _levers(side: int, condition: Condition) -> NDArray[np.float64]:
    """What both parts add to the levers (2, 3, N)."""
    return condition.leaning[side]


def _ends(side: int, condition: Condition) -> NDArray[np.float64]:
    """How far both parts turn the mesh on (2, N)."""
    return condition.ends[side]


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """Cosine and sine part of the excess material along the line of action, for either gear."""
    sound, large = SD * model.deflection, WIDE * model.deflection
    return tuple(
        group(
            *(key, "m", ("cos", "sin"), sound, large),
            slot="closed",
            basis=partial(_turning, number),
            also={"levers": partial(_levers, number), "turned": partial(_ends, number)},
        )
        for number, key in enumerate(KEYS.values())
    )


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """One gear of the two."""
    return tuple(
        Hypothesis(
            f"eccentricity {side}", "mesh", (Wide(key),), (side,), len(KEYS), twins=twins_of(KEYS, side, model.teeth)
        )
        for side, key in KEYS.items()
    )


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Adds what was fitted to the run-out of both gears; estimates are given of the gear in question, no better known
    than what the same fit ascribes to its encoder."""
    out: list[Estimate] = []
    for side, key in KEYS.items():
        gear = getattr(rig, side)
        found = once_of(0.5 * gear.runout, gear.runout_phase, fitted.of(key), fitted.std_of(key))
        rig = changed(rig, side, runout=2 * found.size, runout_phase=found.angle)
        if side in hypothesis.on:
            if ENCODERS[side] in fitted.unknowns.slices:
                found = found.beside(fitted.of(ENCODERS[side]))
            out += found.estimates(f"{side}.runout", 2e6, "um")
    return rig, tuple(out)


ECCENTRICITY = Effect(
    name="eccentricity",
    noun="run-out of a gear",
    meaning="The teeth stand farther out on one side of the gear than on the other: check how it is seated on its"
    " shaft, and the shaft's own run-out. An encoder that sits off its axis reads the same at low speed: check both.",
    parameters={"runout": "run-out", "runout_phase": "angle at which the teeth stand out most"},
    fields=of_gears("rig.{}.runout") + of_gears("rig.{}.runout_phase"),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
    model_error=0.04,  # rms on the calibration family (benchmarks/diagnosis_log.md)
)

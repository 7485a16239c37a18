"""Pitch errors: every tooth of a gear stands a little before or behind its place."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np

from gearbench.diagnosis.effects.effect import (
    BEYOND,
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
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, group
from gearbench.geometry.tooth.iso1328 import DIAMETERS, MODULES, tolerances
from gearbench.rig import Rig

# Groups by gear.
KEYS = {side: f"pitch-{side}" for side in SIDES}
# Of each tooth over the deflection of the mesh: an rms of 0.5 is severity 1 of the truth rigs of `challenge`; sound
# gears have a tenth.
SD, WIDE = 0.04, 0.4
# Of the single pitch tolerance of the best grade (ISO 1328-1:2013) the part that no gear is made without, as an rms,
# however little its teeth are loaded.
GRADE, MADE = 1, 0.1
# Over the former, from which gears are uneven: fifty teeth tell half as much again of it from none, but not good gears
# from very good ones, of which both are sound.
LEAST = 2.5


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """Excess material of every tooth."""
    first = dict(zip(SIDES, (0, model.teeth[0]), strict=True))
    counts = dict(zip(SIDES, model.teeth, strict=True))
    out = []
    for side, key in KEYS.items():
        sound = max(SD * model.deflection, made(model, counts[side]))
        large = max(WIDE * model.deflection, BEYOND * sound)
        out.append(group(key, "m", counts[side], sound, large, slot="pitch", first=first[side]))
    return tuple(out)


def made(model: NominalModel, teeth: int) -> float:
    """Rms [m] of the pitch errors that the best gear of so many teeth has: by its base pitch, which tells the module
    but for the pressure angle's cosine, and as the nearest one that the standard knows."""
    least, most = (1e-3 * one for one in MODULES)
    module = min(max(model.law.base_pitch / pi, least, 1e-3 * DIAMETERS[0] / teeth), most)
    return MADE * tolerances(module, teeth, GRADE).single_pitch


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """Either gear, or both."""
    chosen = {"driver": SIDES[:1], "driven": SIDES[1:], "both": SIDES}
    return tuple(
        Hypothesis(
            f"pitch-error {name}",
            "mesh",
            tuple(Wide(KEYS[side]) for side in sides),
            sides,
            len(chosen),
            twins=twins_of(KEYS, name, model.teeth) if name in SIDES else (),
        )
        for name, sides in chosen.items()
    )


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Adds what was fitted to the pitch errors of both gears; estimates are given of the gears in question."""
    out: list[Estimate] = []
    for side, key in KEYS.items():
        gear = getattr(rig, side)
        present = np.array(gear.pitch_error) if gear.pitch_error else np.zeros(gear.teeth)
        total = present + fitted.of(key)
        rig = changed(rig, side, pitch_error=tuple(float(v) for v in total))
        if side in hypothesis.on:
            std = float(np.sqrt((fitted.std_of(key) ** 2).mean() / 2))
            out.append(Estimate(f"{side}.rms", float(np.std(total)) * 1e6, std * 1e6, "um"))
    return rig, tuple(out)


PITCH_ERROR = Effect(
    name="pitch-error",
    noun="uneven pitch of the teeth",
    meaning="The teeth are not evenly spaced: measure the pitch of the gear, or turn the gears to other pairings and"
    " see whether the pattern moves.",
    parameters={"rms": "rms of the pitch errors"},
    fields=of_gears("rig.{}.pitch_error"),
    least_size=LEAST,
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
    # Where flanks separate a rig's structure imitates them: up to 52 nats on controls of the calibration family, 84 and
    # more on rigs that have them (benchmarks/diagnosis_log.md).
    limit=60.0,
    model_error=0.23,  # rms on the calibration family
)

"""Flanks that depart from the nominal ones, all teeth alike: an error that every pair repeats along its path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Added, Effect, Estimate, Fitted, Hypothesis, Wide, changed
from gearbench.diagnosis.effects.recalibrated import added
from gearbench.diagnosis.forces.basis import SHAPE_ORDERS, waves
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, group
from gearbench.rig import Rig

KEY = "profile"
# At each mesh order, over the deflection of the mesh: of good flanks, and of those whose relief is that of another
# load, which is as large as the deflection.
SD, WIDE = 0.08, 0.4
PHASES = 128


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """Cosine and sine of the excess material of all pairs, at every mesh order."""
    return (group(KEY, "m", 2 * SHAPE_ORDERS, SD * model.deflection, WIDE * model.deflection, slot="profile"),)


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """The one mesh: what one gear's flanks lack, its mate's may have."""
    return (Hypothesis("profile-error", "mesh", (Wide(KEY),)),)


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Gives the mesh the error over its phase that was fitted; its size is told from peak to valley."""
    model, values = fitted.model, fitted.of(KEY)
    cosine, sine = added(model.error_cos, values[0::2]), added(model.error_sin, values[1::2])
    size, std = _peak_to_valley(values, fitted.std_of(KEY))
    rig = changed(rig, "mesh", error_cos=cosine, error_sin=sine)
    return rig, (Estimate("peak_to_valley", 1e6 * size, 1e6 * std, "um"),)


def _peak_to_valley(values: NDArray[np.float64], std: NDArray[np.float64]) -> tuple[float, float]:
    """Size of a series of cosines and sines in turn (2 orders,), and its standard deviation."""
    wave = waves(np.arange(PHASES) / PHASES)
    error = values @ wave
    between = wave[:, error.argmax()] - wave[:, error.argmin()]
    return float(np.ptp(error)), float(np.sqrt(((between * std) ** 2).sum()))


PROFILE_ERROR = Effect(
    name="profile-error",
    noun="an error of the flanks' profile",
    meaning="The flanks of all teeth depart from the nominal profile, by the same at any load: measure profile slope"
    " and form of both gears, and check whether reliefs are those of the drawing.",
    parameters={"peak_to_valley": "error along the line of action from peak to valley, over the mesh phase"},
    fields=("rig.mesh.error_cos", "rig.mesh.error_sin"),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
)

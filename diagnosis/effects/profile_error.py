"""Flanks that depart from the nominal ones, all teeth alike: an error that every pair repeats along its path.

Of two kinds: what all pairs in contact have at once, a wave over the mesh phase, and the form of the flanks themselves,
which moves the load from one pair in contact to the next, as reliefs do.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Added, Effect, Estimate, Fitted, Hypothesis, Wide, changed
from gearbench.diagnosis.effects.recalibrated import added
from gearbench.diagnosis.forces.basis import PLACES_ON_PATH, SHAPE_ORDERS, waves
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, group
from gearbench.rig import Gear, Rig

Array = NDArray[np.float64]

KEY, FLANKS = "profile", "flanks"
# At each mesh order, over the deflection of the mesh: of good flanks, and of those whose relief is that of another
# load, which is as large as the deflection.
SD, WIDE = 0.08, 0.4
# Likewise at each place along the path of contact, where other teeth than the nominal ones differ in stiffness too.
SD_FORM, WIDE_FORM = 0.2, 1.2
PHASES = 128
# Of reliefs to begin from: depths over the deflection of the mesh, and parts of the path of contact that they take.
DEPTHS, LENGTHS = (1.0, 2.0, 3.0, 4.5), (0.25, 0.5)
MIDDLE = PLACES_ON_PATH.index(0.5)
LEAST_ROLL = 1e-6  # rad; a table of a flank's form begins beyond the base circle


def _flanks(condition: Condition) -> Array:
    """What the mesh has of the form at each place (places, N)."""
    return condition.flanks


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """Excess material of all pairs: cosine and sine at every mesh order, and each pair's own along its path."""
    one = model.deflection
    return (
        group(KEY, "m", 2 * SHAPE_ORDERS, SD * one, WIDE * one, slot="profile"),
        group(FLANKS, "m", len(PLACES_ON_PATH), SD_FORM * one, WIDE_FORM * one, slot="excess", basis=_flanks),
    )


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """The one mesh: what one gear's flanks lack, its mate's may have."""
    return (
        Hypothesis("profile-error", "mesh", (Wide(KEY),), choices=2),
        Hypothesis("profile-error flanks", "mesh", (Wide(FLANKS),), choices=2),
    )


def shapes(model: NominalModel) -> Array:
    """Reliefs (n, places) that the nominal flanks lack, long and short, of either tip and of both, and such as they
    have too much: what is deeper than the mesh yields changes nothing more, so that no slope leads there."""
    place = np.array(PLACES_ON_PATH)
    out = []
    for length in LENGTHS:
        entry, leaving = (np.maximum(1.0 - away / length, 0.0) for away in (place, 1.0 - place))
        for form in (entry, leaving, entry + leaving):
            out += [-depth * form for depth in DEPTHS]
        out.append(entry + leaving)
    return model.deflection * np.array(out)


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Gives the mesh the error over its phase that was fitted, and each gear the form from the pitch point to its tip,
    which its mate's root may have as well; sizes are told from peak to valley."""
    model, values, form = fitted.model, fitted.of(KEY), fitted.of(FLANKS)
    cosine, sine = added(model.error_cos, values[0::2]), added(model.error_sin, values[1::2])
    rig = changed(rig, "mesh", error_cos=cosine, error_sin=sine)
    if form.any():
        path, middle = model.path, np.arange(len(form)) < MIDDLE
        travel = model.law.base_pitch * (path[0] + (path[1] - path[0]) * np.array(PLACES_ON_PATH))
        of_driver = np.where(middle, form[MIDDLE], form)
        rig = changed(rig, "driver", **_formed(rig.driver, model, 0, travel, of_driver))
        rig = changed(rig, "driven", **_formed(rig.driven, model, 1, -travel[::-1], (form - of_driver)[::-1]))
    if any(wide.key == FLANKS for wide in hypothesis.wide):
        return rig, _along_path(form, fitted.std_of(FLANKS))
    size, std = _peak_to_valley(values, fitted.std_of(KEY))
    return rig, (Estimate("peak_to_valley", 1e6 * size, 1e6 * std, "um"),)


def _formed(gear: Gear, model: NominalModel, side: int, travel: Array, form: Array) -> dict[str, object]:
    """Fields of the form of driver (0) or driven gear (1), that at distances towards its tip [m] added."""
    radius = model.base_radius[side]
    roll = np.maximum((model.law.pitch_roll[side] + travel) / radius, LEAST_ROLL)
    roll[1:] = np.maximum(roll[1:], roll[0] + LEAST_ROLL * np.arange(1, len(roll)))
    places, height = roll, form
    if gear.profile_form:
        before = np.array(gear.profile_form_roll) if gear.profile_form_roll else _rolls(gear, radius)
        factor = gear.profile_form_tooth[0] if gear.profile_form_tooth else 1.0
        places = np.union1d(roll, before)
        height = np.interp(places, roll, form) + factor * np.interp(places, before, gear.profile_form)
    return {
        "profile_form": tuple(height.tolist()),
        "profile_form_roll": tuple(places.tolist()),
        "profile_form_diameter": (),
        "profile_form_tooth": (),
    }


def _rolls(gear: Gear, radius: float) -> Array:
    """Roll angles [rad] of the diameters of a gear's form."""
    return np.array([sqrt(max((0.5 * one / radius) ** 2 - 1.0, 0.0)) for one in gear.profile_form_diameter])


def _along_path(form: Array, std: Array) -> tuple[Estimate, ...]:
    """Size of a form (places,) from peak to valley, and how far both ends of the path stand out over its middle."""
    high, low = int(form.argmax()), int(form.argmin())
    out = [Estimate("peak_to_valley", 1e6 * float(form[high] - form[low]), 1e6 * _both(std, high, low), "um")]
    for name, end in (("driven_tip", 0), ("driver_tip", -1)):
        out.append(Estimate(name, 1e6 * float(form[end] - form[MIDDLE]), 1e6 * _both(std, end, MIDDLE), "um"))
    return tuple(out)


def _both(std: Array, one: int, other: int) -> float:
    return float(np.hypot(std[one], std[other]))


def _peak_to_valley(values: Array, std: Array) -> tuple[float, float]:
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
    parameters={
        "peak_to_valley": "error along the line of action from peak to valley",
        "driven_tip": "excess where the driven gear's tips come into mesh, over that in the middle of the path",
        "driver_tip": "excess where the driver's tips leave the mesh, over that in the middle of the path",
    },
    fields=(
        *("rig.mesh.error_cos", "rig.mesh.error_sin"),
        *(f"rig.{gear}.profile_form{of}" for gear in ("driver", "driven") for of in ("", "_roll")),
    ),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
    shapes=shapes,
    shaped=FLANKS,
)

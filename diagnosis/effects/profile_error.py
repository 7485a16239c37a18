"""Flanks that depart from the nominal ones, all teeth alike: an error that every pair repeats along its path.

Of three kinds: what all pairs in contact have at once, a wave over the mesh phase; the form of the flanks themselves,
which moves the load from one pair in contact to the next, as reliefs do; and of all forms slope and barrelling, which
grinding leaves, by two numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Added, Effect, Estimate, Fitted, Hypothesis, Wide, changed
from gearbench.diagnosis.effects.recalibrated import added
from gearbench.diagnosis.forces.basis import FORM_PARTS, PLACES_ON_PATH, SHAPE_ORDERS, in_parts, waves
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, Unknowns, group
from gearbench.rig import Gear, Rig

Array = NDArray[np.float64]

KEY, FLANKS = "profile", "flanks"
# At each mesh order, over the deflection of the mesh: of good flanks, and of those whose relief is that of another
# load, which is as large as the deflection.
SD, WIDE = 0.08, 0.4
# Of the form of the flanks along the path of contact, by its parts: teeth of another stiffness than the nominal ones
# have a zigzag of their own, and far less of a slope or a barrelling, which are ground. What is even is no form.
NAMES = ("even", "slope", "barrelling", "cubic", "quartic", "quintic", "sextic")
EVEN = NAMES.index("even")
GROUND = ("slope", "barrelling")
SD_FORM = (0.08, 0.06, 0.08, 0.2, 0.2, 0.2, 0.2)
WIDE_FORM = (0.5, 0.6, 1.2, 1.2, 1.2, 1.2, 1.2)
PHASES = 128
# Of reliefs to begin from: depths over the deflection of the mesh, and parts of the path of contact that they take.
DEPTHS, LENGTHS = (1.0, 2.0, 3.0, 4.5), (0.25, 0.5)
MIDDLE = PLACES_ON_PATH.index(0.5)
LEAST_ROLL = 1e-6  # rad; a table of a flank's form begins beyond the base circle


def _flanks(condition: Condition) -> Array:
    """What the mesh has of each part of the form (parts, N)."""
    return condition.flanks


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """Excess material of all pairs: cosine and sine at every mesh order, and each pair's own along its path."""
    one = model.deflection
    return (
        group(KEY, "m", 2 * SHAPE_ORDERS, SD * one, WIDE * one, slot="profile"),
        group(FLANKS, "m", NAMES, one * np.array(SD_FORM), one * np.array(WIDE_FORM), slot="excess", basis=_flanks),
    )


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """The one mesh: what one gear's flanks lack, its mate's may have."""
    ground = tuple(Wide(FLANKS, NAMES.index(one)) for one in GROUND)
    return (
        Hypothesis("profile-error", "mesh", (Wide(KEY),), choices=3),
        Hypothesis("profile-error flanks", "mesh", (Wide(FLANKS),), choices=3),
        Hypothesis("profile-error slope", "mesh", ground, choices=3),
    )


def uneven(unknowns: Unknowns, p: Array) -> Array:
    """Unknowns (size,) without what a form has of the even part, which is no error of form."""
    out = p.copy()
    out[unknowns.at(FLANKS)[EVEN : EVEN + 1]] = 0.0
    return out


def shapes(model: NominalModel) -> Array:
    """Reliefs (n, parts) that the nominal flanks lack, long and short, of either tip and of both, and such as they
    have too much: what is deeper than the mesh yields changes nothing more, so that no slope leads there."""
    place = np.array(PLACES_ON_PATH)
    out = []
    for length in LENGTHS:
        entry, leaving = (np.maximum(1.0 - away / length, 0.0) for away in (place, 1.0 - place))
        for form in (entry, leaving, entry + leaving):
            out += [-depth * form for depth in DEPTHS]
        out.append(entry + leaving)
    return model.deflection * in_parts(np.array(out))


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Gives the mesh the error over its phase that was fitted, and each gear the form from the pitch point to its tip,
    which its mate's root may have as well; sizes are told from peak to valley."""
    model, values, form = fitted.model, fitted.of(KEY), fitted.of(FLANKS) @ FORM_PARTS
    cosine, sine = added(model.error_cos, values[0::2]), added(model.error_sin, values[1::2])
    rig = changed(rig, "mesh", error_cos=cosine, error_sin=sine)
    if form.any():
        path, middle = model.path, np.arange(len(form)) < MIDDLE
        travel = model.law.base_pitch * (path[0] + (path[1] - path[0]) * np.array(PLACES_ON_PATH))
        of_driver = np.where(middle, form[MIDDLE], form)
        rig = changed(rig, "driver", **_formed(rig.driver, model, 0, travel, of_driver))
        rig = changed(rig, "driven", **_formed(rig.driven, model, 1, -travel[::-1], (form - of_driver)[::-1]))
    if any(wide.key == FLANKS for wide in hypothesis.wide):
        at = hypothesis.entries(fitted.unknowns)
        own = FORM_PARTS[at - fitted.unknowns[FLANKS].start]
        # What sound flanks have of a form, teeth of another stiffness make: of that nothing is an error of theirs.
        both = np.hypot(fitted.std[at], fitted.unknowns.prior()[at])
        return rig, _along_path(fitted.p[at] @ own, both[:, None] * own)
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


def _along_path(form: Array, parts: Array) -> tuple[Estimate, ...]:
    """Size of a form (places,) from peak to valley, and how far both ends of the path stand out over its middle;
    `parts` (n, places) what independent standard deviations of its n numbers make of it."""
    high, low = int(form.argmax()), int(form.argmin())
    out = []
    for name, one, other in (("peak_to_valley", high, low), ("driven_tip", 0, MIDDLE), ("driver_tip", -1, MIDDLE)):
        value, std = form[one] - form[other], np.linalg.norm(parts[:, one] - parts[:, other])
        out.append(Estimate(name, 1e6 * float(value), 1e6 * float(std), "um", signed=name != "peak_to_valley"))
    return tuple(out)


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
    model_error=0.12,  # four drawn rigs, whose teeth are of another stiffness (benchmarks/diagnosis_log.md)
)

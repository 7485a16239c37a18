"""Flank tolerances of ISO 1328-1:2013, and errors drawn so that a gear just satisfies a grade.

Tolerances are in m. A grade's value is that of grade 5 times sqrt(2) for each grade more, rounded (clause 5.2.3): above
10 um to 1 um, above 5 um to 0.5 um, below to 0.1 um. Single pitch: formula 5; cumulative pitch: 6; profile slope, form
and total: 7, 8 and 9; run-out: annex E. All are linear in the module, unlike those of the edition of 1995.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, floor, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.tooth.micro import slope_excess
from gearbench.geometry.tooth.profile import Profile, profile
from gearbench.rig import Gear

Array = NDArray[np.float64]

GRADES = (1, 11)
TEETH = (5, 1000)
DIAMETERS = (5.0, 15_000.0)  # [mm]
MODULES = (0.5, 70.0)  # [mm]

UTILISATION = (0.7, 0.98)  # range of the part of each tolerance that drawn errors use
FORM_POINTS = 41


@dataclass(frozen=True)
class Tolerances:
    """Tolerances [m] of one gear: single pitch, total cumulative pitch, run-out, profile slope, form and total."""

    single_pitch: float
    cumulative_pitch: float
    runout: float
    profile_slope: float
    profile_form: float
    profile_total: float


def rounded_tolerance(micrometres: float) -> float:
    """A tolerance rounded as the standard says, both in um."""
    step = 1.0 if micrometres > 10.0 else 0.5 if micrometres > 5.0 else 0.1
    # One more rounding, since half a tenth is no binary number.
    return round(floor(round(micrometres / step, 9) + 0.5) * step, 1)


def tolerances(module: float, teeth: int, grade: int, name: str = "gear") -> Tolerances:
    """Tolerances of a spur gear of that module [m], number of teeth and grade, from the reference diameter.

    Raises GeometryError outside the standard's range. `name` is the gear's key in the case.
    """
    m, d = module * 1e3, module * 1e3 * teeth
    for words, value, (low, high), unit in (
        ("iso_grade", grade, GRADES, ""),
        ("teeth", teeth, TEETH, ""),
        ("reference diameter", d, DIAMETERS, " mm"),
        ("module_mm", m, MODULES, " mm"),
    ):
        if not low <= value <= high:
            raise GeometryError(
                f"{name}: ISO 1328-1 has no tolerance for {words} = {value:g}{unit}: between {low:g} and {high:g}{unit}"
            )
    step = sqrt(2.0) ** (grade - 5)
    pitch = 0.002 * d + 0.55 * sqrt(d) + 0.7 * m + 12
    slope, form = 0.4 * m + 0.001 * d + 4, 0.55 * m + 5
    values = (0.001 * d + 0.4 * m + 5, pitch, 0.9 * pitch, slope, form, sqrt(slope**2 + form**2))
    return Tolerances(*(1e-6 * rounded_tolerance(value * step) for value in values))


def drawn_gear(gear: Gear, name: str = "gear") -> Gear:
    """The gear with the errors that its `iso_grade` asks for drawn from its `iso_seed`; without a grade the gear.

    Pitch errors and run-out together satisfy f_pT, F_pT and F_rT, each tooth's profile f_HalphaT, f_falphaT and
    F_alphaT; the tightest of each group is used to 70 to 98 %. Pitch tolerances hold for arcs on the reference circle,
    errors here are normal to the flank: arc times cos alpha. Raises GeometryError.
    """
    if gear.iso_grade is None:
        return gear
    limits = tolerances(gear.module, gear.teeth, gear.iso_grade, name)
    rng = np.random.default_rng([gear.iso_seed, gear.teeth])
    pitch, runout, phase = _draw_pitch(gear, limits, rng)
    slopes, roll, form = _draw_profile(profile(gear, name), gear.teeth, limits, rng)
    return gear.model_copy(
        update={
            "pitch_error": tuple(pitch.tolist()),
            "runout": runout,
            "runout_phase": phase,
            "profile_slope_tooth": tuple(slopes.tolist()),
            "profile_form": tuple(form.tolist()),
            "profile_form_roll": tuple(roll.tolist()),
            "profile_form_diameter": (),
            "profile_form_tooth": (),
            "iso_grade": None,
            "iso_seed": 0,
        }
    )


def _draw_pitch(gear: Gear, limits: Tolerances, rng: np.random.Generator) -> tuple[Array, float, float]:
    """Pitch errors (z,) [m] normal to the flank, run-out F_r [m] and its phase [rad]."""
    z = gear.teeth
    turn = 2 * pi * np.arange(z) / z
    errors = 0.15 * rng.standard_normal(z)
    # Clamping out of round and the indexing wheel of the machine: a few waves a turn.
    for order in (2, 3, 4):
        errors += rng.uniform(0, 0.3) * np.cos(order * turn - rng.uniform(0, 2 * pi))
    errors -= errors.mean()
    half, phase = rng.uniform(0.4, 1.0), float(rng.uniform(0, 2 * pi))
    arcs = (errors + half * np.cos(turn - phase)) / cos(gear.pressure_angle)
    use = max(
        np.ptp(arcs) / limits.cumulative_pitch,
        np.abs(arcs - np.roll(arcs, 1)).max() / limits.single_pitch,
        2 * half / limits.runout,
    )
    size = rng.uniform(*UTILISATION) / use
    return size * errors, float(2 * half * size), phase


def _draw_profile(
    shape: Profile, teeth: int, limits: Tolerances, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Slope deviations (z,) [m], and roll angles [rad] and excess [m] of a form deviation that all teeth share."""
    rho = np.linspace(shape.rho_form, shape.rho_end, FORM_POINTS)
    x = np.linspace(0.0, 1.0, FORM_POINTS)
    wave = sum(rng.uniform(0.3, 1.0) / n * np.cos(2 * pi * n * x - rng.uniform(0, 2 * pi)) for n in (1, 2, 3))
    # The form deviation is what is left about the mean profile line.
    form = wave - np.polyval(np.polyfit(x, wave, 1), x)
    form *= rng.uniform(*UTILISATION) * limits.profile_form / np.ptp(form)
    slopes = rng.uniform(-1, 1) + 0.3 * rng.uniform(-1, 1, teeth)
    slopes *= rng.uniform(*UTILISATION) * limits.profile_slope / np.abs(slopes).max()
    total = max(np.ptp(slope_excess(shape, slope, rho) + form) for slope in slopes)
    shrink = min(1.0, limits.profile_total / total)
    return shrink * slopes, rho / shape.base_radius, shrink * form

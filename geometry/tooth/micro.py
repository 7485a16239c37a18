"""Micro-geometry: how far a tooth's flank stands proud of the ideal involute, along its normal.

Positive: excess material, which closes the mesh. Relief (ISO 21771) is cut into both flanks; slope, form, wear and
pitch errors (ISO 1328-1) are those of the working flank. Everything here is small against the radii of curvature, so it
moves the flank and does not change its stiffness.
"""

from __future__ import annotations

from math import pi, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear

Array = NDArray[np.float64]

# Part of the flank's roll length that a table must cover; beyond its ends it goes on as there.
LEAST_COVER = 0.5
# How far, in modules, a flank may depart from its involute, and teeth overlap that errors jam: several times what is
# ground into real gears, and still small against radii of curvature.
DEEPEST = 0.1


def roll_length(shape: Profile, diameter: ArrayLike) -> Array:
    """Roll length [m] of the involute at a diameter [m]; NaN inside the base circle."""
    radius = np.asarray(diameter, dtype=float) / 2
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(radius**2 - shape.base_radius**2))


def roll_angle(shape: Profile, rho: ArrayLike) -> Array:
    """Roll angle [rad] at a roll length [m]."""
    return np.asarray(rho, dtype=float) / shape.base_radius


def check_micro(shape: Profile, gear: Gear, name: str = "gear") -> None:
    """Raise GeometryError for a flank that leaves its involute by more than DEEPEST, for relief that starts outside the
    involute, and for a table that misses the flank.

    `name` is the gear's key in the case.
    """
    _check_depths(gear, name)
    low, high = 2e3 * shape.form_radius, 2e3 * shape.end_radius
    for relief in ("tip_relief", "root_relief"):
        start = getattr(gear, f"{relief}_start_diameter")
        if getattr(gear, relief) and not low < start * 1e3 < high:
            raise GeometryError(
                f"{name}.{relief}_start_diameter_mm = {start * 1e3:.7g} must lie on the involute, between its form"
                f" circle, {low:.6g} mm, and the end of the involute, {high:.6g} mm"
            )
    tables = {"wear_roll": np.asarray(gear.wear_roll) * shape.base_radius}
    if gear.profile_form_diameter:
        tables["profile_form_diameter"] = roll_length(shape, gear.profile_form_diameter)
    else:
        tables["profile_form_roll"] = np.asarray(gear.profile_form_roll) * shape.base_radius
    for key, rho in tables.items():
        if not len(rho):
            continue
        # Inside the base circle there is no involute: such a point lies before the flank.
        inside = np.clip(np.nan_to_num(rho, nan=0.0), shape.rho_form, shape.rho_end)
        cover = (inside[-1] - inside[0]) / (shape.rho_end - shape.rho_form)
        if cover < LEAST_COVER:
            unit = "mm" if key.endswith("diameter") else "deg"
            ends = _ends(shape, unit)
            raise GeometryError(
                f"{name}.{key}_{unit} runs from {_in_unit(getattr(gear, key)[0], unit):.6g} to"
                f" {_in_unit(getattr(gear, key)[-1], unit):.6g} {unit} and covers {cover:.0%} of the flank"
                f" ({ends[0]:.6g} to {ends[1]:.6g} {unit}): at least {LEAST_COVER:.0%}"
            )


def _check_depths(gear: Gear, name: str) -> None:
    """Refuse amounts beside which the flank is no involute any more."""
    limit = DEEPEST * gear.module
    worn = max(gear.wear_tooth, default=1.0)
    amounts = {
        "tip_relief": gear.tip_relief,
        "root_relief": gear.root_relief,
        "profile_slope": abs(gear.profile_slope),
        "profile_slope_tooth": max(map(abs, gear.profile_slope_tooth), default=0.0),
        "profile_form": max(map(abs, gear.profile_form), default=0.0)
        * max(map(abs, gear.profile_form_tooth), default=1.0),
        "wear": gear.wear * worn,
        "wear_depth": max(gear.wear_depth, default=0.0) * worn,
    }
    for key, amount in amounts.items():
        if amount > limit * (1 + 1e-12):
            raise GeometryError(
                f"{name}.{key}_um moves the flank by {amount * 1e6:.6g} um: at most {limit * 1e6:g} um, {DEEPEST:g}"
                " modules, beyond which it is no involute"
            )


def check_play(backlash_normal: float, gears: tuple[Gear, Gear]) -> None:
    """Raise GeometryError for pitch errors and run-out of driver and driven gear that together close the mesh by more
    than its normal backlash [m] and DEEPEST: the teeth would jam."""
    limit = max(backlash_normal, 0.0) + DEEPEST * gears[0].module
    closed = 0.0
    for gear in gears:
        pitch = max(gear.pitch_error) - min(gear.pitch_error) if gear.pitch_error else 0.0
        closed += pitch + gear.runout * sin(gear.pressure_angle)
    if closed > limit:
        raise GeometryError(
            f"pitch_error_um and runout_um of rig.driver and rig.driven close the mesh by up to {closed * 1e6:.4g} um:"
            f" at most {limit * 1e6:.4g} um, the normal backlash and {DEEPEST:g} modules"
        )


def _in_unit(value: float, unit: str) -> float:
    return value * (1e3 if unit == "mm" else 180 / pi)


def _ends(shape: Profile, unit: str) -> tuple[float, float]:
    if unit == "mm":
        return 2e3 * shape.form_radius, 2e3 * shape.end_radius
    low, high = (float(a) * 180 / pi for a in roll_angle(shape, (shape.rho_form, shape.rho_end)))
    return low, high


def relief(shape: Profile, gear: Gear, rho: ArrayLike) -> Array:
    """Excess [m] (not positive) of tip and root relief at roll lengths [m], alike on both flanks of all teeth.

    Full at the end of the involute, or at the form circle; linear or parabolic in the roll length from where it starts.
    """
    rho = np.asarray(rho, dtype=float)
    out = np.zeros_like(rho)
    for amount, start, form, end in (
        (gear.tip_relief, gear.tip_relief_start_diameter, gear.tip_relief_shape, shape.rho_end),
        (gear.root_relief, gear.root_relief_start_diameter, gear.root_relief_shape, shape.rho_form),
    ):
        if amount and start is not None:
            first = float(roll_length(shape, start))
            part = np.maximum((rho - first) / (end - first), 0.0)
            out -= amount * (part if form == "linear" else part**2)
    return out


def slope_excess(shape: Profile, amount: float, rho: ArrayLike) -> Array:
    """Excess [m] of a profile slope deviation f_Halpha [m]: linear in the roll length, `amount` more at the end of the
    involute than at the form circle, nothing in the middle."""
    rho = np.asarray(rho, dtype=float)
    return amount * ((rho - shape.rho_form) / (shape.rho_end - shape.rho_form) - 0.5)


def profile_excess(shape: Profile, gear: Gear, tooth: int, rho: ArrayLike) -> Array:
    """Excess [m] of a tooth's working flank at roll lengths [m]: relief, slope, form and wear."""
    rho = np.asarray(rho, dtype=float)
    tooth = tooth % gear.teeth
    out = relief(shape, gear, rho)
    slope = gear.profile_slope + (gear.profile_slope_tooth[tooth] if gear.profile_slope_tooth else 0.0)
    if slope:
        out = out + slope_excess(shape, slope, rho)
    if gear.profile_form:
        if gear.profile_form_diameter:
            places = np.nan_to_num(roll_length(shape, gear.profile_form_diameter), nan=0.0)
        else:
            places = np.asarray(gear.profile_form_roll) * shape.base_radius
        factor = gear.profile_form_tooth[tooth] if gear.profile_form_tooth else 1.0
        out = out + factor * np.interp(rho, places, gear.profile_form)
    depth = np.full_like(rho, gear.wear)
    if gear.wear_depth:
        depth = depth + np.interp(rho, np.asarray(gear.wear_roll) * shape.base_radius, gear.wear_depth)
    return out - (gear.wear_tooth[tooth] if gear.wear_tooth else 1.0) * depth


def excess(shape: Profile, gear: Gear, tooth: int, rho: ArrayLike) -> Array:
    """Excess [m] of a tooth's working flank along its normal at roll lengths [m]; run-out, which turns with the gear
    and not with the tooth, left out."""
    pitch = gear.pitch_error[tooth % gear.teeth] if gear.pitch_error else 0.0
    return profile_excess(shape, gear, tooth, rho) + pitch


def teeth_alike(gear: Gear) -> bool:
    """Whether all teeth of a gear move the mesh alike."""
    shaped = gear.profile_form and len(set(gear.profile_form_tooth)) > 1
    worn = (gear.wear or any(gear.wear_depth)) and len(set(gear.wear_tooth)) > 1
    lists = len(set(gear.pitch_error)) > 1 or len(set(gear.profile_slope_tooth)) > 1
    return not (shaped or worn or lists or gear.runout)

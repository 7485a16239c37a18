"""Kinematics of the pair: centre distance, working pressure angle, path of contact, backlash, refusals.

Both gears are described in their own frame (see `profile`); seen from the driven gear the pair looks the same
after half a turn, so each gear touches with its counter-clockwise flank. Formulas: ISO 21771:2007.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, atan, inf, pi, sin, sqrt, tan

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError, at_least, at_most
from gearbench.geometry.pair.interference import TOLERANCE, fillet_clearance, largest_tip
from gearbench.geometry.tooth.profile import Profile, involute, profile
from gearbench.rig import Rig

Array = NDArray[np.float64]

# Backlash and clearance more negative than this are refused; less is rounding of a centre distance in the
# case.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Pair:
    """Two gears in mesh; build it with `pair(rig)`. Lengths in m, angles in rad.

    On the line of action rho_driver + rho_driven = centre_distance sin(working_pressure_angle). At mesh phase
    0 driver tooth 0 and driven tooth 0 touch at the pitch point; tooth 0 of the driver then stands at the
    polar angle `driver_angle` (world frame), tooth 0 of the driven gear at pi + `driven_angle`.
    """

    driver: Profile
    driven: Profile
    centre_distance: float
    working_pressure_angle: float
    face_width: float  # common: the smaller of the two

    @property
    def base_pitch(self) -> float:
        """Distance of successive contacts along the line of action."""
        return self.driver.base_pitch

    @property
    def line_of_action(self) -> float:
        """Distance of the two tangent points: the sum of both roll lengths of a contact."""
        return self.centre_distance * sin(self.working_pressure_angle)

    @property
    def pitch_radii(self) -> tuple[float, float]:
        """Working pitch radii of driver and driven gear."""
        z1, z2 = self.driver.teeth, self.driven.teeth
        return self.centre_distance * z1 / (z1 + z2), self.centre_distance * z2 / (z1 + z2)

    @property
    def rho_pitch(self) -> tuple[float, float]:
        """Roll lengths of driver and driven gear at the pitch point."""
        slope = tan(self.working_pressure_angle)
        return self.driver.base_radius * slope, self.driven.base_radius * slope

    @property
    def active_driver(self) -> tuple[float, float]:
        """Roll lengths of the driver where contact on the line of action starts and ends: at the mate's tip edges or,
        where undercut has cut the flank away that they would touch, at the form circles."""
        start, stop = self.line_of_action - self.driven.rho_end, self.driver.rho_end
        return max(start, self.driver.rho_form), min(stop, self.line_of_action - self.driven.rho_form)

    @property
    def active_driven(self) -> tuple[float, float]:
        """Roll lengths of the driven gear where its active profile begins (end of contact) and ends
        (start)."""
        start, stop = self.active_driver
        return self.line_of_action - stop, self.line_of_action - start

    @property
    def path(self) -> tuple[float, float]:
        """Start and end of the path of contact behind the pitch point, in base pitches."""
        start, stop = ((rho - self.rho_pitch[0]) / self.base_pitch for rho in self.active_driver)
        return start, stop

    def uneven(self, travel: Array) -> Array:
        """x^2 - 1/3 and x (2, ...) at distances (...) behind the pitch point [base pitches], x from -1 to 1 along the
        path of contact, over which both are nothing in the mean; beyond the ends as there."""
        start, stop = self.path
        place = np.clip((2.0 * travel - start - stop) / (stop - start), -1.0, 1.0)
        return np.stack([place**2 - 1.0 / 3.0, place])

    @property
    def contact_ratio(self) -> float:
        """Transverse contact ratio of the involutes, which end where the tip-edge arcs begin."""
        start, stop = self.active_driver
        return (stop - start) / self.base_pitch

    @property
    def contact_ratio_sharp(self) -> float:
        """Transverse contact ratio that sharp tip edges (radius 0) would give."""
        reach = [
            min(sqrt(gear.tip_radius**2 - gear.base_radius**2), self.line_of_action - mate.rho_form)
            for gear, mate in ((self.driver, self.driven), (self.driven, self.driver))
        ]
        return (sum(reach) - self.line_of_action) / self.base_pitch

    @property
    def specific_sliding(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Specific sliding (sliding velocity over the gear's own rolling velocity) of driver and driven gear, each at
        the start and at the end of its active profile; -inf where the active profile starts on the base circle."""
        sliding = []
        for gear, mate, ends in (
            (self.driver, self.driven, self.active_driver),
            (self.driven, self.driver, self.active_driven),
        ):
            ratio = gear.teeth / mate.teeth
            rolled = [((self.line_of_action - rho) * ratio, rho) for rho in ends]
            start, stop = (1 - other / own if own > 0.0 else -inf for other, own in rolled)
            sliding.append((start, stop))
        return sliding[0], sliding[1]

    @property
    def backlash(self) -> float:
        """Circumferential backlash on the working pitch circles."""
        rolled = involute(self.working_pressure_angle)
        r1, r2 = self.pitch_radii
        thickness = 2 * r1 * (self.driver.psi_b - rolled) + 2 * r2 * (self.driven.psi_b - rolled)
        return 2 * pi * r1 / self.driver.teeth - thickness

    @property
    def backlash_normal(self) -> float:
        """Backlash along the line of action."""
        return self.backlash * self.driver.base_radius / self.pitch_radii[0]

    @property
    def backlash_angles(self) -> tuple[float, float]:
        """Angle [rad] through which driver and driven gear turn in their backlash while the mate stands."""
        return self.backlash / self.pitch_radii[0], self.backlash / self.pitch_radii[1]

    @property
    def clearances(self) -> tuple[float, float]:
        """Clearance of the driver's tip at the driven root, and of the driven tip at the driver's root."""
        return (
            self.centre_distance - self.driver.tip_radius - self.driven.root_radius,
            self.centre_distance - self.driven.tip_radius - self.driver.root_radius,
        )

    @property
    def driver_angle(self) -> float:
        """Polar angle of driver tooth 0 at mesh phase 0; it grows as the driver turns."""
        return involute(self.working_pressure_angle) - self.driver.psi_b

    @property
    def driven_angle(self) -> float:
        """Polar angle of driven tooth 0 at mesh phase 0, less pi; it falls as the driven gear turns."""
        return involute(self.working_pressure_angle) - self.driven.psi_b


def inverse_involute(value: float) -> float:
    """The angle whose involute function is `value` (>= 0), by Newton's method on its tangent.

    With t = tan(angle), f(t) = t - atan(t) rises and is convex: the first step lands at or above the root and
    the following ones fall to it. The start is the leading term t^3/3 or, far out, t - pi/2.
    """
    if value < 0.0:
        raise ValueError(f"an involute function of {value:g} has no angle: at least 0")
    if value == 0.0:
        return 0.0
    t = max((3 * value) ** (1 / 3), value + pi / 2 if value > 1.0 else 0.0)
    for _ in range(60):
        step = (t - atan(t) - value) * (1 + t * t) / (t * t)
        t -= step
        if abs(step) <= 1e-16 * t:
            break
    return atan(t)


def _common_rack(rig: Rig) -> None:
    one, two = rig.driver, rig.driven
    if abs(one.module - two.module) > 1e-12 * one.module:
        raise GeometryError(
            f"rig.driven.module_mm = {two.module * 1e3:g} must equal rig.driver.module_mm ="
            f" {one.module * 1e3:g}"
        )
    if abs(one.pressure_angle - two.pressure_angle) > 1e-12:
        raise GeometryError(
            f"rig.driven.pressure_angle_deg = {two.pressure_angle * 180 / pi:g} must equal"
            f" rig.driver.pressure_angle_deg = {one.pressure_angle * 180 / pi:g}"
        )


def _zero_backlash_distance(rig: Rig, base_sum: float) -> float:
    """Centre distance at which the unthinned gears have no backlash (ISO 21771: inv alpha_w)."""
    alpha = rig.driver.pressure_angle
    teeth = rig.driver.teeth + rig.driven.teeth
    shifts = rig.driver.profile_shift + rig.driven.profile_shift
    rolled = involute(alpha) + 2 * shifts * tan(alpha) / teeth
    if rolled <= 0.0:
        raise GeometryError(
            f"rig.driver.profile_shift + rig.driven.profile_shift = {shifts:g} leaves no centre distance"
            f" without backlash: it must exceed {-involute(alpha) * teeth / (2 * tan(alpha)):.4f}"
        )
    slope = tan(inverse_involute(rolled))
    return base_sum * sqrt(1 + slope * slope)


def pair(rig: Rig) -> Pair:
    """The pair of a rig. Raises GeometryError (see `profile` for one gear's own refusals) when mates have
    different racks, the centre distance is impossible, backlash or tip clearance is negative, a tip meets the fillet
    of its mate or cuts into it (undercut gives way: there contact begins at the form circle), or the contact ratio is
    below 1. The common face width is the smaller of the two.
    """
    _common_rack(rig)
    driver, driven = profile(rig.driver, "rig.driver"), profile(rig.driven, "rig.driven")
    base_sum = driver.base_radius + driven.base_radius
    distance = rig.centre_distance
    if distance is None:
        distance = _zero_backlash_distance(rig, base_sum)
    elif distance <= base_sum:
        raise GeometryError(
            f"rig.centre_distance_mm = {distance * 1e3:g} is impossible: it must exceed the sum of the base"
            f" radii, {at_least(base_sum * 1e3, 6)} mm"
        )
    result = Pair(
        driver=driver,
        driven=driven,
        centre_distance=distance,
        working_pressure_angle=acos(base_sum / distance),
        face_width=min(rig.driver.face_width, rig.driven.face_width),
    )
    _check(result, rig)
    return result


def _check(meshing: Pair, rig: Rig) -> None:
    """Refuse a pair that cannot run."""
    given = "" if rig.centre_distance is not None else " (absent: from the profile shifts)"
    key = f"rig.centre_distance_mm = {meshing.centre_distance * 1e3:.7g}{given}"
    if meshing.backlash < -ROUNDING:
        limit = at_least(_tight_distance(meshing) * 1e3, 6)
        raise GeometryError(
            f"{key} jams the teeth (backlash {meshing.backlash * 1e6:.3g} um): at least {limit} mm"
        )
    names = ("rig.driver", "rig.driven")
    gears = (meshing.driver, meshing.driven)
    starts = (meshing.line_of_action - meshing.driven.rho_end, meshing.line_of_action - meshing.driver.rho_end)
    for i, mate in ((0, 1), (1, 0)):
        tip = f"{names[i]}.tip_diameter_mm = {2e3 * gears[i].tip_radius:.6g}"
        if meshing.clearances[i] < -ROUNDING:
            limit = at_most(2e3 * (gears[i].tip_radius + meshing.clearances[i]), 4)
            raise GeometryError(f"{tip} reaches into the root of {names[mate]}: at most {limit} with {key}")
        form = f"{names[mate]} ({2e3 * gears[mate].form_radius:.6g} mm)"
        if starts[mate] < gears[mate].rho_form - ROUNDING and not gears[mate].undercut:
            limit = at_most(2e3 * _tip_reaching(gears[i], meshing.line_of_action - gears[mate].rho_form), 4)
            raise GeometryError(
                f"{tip} interferes: the tip reaches below the form circle of {form};"
                f" at most {limit} with {key}"
            )
        place = (meshing.centre_distance, meshing.working_pressure_angle)
        gap = fillet_clearance(gears[mate], gears[i], *place)
        if gap < -TOLERANCE:
            limit = at_most(2e3 * largest_tip(gears[mate], gears[i], *place), 4)
            raise GeometryError(
                f"{tip} interferes: the tip cuts {-gap * 1e6:.3g} um into the fillet of {names[mate]};"
                f" at most {limit} with {key}"
            )
    if meshing.contact_ratio < 1.0:
        raise GeometryError(
            f"{key} gives a contact ratio of {meshing.contact_ratio:.4f} (tip-edge arcs left out): at least 1"
        )


def _tight_distance(meshing: Pair) -> float:
    """Centre distance without backlash of the teeth as they are (thinned): the thicknesses on the working
    pitch circles, 2 k z_i (psi_i - inv alpha_w) with the same k for both, fill the pitch 2 pi k."""
    z1, z2 = meshing.driver.teeth, meshing.driven.teeth
    rolled = (z1 * meshing.driver.psi_b + z2 * meshing.driven.psi_b - pi) / (z1 + z2)
    slope = tan(inverse_involute(rolled))
    return (meshing.driver.base_radius + meshing.driven.base_radius) * sqrt(1 + slope * slope)


def _tip_reaching(gear: Profile, rho: float) -> float:
    """Tip radius whose rounded edge ends the involute at the roll length `rho`."""
    return gear.edge_radius + sqrt(gear.base_radius**2 + max(rho - gear.edge_radius, 0.0) ** 2)

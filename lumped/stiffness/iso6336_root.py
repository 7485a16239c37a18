"""Nominal tooth root stress by ISO 6336-3, Method B, for external spur gears.

ISO 6336-3:2006, 6.2 (form factor Y_F), 7.2 (stress correction factor Y_S) and 5.3 (nominal stress); DIN 3990-3
uses the same section of the root. The section touches the fillet where its tangent makes 30 degrees with the
tooth's axis; the force acts at the outer point of single tooth contact. The formulas describe the trochoid that
a rack with rounded tips cuts, so undercut teeth are included as long as that point lies on the fillet; there is
no protuberance. Helix factor, rim factor and deep tooth factor are 1: spur gears on solid discs or with a rim
of at least 1.2 tooth heights, contact ratio below 2. Lengths are in modules unless a unit is given.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, atan2, cos, pi, sin, sqrt, tan
from typing import Literal

from gearbench.geometry import Pair, Profile
from gearbench.lumped.errors import LumpedError
from gearbench.rig import Gear, Rig

NOTCH_RANGE = (1.0, 8.0)  # of q_s (7.2)
MOST_CONTACT_RATIO = 2.0
STEPS = 200


@dataclass(frozen=True)
class RootSection:
    """Critical section: chord s_Fn and fillet radius rho_F [modules], angle theta [rad] to its contact point."""

    chord: float
    radius: float
    theta: float


@dataclass(frozen=True)
class RootStress:
    """Nominal stress sigma_F0 [Pa], its factors Y_F and Y_S, and chord, radius and lever of the section [m];
    `notes` where the tooth lies outside the range of the formulas."""

    stress: float
    form: float
    correction: float
    chord: float
    radius: float
    lever: float
    notes: tuple[str, ...] = ()


def involute(angle: float) -> float:
    """inv(angle)."""
    return tan(angle) - angle


def root_section(teeth: float, shift: float, dedendum: float, rack_radius: float, pressure_angle: float) -> RootSection:
    """Section of the root at the 30 degree tangents (6.2.1, equations of E, G, H, theta, s_Fn, rho_F).

    `shift` is the generating profile shift x_E, in which thinning of the tooth is included. Raises LumpedError
    where the equation of theta has no root, for a fillet without such a tangent.
    """
    alpha = pressure_angle
    e = pi / 4 - dedendum * tan(alpha) - (1 - sin(alpha)) * rack_radius / cos(alpha)
    g = rack_radius - dedendum + shift
    h = 2 / teeth * (pi / 2 - e) - pi / 3
    theta = pi / 6
    for _ in range(STEPS):
        # The standard iterates theta = 2 G/z tan(theta) - H; Newton's method finds the same root for few teeth too.
        change = (theta - 2 * g / teeth * tan(theta) + h) / (1 - 2 * g / teeth / cos(theta) ** 2)
        theta -= change
        if abs(change) < 1e-15:
            break
    if not 0.0 < theta < pi / 2:
        raise LumpedError(f"no point of the fillet has a tangent of 30 degrees to the axis (z = {teeth:g})")
    offset = g / cos(theta) - rack_radius
    chord = teeth * sin(pi / 3 - theta) + sqrt(3) * offset
    radius = rack_radius + 2 * g**2 / (cos(theta) * (teeth * cos(theta) ** 2 - 2 * g))
    return RootSection(chord, radius, theta)


def lever_arm(
    section: RootSection,
    teeth: float,
    shift: float,
    dedendum: float,
    rack_radius: float,
    pressure_angle: float,
    load_diameter: float,
) -> tuple[float, float]:
    """Lever h_Fe [modules] and angle alpha_Fe [rad] of a force at `load_diameter` d_e [modules] (6.2.1)."""
    alpha = acos(teeth * cos(pressure_angle) / load_diameter)
    half = (pi / 2 + 2 * shift * tan(pressure_angle)) / teeth + involute(pressure_angle) - involute(alpha)
    angle = alpha - half
    offset = (rack_radius - dedendum + shift) / cos(section.theta) - rack_radius
    reach = (cos(half) - sin(half) * tan(angle)) * load_diameter
    return 0.5 * (reach - teeth * cos(pi / 3 - section.theta) - offset), angle


def form_factor(chord: float, lever: float, angle: float, pressure_angle: float) -> float:
    """Y_F = 6 h_Fe cos(alpha_Fe) / (s_Fn^2 cos(alpha)), lengths in modules (6.2.1)."""
    return 6 * lever * cos(angle) / (chord**2 * cos(pressure_angle))


def correction_factor(chord: float, lever: float, radius: float) -> float:
    """Y_S = (1.2 + 0.13 L) q_s^(1/(1.21 + 2.3/L)), L = s_Fn/h_Fe, q_s = s_Fn/(2 rho_F) (7.2)."""
    slenderness, notch = chord / lever, chord / (2 * radius)
    return (1.2 + 0.13 * slenderness) * notch ** (1 / (1.21 + 2.3 / slenderness))


def root_stress(rig: Rig, meshing: Pair, which: Literal["driver", "driven"], force: float) -> RootStress:
    """sigma_F0 = F_t/(b m) Y_F Y_S of one gear, one pair carrying `force` [N] along the line of action.

    F_t = force cos(alpha) acts on the reference circle, over the common face width. Raises LumpedError for contact
    ratios of 2 and more, where no single tooth ever carries the load.
    """
    if meshing.contact_ratio >= MOST_CONTACT_RATIO:
        raise LumpedError(
            f"ISO 6336-3 root stress needs an outer point of single contact: contact ratio"
            f" {meshing.contact_ratio:.3f} must be below {MOST_CONTACT_RATIO:g}"
        )
    gear, tooth, rolls = (
        (rig.driver, meshing.driver, meshing.active_driver)
        if which == "driver"
        else (rig.driven, meshing.driven, meshing.active_driven)
    )
    outer = 2 * sqrt(tooth.base_radius**2 + (rolls[0] + meshing.base_pitch) ** 2) / gear.module
    rack = (gear.teeth, generating_shift(gear), gear.dedendum, gear.rack_tip_radius, gear.pressure_angle)
    section = root_section(*rack)
    lever, angle = lever_arm(section, *rack, outer)
    form = form_factor(section.chord, lever, angle, gear.pressure_angle)
    correction = correction_factor(section.chord, lever, section.radius)
    nominal = force * cos(gear.pressure_angle) / (meshing.face_width * gear.module)
    return RootStress(
        stress=nominal * form * correction,
        form=form,
        correction=correction,
        chord=section.chord * gear.module,
        radius=section.radius * gear.module,
        lever=lever * gear.module,
        notes=_notes(which, section, tooth),
    )


def generating_shift(gear: Gear) -> float:
    """x_E = x - thinning/(2 m tan(alpha)): the shift at which a rack cuts the thinned tooth (ISO 21771)."""
    return gear.profile_shift - gear.thinning / (2 * gear.module * tan(gear.pressure_angle))


def _notes(which: str, section: RootSection, tooth: Profile) -> tuple[str, ...]:
    notes = []
    notch = section.chord / (2 * section.radius)
    low, high = NOTCH_RANGE
    if not low <= notch < high:
        notes.append(
            f"{which}: notch parameter q_s = {notch:.3g} is outside {low:g} to {high:g}, the range of ISO's Y_S"
        )
    x, y = tooth.fillet_normals(tooth.beta_form)
    if atan2(float(y), float(x)) < pi / 3:
        notes.append(f"{which}: the fillet ends below its 30 degree tangent, so ISO's root section is not on the tooth")
    return tuple(notes)

"""The exact tooth profile: involute, trochoidal fillet of the rounded rack tip, rounded tip edge.

Gear frame: origin at the gear's centre, tooth 0 centred on +x; the working flank is the counter-clockwise
one. Lengths in m, angles in rad. Points and normals are arrays (..., 2); normals are unit vectors out of the
material. Notation and formulas: ISO 21771:2007 (involute, generating profile shift); F. L. Litvin and A.
Fuentes, Gear Geometry and Applied Theory (2004), chapters 5 and 10 (envelope of the rack's rounded tip).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, pi, sin, sqrt, tan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry.limits import check_body, check_rack, check_tip, check_undercut
from gearbench.rig import Gear

Array = NDArray[np.float64]


def involute(angle: float) -> float:
    """inv(angle) = tan(angle) - angle: polar angle [rad] of an involute at that pressure angle."""
    return tan(angle) - angle


def radial(angle: ArrayLike) -> Array:
    """Unit vectors (..., 2) at the polar `angle`."""
    angle = np.asarray(angle, dtype=float)
    return np.stack((np.cos(angle), np.sin(angle)), axis=-1)


def tangential(angle: ArrayLike) -> Array:
    """Unit vectors (..., 2) perpendicular to those at the polar `angle`, counter-clockwise."""
    angle = np.asarray(angle, dtype=float)
    return np.stack((-np.sin(angle), np.cos(angle)), axis=-1)


@dataclass(frozen=True)
class Profile:
    """The boundary of one tooth; build it with `profile(gear)`.

    Along the working flank, `rho` is the roll length on the base tangent and `s` the arc length from the
    involute's (virtual) origin on the base circle, which goes on along the tip-edge arc. Along the fillet,
    `beta` is the angle between the rack tip's normal and the centre line: 0 on the root circle,
    pi/2 - pressure_angle on the involute.
    """

    teeth: int
    module: float
    pressure_angle: float
    reference_radius: float
    base_radius: float
    tip_radius: float
    root_radius: float
    edge_radius: float
    psi_b: float  # polar angle of the working involute's origin on the base circle
    rho_form: float  # roll length where the fillet ends and the involute begins
    rho_end: float  # roll length where the involute ends and the tip-edge arc begins
    rack_depth: float  # depth of the rack tip's arc centre below the rolling line; may be negative
    rack_offset: float  # distance of that centre from the axis of the rack tooth
    rack_radius: float  # radius of the rack tip

    # --- radii, angles and lengths --------------------------------------------------------------------------

    @property
    def pitch_angle(self) -> float:
        """Angle from tooth to tooth."""
        return 2 * pi / self.teeth

    @property
    def base_pitch(self) -> float:
        """Distance from tooth to tooth along the base tangent."""
        return self.pitch_angle * self.base_radius

    @property
    def form_radius(self) -> float:
        """Radius where the fillet meets the involute."""
        return sqrt(self.base_radius**2 + self.rho_form**2)

    @property
    def end_radius(self) -> float:
        """Radius where the involute meets the tip-edge arc (tip form radius)."""
        return sqrt(self.base_radius**2 + self.rho_end**2)

    @property
    def edge_centre(self) -> Array:
        """Centre (2,) of the working flank's tip-edge arc; the corner itself if the radius is 0."""
        phi = self.psi_b - self.rho_end / self.base_radius
        return self.base_radius * radial(phi) + (self.rho_end - self.edge_radius) * tangential(phi)

    @property
    def edge_angle(self) -> float:
        """Angle through which the normal turns on the tip-edge arc (or at the sharp corner)."""
        return atan2(self.base_radius, self.rho_end - self.edge_radius)

    @property
    def tip_half_angle(self) -> float:
        """Half of the angle of the tip land."""
        return self.psi_b - self.rho_end / self.base_radius + pi / 2 - self.edge_angle

    @property
    def root_half_angle(self) -> float:
        """Half of the angle of the root land, the part of the root circle between two fillets."""
        return self.rack_offset / self.reference_radius

    @property
    def s_form(self) -> float:
        """Arc length at the form circle."""
        return self.rho_form**2 / (2 * self.base_radius)

    @property
    def s_end(self) -> float:
        """Arc length at the end of the involute."""
        return self.rho_end**2 / (2 * self.base_radius)

    @property
    def s_tip(self) -> float:
        """Arc length at the end of the tip-edge arc, where the tip land begins."""
        return self.s_end + self.edge_radius * self.edge_angle

    def half_angle(self, radius: ArrayLike) -> Array:
        """Polar angle of the working involute at `radius` (half of the tooth's angle there)."""
        relative = np.asarray(radius, dtype=float) / self.base_radius
        roll = np.sqrt(np.maximum(relative**2 - 1, 0.0))
        return self.psi_b - (roll - np.arctan(roll))

    def thickness(self, radius: ArrayLike) -> Array:
        """Tooth thickness (arc) on the circle of that radius, between the form and the tip form circle."""
        return 2 * np.asarray(radius, dtype=float) * self.half_angle(radius)

    # --- working flank: involute and tip-edge arc -----------------------------------------------------------

    def involute(self, rho: ArrayLike) -> Array:
        """Points of the working involute at the roll lengths `rho`."""
        rho = np.asarray(rho, dtype=float)
        phi = self.psi_b - rho / self.base_radius
        return self.base_radius * radial(phi) + rho[..., None] * tangential(phi)

    def involute_normals(self, rho: ArrayLike) -> Array:
        """Normals of the working involute at the roll lengths `rho`."""
        return tangential(self.psi_b - np.asarray(rho, dtype=float) / self.base_radius)

    def roll(self, s: ArrayLike) -> Array:
        """Roll length at arc length `s`; constant (rho_end) on the tip-edge arc."""
        return np.sqrt(2 * self.base_radius * np.clip(np.asarray(s, dtype=float), 0.0, self.s_end))

    def points(self, s: ArrayLike) -> Array:
        """Points of the working flank at the arc lengths `s` in [s_form, s_tip]."""
        s = np.asarray(s, dtype=float)
        rounded = self.edge_centre + self.edge_radius * self.normals(s)
        return np.where((s > self.s_end)[..., None], rounded, self.involute(self.roll(s)))

    def normals(self, s: ArrayLike) -> Array:
        """Normals of the working flank at the arc lengths `s`; at a sharp corner that of the involute."""
        s = np.asarray(s, dtype=float)
        turned = np.maximum(s - self.s_end, 0.0) / self.edge_radius if self.edge_radius > 0.0 else 0.0
        return tangential(self.psi_b - self.roll(s) / self.base_radius - turned)

    # --- fillet on the counter-clockwise side of tooth 0 ----------------------------------------------------

    @property
    def beta_form(self) -> float:
        """Fillet parameter where the involute begins."""
        return pi / 2 - self.pressure_angle

    def _rolling(self, beta: Array) -> Array:
        """Polar angle of the pitch point (gear frame) while the rack tip touches at `beta`."""
        return pi / self.teeth + (self.rack_depth * np.tan(beta) - self.rack_offset) / self.reference_radius

    def fillet(self, beta: ArrayLike) -> Array:
        """Points of the fillet at `beta` in [0, beta_form].

        The common normal of rack and gear passes through the pitch point (law of gearing), which fixes how
        far the rack has rolled when its tip touches with the normal `beta`.
        """
        beta = np.asarray(beta, dtype=float)
        angle = self._rolling(beta)
        depth = self.rack_depth + self.rack_radius * np.cos(beta)
        across = (depth * np.tan(beta))[..., None]
        return (self.reference_radius - depth)[..., None] * radial(angle) - across * tangential(angle)

    def fillet_normals(self, beta: ArrayLike) -> Array:
        """Normals of the fillet at `beta`, out of the material (into the tooth space)."""
        beta = np.asarray(beta, dtype=float)
        return radial(self._rolling(beta) + beta)

    def fillet_length(self, beta: ArrayLike) -> Array:
        """Arc length of the fillet from the root circle to `beta`.

        The tip's centre turns about the pitch point at a distance depth/cos(beta) while the tip's normal
        turns by d beta + d angle: ds/d beta = depth^2/(r cos^3 beta) + radius (1 + depth/(r cos^2 beta)),
        here integrated.
        """
        beta = np.asarray(beta, dtype=float)
        t, c = np.tan(beta), 1 / np.cos(beta)
        h, r = self.rack_depth, self.reference_radius
        return 0.5 * h * h / r * (t * c + np.arcsinh(t)) + self.rack_radius * (beta + h / r * t)

    def fillet_speed(self, beta: ArrayLike) -> Array:
        """Derivative of `fillet_length`."""
        c = 1 / np.cos(np.asarray(beta, dtype=float))
        h, r = self.rack_depth, self.reference_radius
        return h * h / r * c**3 + self.rack_radius * (1 + h / r * c**2)

    def fillet_radius(self, beta: ArrayLike) -> Array:
        """Magnitude of the radius of curvature of the fillet."""
        c = 1 / np.cos(np.asarray(beta, dtype=float))
        turning = np.abs(1 + self.rack_depth / self.reference_radius * c**2)
        return self.fillet_speed(beta) / np.maximum(turning, 1e-12)

    def fillet_beta(self, length: ArrayLike) -> Array:
        """Inverse of `fillet_length`, by Newton's method from a table."""
        length = np.asarray(length, dtype=float)
        table = np.linspace(0.0, self.beta_form, 257)
        beta = np.interp(length, self.fillet_length(table), table)
        for _ in range(4):
            speed = self.fillet_speed(beta)
            # The speed vanishes only where the fillet has no length at all.
            step = (length - self.fillet_length(beta)) / np.where(speed > 0.0, speed, np.inf)
            beta = np.clip(beta + step, 0.0, self.beta_form)
        return beta


def profile(gear: Gear, name: str = "gear") -> Profile:
    """The profile of a gear. `name` is the gear's key in the case, used in the sentence of a `GeometryError`.

    The gear is cut by its rack down to the generating profile shift x_E = x - thinning/(2 m tan alpha) (ISO
    21771), so thinning lowers the root with the flank. Raises GeometryError on undercut, a rack tip radius or
    a tip edge that does not fit, a pointed tip, and a hub or bore that does not fit.
    """
    m, alpha = gear.module, gear.pressure_angle
    reference = m * gear.teeth / 2
    base = reference * cos(alpha)
    shift = gear.profile_shift - gear.thinning / (2 * m * tan(alpha))
    rack_radius = gear.rack_tip_radius * m
    depth = (gear.dedendum - shift) * m - rack_radius
    offset = m * pi / 4 - (gear.dedendum * m - rack_radius) * tan(alpha) - rack_radius / cos(alpha)
    rho_form = reference * sin(alpha) - depth / sin(alpha) - rack_radius
    psi_b = (pi / 2 + 2 * shift * tan(alpha)) / gear.teeth + involute(alpha)
    tip = reference + (gear.addendum + gear.profile_shift) * m
    if gear.tip_diameter is not None:
        tip = gear.tip_diameter / 2
    check_rack(gear, name, offset)
    check_undercut(gear, name, rho_form)
    check_tip(gear, name, tip=tip, base=base, psi_b=psi_b, rho_form=rho_form)
    root = reference - depth - rack_radius
    check_body(gear, name, root)
    edge = gear.tip_edge_radius
    return Profile(
        teeth=gear.teeth,
        module=m,
        pressure_angle=alpha,
        reference_radius=reference,
        base_radius=base,
        tip_radius=tip,
        root_radius=root,
        edge_radius=edge,
        psi_b=psi_b,
        rho_form=max(rho_form, 0.0),
        rho_end=edge + sqrt((tip - edge) ** 2 - base**2),
        rack_depth=depth,
        rack_offset=max(offset, 0.0),
        rack_radius=rack_radius,
    )

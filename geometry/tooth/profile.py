"""The exact tooth profile: involute, trochoidal fillet of the rounded rack tip, rounded tip edge.

Gear frame: origin at the gear's centre, tooth 0 centred on +x; the working flank is the counter-clockwise
one. Lengths in m, angles in rad. Points and normals are arrays (..., 2); normals are unit vectors out of the
material. Notation and formulas: ISO 21771:2007 (involute, generating profile shift); F. L. Litvin and A.
Fuentes, Gear Geometry and Applied Theory (2004), chapters 5 and 10 (envelope of the rack's rounded tip, undercut).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, pi, sqrt, tan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry.tooth.fillet import Trochoid, form_point, neck, radial, tangential
from gearbench.geometry.tooth.limits import (
    NECK_MODULES,
    check_body,
    check_module,
    check_neck,
    check_rack,
    check_root,
    check_thinning,
    check_tip,
)
from gearbench.rig import Gear

Array = NDArray[np.float64]


def involute(angle: float) -> float:
    """inv(angle) = tan(angle) - angle: polar angle [rad] of an involute at that pressure angle."""
    return tan(angle) - angle


@dataclass(frozen=True)
class Profile:
    """The boundary of one tooth; build it with `profile(gear)`.

    Along the working flank, `rho` is the roll length on the base tangent and `s` the arc length from the
    involute's (virtual) origin on the base circle, which goes on along the tip-edge arc. Along the fillet,
    `beta` is the angle between the rack tip's normal and the centre line: 0 on the root circle, `beta_form` on the
    involute (pi/2 - pressure_angle, less on undercut teeth).
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
    beta_form: float  # parameter of the fillet where the involute begins
    trochoid: Trochoid  # that the fillet is part of

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
    def undercut(self) -> bool:
        """Whether the fillet cuts into the involute: both then meet in an outward corner, else tangentially."""
        return self.beta_form < self.trochoid.beta_last

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
        return self.trochoid.offset / self.reference_radius

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

    def fillet(self, beta: ArrayLike) -> Array:
        """Points of the fillet at `beta` in [0, beta_form]."""
        return self.trochoid.points(beta)

    def fillet_normals(self, beta: ArrayLike) -> Array:
        """Normals of the fillet at `beta`, out of the material (into the tooth space)."""
        return self.trochoid.normals(beta)

    def fillet_length(self, beta: ArrayLike) -> Array:
        """Arc length of the fillet from the root circle to `beta`."""
        return self.trochoid.length(beta)

    def fillet_speed(self, beta: ArrayLike) -> Array:
        """Derivative of `fillet_length`."""
        return self.trochoid.speed(beta)

    def fillet_radius(self, beta: ArrayLike) -> Array:
        """Magnitude of the radius of curvature of the fillet."""
        return self.trochoid.curvature_radius(beta)

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


def generated(gear: Gear) -> tuple[Trochoid, float, float]:
    """What the rack makes of a gear: its fillet (before the involute ends it), the polar angle of the working
    involute's origin, and how far the rack tip radius fits into the rack tooth [m] (negative: it does not).

    The rack is fed down to the generating profile shift x_E = x - thinning/(2 m tan alpha) (ISO 21771), so thinning
    lowers the root with the flank.
    """
    m, alpha = gear.module, gear.pressure_angle
    shift = gear.profile_shift - gear.thinning / (2 * m * tan(alpha))
    radius = gear.rack_tip_radius * m
    offset = m * pi / 4 - (gear.dedendum * m - radius) * tan(alpha) - radius / cos(alpha)
    fillet = Trochoid(
        teeth=gear.teeth,
        reference_radius=m * gear.teeth / 2,
        pressure_angle=alpha,
        depth=(gear.dedendum - shift) * m - radius,
        offset=max(offset, 0.0),
        radius=radius,
    )
    return fillet, (pi / 2 + 2 * shift * tan(alpha)) / gear.teeth + involute(alpha), offset


def _has_neck(gear: Gear) -> bool:
    """Whether enough is left between the fillets of a tooth."""
    fillet, psi_b, _ = generated(gear)
    return neck(fillet, form_point(fillet, psi_b)[0]) >= NECK_MODULES * gear.module


def profile(gear: Gear, name: str = "gear") -> Profile:
    """The profile of a gear. `name` is the gear's key in the case, used in the sentence of a `GeometryError`.

    Undercut teeth lose the involute's beginning to the fillet. Raises GeometryError if the fillets cut a tooth off,
    for a rack tip radius or a tip edge that does not fit, a pointed tip or one inside the form circle, and a hub or
    bore that does not fit.
    """
    m = gear.module
    check_module(gear, name)
    fillet, psi_b, room = generated(gear)
    reference = fillet.reference_radius
    base = reference * cos(gear.pressure_angle)
    tip = reference + (gear.addendum + gear.profile_shift) * m
    if gear.tip_diameter is not None:
        tip = gear.tip_diameter / 2
    root = reference - fillet.depth - fillet.radius
    check_rack(gear, name, room)
    check_thinning(gear, name, psi_b)
    check_root(gear, name, root)
    check_neck(gear, name, _has_neck)
    beta_form, rho_form = form_point(fillet, psi_b)
    check_tip(gear, name, tip=tip, base=base, psi_b=psi_b, rho_form=rho_form)
    check_body(gear, name, root)
    edge = gear.tip_edge_radius
    return Profile(
        teeth=gear.teeth,
        module=m,
        pressure_angle=gear.pressure_angle,
        reference_radius=reference,
        base_radius=base,
        tip_radius=tip,
        root_radius=root,
        edge_radius=edge,
        psi_b=psi_b,
        rho_form=rho_form,
        rho_end=edge + sqrt((tip - edge) ** 2 - base**2),
        beta_form=beta_form,
        trochoid=fillet,
    )

"""The fillet: the trochoid that the rounded tip of a rolling rack leaves (Litvin and Fuentes 2004, chapters 5, 10).

It ends on the involute. Where the rack's tip reaches below the point in which the line of action touches the base
circle, the trochoid touches only the involute's virtual branch behind the base circle (roll length < 0) and crosses
the real one further out: the tooth is undercut, and the involute below the crossing has been cut away.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, pi, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry.tooth.roots import bracketed_root

Array = NDArray[np.float64]

# A form point this little (in reference radii of roll length) behind the base circle is rounding, not undercut.
ROUNDING = 1e-13
# Below this (in base radii) trochoid and involute part by less than rounding; the crossing then has a closed form.
SLIGHT = 1e-4
SAMPLES = 257


def radial(angle: ArrayLike) -> Array:
    """Unit vectors (..., 2) at the polar `angle`."""
    angle = np.asarray(angle, dtype=float)
    return np.stack((np.cos(angle), np.sin(angle)), axis=-1)


def rotation(angle: float) -> Array:
    """Matrix (2, 2) of a counter-clockwise rotation by `angle` [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def tangential(angle: ArrayLike) -> Array:
    """Unit vectors (..., 2) perpendicular to those at the polar `angle`, counter-clockwise."""
    angle = np.asarray(angle, dtype=float)
    return np.stack((-np.sin(angle), np.cos(angle)), axis=-1)


@dataclass(frozen=True)
class Trochoid:
    """The fillet on the counter-clockwise side of tooth 0, by the angle `beta` between the rack tip's normal and the
    centre line: 0 on the root circle, up to pi/2 - pressure_angle, where the tip's arc meets the rack's flank."""

    teeth: int
    reference_radius: float
    pressure_angle: float
    depth: float  # of the tip arc's centre below the rolling line [m]; may be negative
    offset: float  # distance of that centre from the axis of the rack tooth [m]
    radius: float  # of the tip's arc [m]

    @property
    def beta_last(self) -> float:
        """Parameter at which the trochoid touches the involute or its virtual branch."""
        return pi / 2 - self.pressure_angle

    @property
    def tangent_roll(self) -> float:
        """Roll length [m] of that point of tangency; negative: undercut."""
        sine = sin(self.pressure_angle)
        return self.reference_radius * sine - self.depth / sine - self.radius

    def _rolling(self, beta: Array) -> Array:
        """Polar angle of the pitch point (gear frame) while the rack tip touches at `beta`."""
        return pi / self.teeth + (self.depth * np.tan(beta) - self.offset) / self.reference_radius

    def points(self, beta: ArrayLike) -> Array:
        """Points (..., 2).

        The common normal of rack and gear passes through the pitch point (law of gearing), which fixes how far the
        rack has rolled when its tip touches with the normal `beta`.
        """
        beta = np.asarray(beta, dtype=float)
        angle = self._rolling(beta)
        depth = self.depth + self.radius * np.cos(beta)
        across = (depth * np.tan(beta))[..., None]
        return (self.reference_radius - depth)[..., None] * radial(angle) - across * tangential(angle)

    def normals(self, beta: ArrayLike) -> Array:
        """Unit normals (..., 2) out of the material (into the tooth space)."""
        beta = np.asarray(beta, dtype=float)
        return radial(self._rolling(beta) + beta)

    def length(self, beta: ArrayLike) -> Array:
        """Arc length [m] from the root circle to `beta`.

        The tip's centre turns about the pitch point at a distance depth/cos(beta) while the tip's normal turns by
        d beta + d angle: ds/d beta = depth^2/(r cos^3 beta) + radius (1 + depth/(r cos^2 beta)), here integrated.
        """
        beta = np.asarray(beta, dtype=float)
        t, c = np.tan(beta), 1 / np.cos(beta)
        h, r = self.depth, self.reference_radius
        return 0.5 * h * h / r * (t * c + np.arcsinh(t)) + self.radius * (beta + h / r * t)

    def speed(self, beta: ArrayLike) -> Array:
        """Derivative of `length`."""
        c = 1 / np.cos(np.asarray(beta, dtype=float))
        h, r = self.depth, self.reference_radius
        return h * h / r * c**3 + self.radius * (1 + h / r * c**2)

    def curvature_radius(self, beta: ArrayLike) -> Array:
        """Magnitude of the radius of curvature [m]."""
        c = 1 / np.cos(np.asarray(beta, dtype=float))
        turning = np.abs(1 + self.depth / self.reference_radius * c**2)
        return self.speed(beta) / np.maximum(turning, 1e-12)


def form_point(fillet: Trochoid, psi_b: float) -> tuple[float, float]:
    """Fillet parameter and roll length [m] where the fillet ends and the involute of origin angle `psi_b` begins: the
    point of tangency or, with undercut, the outermost crossing of trochoid and involute.

    The trochoid's radius grows along it (d r^2 = 2 r_reference sin(beta) ds), so radius and parameter determine each
    other.
    """
    last, tangent = fillet.beta_last, fillet.tangent_roll
    if tangent >= -ROUNDING * fillet.reference_radius:
        return last, max(tangent, 0.0)
    base = fillet.reference_radius * cos(fillet.pressure_angle)

    def over(radius: float) -> float:
        """Parameter at a radius."""
        if np.hypot(*fillet.points(0.0)) >= radius:
            return 0.0
        return bracketed_root(lambda beta: np.hypot(*fillet.points(beta)) - radius, 0.0, last, xtol=1e-15, rtol=1e-15)

    def beyond(beta: ArrayLike) -> Array:
        """Angle by which the trochoid stands out of the involute."""
        points = fillet.points(beta)
        along, across = points @ radial(psi_b), points @ tangential(psi_b)
        roll = np.sqrt(np.maximum((np.hypot(along, across) / base) ** 2 - 1, 0.0))
        return np.asarray(np.arctan2(across, along) + roll - np.arctan(roll))

    # To leading order, with t the roll length over that of the point of tangency, both curves part by
    # 2 t^3 - 3 t^2 + 1 times a constant, which vanishes at t = -1/2.
    beta = over(hypot(base, 0.5 * tangent))
    if -tangent > SLIGHT * base:
        grid = np.linspace(over(base), last, SAMPLES)
        within = beyond(grid) < 0.0
        outermost = np.flatnonzero(within[:-1] & ~within[1:])[-1]
        beta = bracketed_root(beyond, grid[outermost], grid[outermost + 1], xtol=1e-15, rtol=1e-15)
    if beta >= last:  # an undercut below rounding
        return last, 0.0
    return beta, sqrt(max(float(np.sum(fillet.points(beta) ** 2)) - base**2, 0.0))


def neck(fillet: Trochoid, beta_form: float) -> float:
    """Smallest thickness [m] of the tooth between its two fillets, perpendicular to its axis; negative: cut off."""
    return 2 * float(fillet.points(np.linspace(0.0, beta_form, SAMPLES))[:, 1].min())

"""Flamant's half-plane under a unit line load: the singular part of every flank load.

Plane stress with modulus E and Poisson's ratio nu; plane strain by E -> E/(1-nu^2), nu -> nu/(1-nu).
Source: Timoshenko and Goodier (1970), Theory of Elasticity, art. 36.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LineLoad:
    """A unit force per unit thickness at `point`, along the unit vector `into` (into the body).

    `branch` is a unit vector pointing from the load out of the body: the displacement's branch cut runs along it,
    so it must not cross the material.
    """

    point: Array
    into: Array
    branch: Array

    def _polar(self, x: Array) -> tuple[Array, Array, Array]:
        d = x - self.point
        r = np.hypot(d[..., 0], d[..., 1])
        back = -self.branch
        omega = np.arctan2(back[0] * d[..., 1] - back[1] * d[..., 0], d @ back)
        offset = np.arctan2(self.into[0] * back[1] - self.into[1] * back[0], float(self.into @ back))
        return d, r, omega + offset

    def displacement(self, x: Array, modulus: float, poisson: float) -> Array:
        """Displacement [m per N/m] at points x (..., 2); zero constant terms, lengths in metres throughout."""
        d, r, theta = self._polar(x)
        c, s, ln = np.cos(theta), np.sin(theta), np.log(r)
        scale = 1.0 / (pi * modulus)
        u_r = -scale * (2 * c * ln + (1 - poisson) * theta * s)
        u_t = scale * (2 * s * ln + (1 + poisson) * s - (1 - poisson) * theta * c)
        e_r = d / r[..., None]
        e_t = np.stack([-e_r[..., 1], e_r[..., 0]], axis=-1)
        return u_r[..., None] * e_r + u_t[..., None] * e_t

    def traction(self, x: Array, normal: Array) -> Array:
        """Traction [1/m] that the half-plane's stress exerts on a surface with outward normal (..., 2) at x."""
        d, r, theta = self._polar(x)
        e_r = d / r[..., None]
        sigma = -2.0 * np.cos(theta) / (pi * r)
        return (sigma * np.sum(e_r * normal, axis=-1))[..., None] * e_r

"""A half-plane under pressed strips of its surface: displacement and stress anywhere, in closed form.

Muskhelishvili's potentials of a half-plane y > 0 under normal pressure p (Some Basic Problems of the Mathematical
Theory of Elasticity, 1953, art. 93), with z = x + i y and Phi = phi':

    Phi = -i/(2 pi) Int p/(z - xi) d xi          sigma_x + sigma_y = 4 Re Phi
    sigma_y - sigma_x + 2 i tau = -4 i y Phi'    2 mu (u + i v) = kappa phi - conj(phi) - 2 i y conj(Phi)

Each strip carries p = mean + slope xi over its width; a narrow one is Flamant's line load (`flamant.LineLoad`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.gear.elasticity import PlaneModuli

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SURFACE = 1e-6  # of a strip's half-width: closer points count as this deep


@dataclass(frozen=True)
class Strips:
    """Pressed strips (c,) of a body's surface, per unit thickness.

    middle (c, 2) [m]; into (c, 2): unit vectors into the body; branch (c, 2): unit vectors out of it, along which the
    displacement's branch cut runs without crossing material; half (c,): half-widths [m]; mean (c,) [Pa], slope (c,)
    [Pa/m]: pressure and its rise along `into` turned clockwise by a quarter.
    """

    middle: Array
    into: Array
    branch: Array
    half: Array
    mean: Array
    slope: Array

    def turned(self, matrix: Array) -> Strips:
        """The same strips seen in a frame turned by a rotation matrix (2, 2)."""
        middle, into, branch = (part @ matrix.T for part in (self.middle, self.into, self.branch))
        return Strips(middle, into, branch, self.half, self.mean, self.slope)

    def scaled(self, factor: Array) -> Strips:
        """The same strips with each pressure times a factor (c,)."""
        return Strips(self.middle, self.into, self.branch, self.half, self.mean * factor, self.slope * factor)

    @property
    def force(self) -> Array:
        """Force (2,) per unit thickness [N/m]."""
        return np.asarray((2 * self.half * self.mean) @ self.into)

    @property
    def moment(self) -> Array:
        """Moments (c,) of the strips about the origin per unit thickness [N], counter-clockwise."""
        along = np.column_stack([self.into[:, 1], -self.into[:, 0]])
        at, couple = self.middle, 2 / 3 * self.slope * self.half**3
        direct = 2 * self.half * self.mean * (at[:, 0] * self.into[:, 1] - at[:, 1] * self.into[:, 0])
        return direct + couple * (along[:, 0] * self.into[:, 1] - along[:, 1] * self.into[:, 0])

    def traction(self, x: Array, normal: Array) -> Array:
        """Traction (n, 2) [Pa] on surfaces with outward normals (n, 2) at x (n, 2), each strip taken as a line load.

        On the body's own curved surface that of a line load is finite and smooth, so it stands for what the strips
        leave there beside their pressure.
        """
        along = np.column_stack([self.into[:, 1], -self.into[:, 0]])
        at = self.middle + (self.slope * self.half**2 / (3 * self.mean))[:, None] * along
        force = 2 * self.half * self.mean
        out = np.zeros_like(x)
        for point, into, size in zip(at, self.into, force, strict=True):
            d = x - point
            square = np.sum(d * d, axis=1)
            radial = -2 * size / pi * (d @ into) * np.sum(d * normal, axis=1) / square**2
            out += radial[:, None] * d
        return out

    def stress(self, x: Array) -> Array:
        """Stress (n, 3) [Pa] at points x (n, 2): xx, yy, xy."""
        out = np.zeros((len(x), 3))
        for c in range(len(self.half)):
            z, y, high, low = self._local(c, x)
            a, mean, slope = self.half[c], self.mean[c], self.slope[c]
            log = high - low
            value = -0.5j / pi * ((mean + slope * z) * log - 2 * a * slope)
            change = -0.5j / pi * (slope * log - (mean + slope * z) * 2 * a / ((z - a) * (z + a)))
            trace, differ = 4 * value.real, -4j * y * change
            sxx, syy = 0.5 * (trace - differ.real), 0.5 * (trace + differ.real)
            sxy = 0.5 * differ.imag
            ey = self.into[c]
            ex = np.array([ey[1], -ey[0]])
            out[:, 0] += ex[0] ** 2 * sxx + ey[0] ** 2 * syy + 2 * ex[0] * ey[0] * sxy
            out[:, 1] += ex[1] ** 2 * sxx + ey[1] ** 2 * syy + 2 * ex[1] * ey[1] * sxy
            out[:, 2] += ex[0] * ex[1] * sxx + ey[0] * ey[1] * syy + (ex[0] * ey[1] + ex[1] * ey[0]) * sxy
        return out

    def displacement(self, x: Array, moduli: PlaneModuli) -> Array:
        """Displacement (n, 2) [m] at points x (n, 2), up to a rigid translation; metres inside the logarithm."""
        shear = moduli.lame[1]
        kappa = (3 - moduli.poisson) / (1 + moduli.poisson)
        out = np.zeros((len(x), 2))
        for c in range(len(self.half)):
            z, y, high, low = self._local(c, x)
            a, mean, slope = self.half[c], self.mean[c], self.slope[c]
            # Integrals of ln(z - xi) and of xi ln(z - xi) over the strip.
            plain = (z + a) * high - (z - a) * low - 2 * a
            moment = 0.5 * (z * z - a * a) * (high - low) - a * z
            potential = -0.5j / pi * (mean * plain + slope * moment)
            value = -0.5j / pi * ((mean + slope * z) * (high - low) - 2 * a * slope)
            w = (kappa * potential - potential.conj() - 2j * y * value.conj()) / (2 * shear)
            ey = self.into[c]
            out[:, 0] += w.real * ey[1] + w.imag * ey[0]
            out[:, 1] += -w.real * ey[0] + w.imag * ey[1]
        return out

    def _local(self, c: int, x: Array) -> tuple[Complex, Array, Complex, Complex]:
        """z and y in strip c's frame, and ln(z + a), ln(z - a) cut along the branch."""
        ey = self.into[c]
        d = x - self.middle[c]
        along = d[:, 0] * ey[1] - d[:, 1] * ey[0]
        depth = d @ ey
        a = self.half[c]
        # On the surface the limit from inside, also where rounding or a chord puts a point outside.
        near = (np.abs(along) <= 1.001 * a) & (depth < SURFACE * a) & (depth > -0.5 * a)
        depth = np.where(near, SURFACE * a, depth)
        z = along + 1j * depth
        back = -self.branch[c]
        inward = complex(back[0] * ey[1] - back[1] * ey[0], float(back @ ey))
        turn = np.log(inward)
        return z, depth, np.log((z + a) / inward) + turn, np.log((z - a) / inward) + turn

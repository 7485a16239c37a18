"""Compliance of one tooth under a parabolic pressure on a short stretch of its flank, hub held."""

from __future__ import annotations

from math import log, pi

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from gearbench.fem.gear.body import CondensedGear
from gearbench.fem.gear.elasticity import PlaneModuli

Array = NDArray[np.float64]

# Double integral of p(x) p(y) ln|x - y| on [-1, 1]^2 for p(x) = 3 (1 - x^2)/4.
MEAN_LOGARITHM = log(2.0) - 7.0 / 4.0
POINTS = 8


def patch_compliance(gear: CondensedGear, moduli: PlaneModuli, s: float, half_width: float) -> tuple[float, float]:
    """Work-conjugate displacement [m per N/m] of the working flank under a parabolic pressure with a resultant of one,
    centred at arc length s over +-half_width [m] of the involute: that of a sound tooth, and what the gear's crack adds
    on the cracked one."""
    xi, weight = np.polynomial.legendre.leggauss(POINTS)
    weight = weight * 0.75 * (1.0 - xi**2)
    at, flank = s + half_width * xi, slice(0, gear.last + 1)

    def mean(table: Array) -> float:
        spline = RectBivariateSpline(gear.s[flank], gear.s[flank], table[flank, flank], s=0)
        return float(weight @ spline(at, at) @ weight)

    singular = 2.0 / (pi * moduli.modulus) * (MEAN_LOGARITHM + log(half_width))
    sound = mean(gear.front[gear.reach]) - singular
    if gear.crack is None:
        return sound, 0.0
    own = gear.crack.reach
    return sound, mean(gear.crack.extra[own, own, 0, 0])

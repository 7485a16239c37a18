"""Motions of a housing on which the displacement sensors stand, compared by what each adds to the lines.

A motion of shares s (4,) of both supports, along and across, adds the sum of s_i s_j E_ij(w) g(w) to a line at w,
with g its answer over its compliance, 1 / (1 - r^2 + 2 i zeta r), r the ratio of w to its own frequency. Many are
compared, each with all other unknowns where they fit best beside it: what was fitted without a housing has made up for
a part of it.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from math import log, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from gearbench.diagnosis.structure.structure import (
    HOUSING,
    HOUSING_RATIO,
    HOUSING_SD,
    LEAST_STEP,
    MODE_LARGEST,
    MODE_SD,
    OBLIQUE_SD,
)

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Where resonances are looked for: logarithms of the frequency over the supports', and damping ratios.
SOUGHT_AT = tuple(float(at) for at in np.linspace(-MODE_LARGEST, 1.0, 121))
RATIOS = (0.02, 0.035, 0.06)
# Of those logarithms, from which resonances are two, and above which it is a gear that resonates across its support.
APART, LIGHTEST = 0.2, 0.4
# Compliance that a motion begins with at least: fits let stand what a rig does not feel.
LEAST = 2 * LEAST_STEP[HOUSING]
# Shares that are compared: angles along and across, and root mean squares across over those along.
ANGLES, OVER = 24, (0.0, 0.25, 0.5, 1.0)
PAIRS = tuple((i, j) for i in range(4) for j in range(i, 4))


class Resonance(NamedTuple):
    """Logarithm of the frequency of a motion of the housing over the supports', and its damping ratio."""

    at: float
    ratio: float


class Motion(NamedTuple):
    """A motion of the housing: its resonance, shares (4,) of driver and driven gear along, then across, whose root mean
    square along is 1, and compliance along over the supports'."""

    resonance: Resonance
    shares: Array
    compliance: float


def answer_of(over: Array, found: Resonance) -> Complex:
    """g (K,) at frequencies `over` those of the supports (K,)."""
    r = over / np.exp(found.at)
    return np.asarray(1.0 / (1.0 - r**2 + 2j * found.ratio * r))


def products_of(shares: Array) -> Array:
    """Those (n, 10) of shares (n, 4) with themselves, by PAIRS."""
    return np.stack([shares[:, i] * shares[:, j] for i, j in PAIRS], axis=1)


def likeliest(
    made_of: Callable[[Resonance], Array], left: Array, others: Array, most: int = 1, highest: float = LIGHTEST
) -> list[tuple[float, Motion]]:
    """At most so many motions of the housing that explain most of what is `left` (R,), at frequencies apart and below
    the `highest`, the best first, and by how many nats. `made_of` a resonance are the real parts (10, R) that each of
    PAIRS adds to it per standard deviation of its compliance; `others` (n, R): what the other unknowns do, each by its
    own, `left` being about the centre of their priors."""
    inner = cho_factor(np.eye(len(others)) + others @ others.T, lower=True)
    shares = _compared()
    products, across = products_of(shares), 0.5 * (shares[:, 2:] ** 2).sum(axis=1) / OBLIQUE_SD**2
    compared = []
    for found in map(Resonance._make, product(SOUGHT_AT, RATIOS)):
        made = made_of(found)
        alone = made - cho_solve(inner, others @ made.T).T @ others
        slopes = products @ (alone @ left)
        curved = 1.0 + np.einsum("ni,ij,nj->n", products, alone @ made.T, products, optimize=True)
        sizes = np.maximum(slopes / curved, LEAST / HOUSING_SD)
        gains = sizes * (slopes - 0.5 * sizes * curved) - across
        at = int(np.argmax(gains))
        gain = float(gains[at]) - 0.5 * (found.at**2 + log(found.ratio / HOUSING_RATIO) ** 2) / MODE_SD**2
        compared.append((gain, Motion(found, shares[at], HOUSING_SD * float(sizes[at]))))
    peaks: list[tuple[float, Motion]] = []
    for gain, motion in sorted(compared, key=lambda one: -one[0]):
        if all(abs(motion.resonance.at - one.resonance.at) > APART for _, one in peaks):
            peaks.append((gain, motion))
    return [one for one in peaks if one[1].resonance.at < highest][:most]


def _compared() -> Array:
    """Shares (n, 4) that are compared, whose root mean square along is 1."""
    along, across = (np.arange(ANGLES) * turn / ANGLES for turn in (pi, 2 * pi))
    return np.array([
        (sqrt(2) * np.cos(one), sqrt(2) * np.sin(one), over * sqrt(2) * np.cos(two), over * sqrt(2) * np.sin(two))
        for one, over in product(along, OVER)
        for two in (across if over > 0.0 else across[:1])
    ])  # fmt: skip

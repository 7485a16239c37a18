"""What passes away during a record: slow motion that had not settled when it began, as both gears turn on together
behind a heavy load, or that something moves the rig by besides.

A mean over repetitions keeps a part of it whose ends do not meet: a step that all lines have, that of the angles large
enough to drown the teeth. From one repetition to the next it changes by a smooth d_p(t), which is seen, as all else
repeats. The mean's ends then miss one another by the mean of what d_p is where repetitions follow one another, and so
do its slopes; Bernoulli polynomials have these steps and nothing else of it. What is left of slow motion is smooth, and
in the lowest lines alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt

import numpy as np
from numpy.polynomial.legendre import legder, legval, legvander
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Of the polynomials that changes from repetition to repetition are made of; what goes up to the degrees of the last
# ones is a tone or noise of some colour, and not slow.
SLOW, DEGREES = 9, 24
ABOVE = 50.0  # times the energy of the degrees beyond, from which a degree is slow motion
CERTAIN = 3.0  # standard deviations from which a step at the ends is one
ANGLES = ("angle_driver", "angle_driven")


def passing_away(channels: Mapping[str, Array], base_radii: tuple[float, float]) -> dict[str, Array]:
    """What passes away (P, N) of each channel (P, N). Of the angles [rad] it is what does of the motion of both gears
    together and of one against the other on their base circles [m]: polynomials that hold each angle by itself nearly
    miss both by different parts, which is a transmission error that nothing has."""
    out = {name: passing(values) for name, values in channels.items() if name not in ANGLES}
    one, two = (radius * channels[name] for name, radius in zip(ANGLES, base_radii, strict=True))
    together, against = passing((one + two) / 2), passing(one - two) / 2
    moved = (together + against, together - against)
    return out | {name: values / radius for name, values, radius in zip(ANGLES, moved, base_radii, strict=True)}


def passing(repetitions: Array) -> Array:
    """What passes away (P, N) of repetitions (P, N), of mean zero; nothing where there is one repetition, or where
    noise or faster motion explains how they differ."""
    count, samples = repetitions.shape
    nothing = np.zeros_like(repetitions)
    if count < 2:
        return nothing
    place = 2.0 * np.arange(samples) / samples - 1.0
    changes = np.diff(repetitions, axis=0)
    directions, triangle = np.linalg.qr(legvander(place, DEGREES))
    shares = directions.T @ changes.T
    energy = (shares**2).mean(axis=1)
    # A tone just too fast to be slow is in the next few degrees alone.
    rest = max(float(energy[SLOW + 1 : SLOW + 4].mean()), float(energy[SLOW + 4 :].mean()))
    slow = np.flatnonzero(energy[: SLOW + 1] > ABOVE * rest)
    if not slow.size:
        return nothing
    held = np.linalg.inv(triangle[: slow[-1] + 1, : slow[-1] + 1])
    weights = held @ shares[: slow[-1] + 1]
    changed = np.concatenate([nothing[:1], np.cumsum(legval(place, weights), axis=0)])
    return np.asarray(changed - changed.mean(axis=0) + _steps(weights, held * sqrt(rest), place))


def _steps(weights: Array, spread: Array, place: Array) -> Array:
    """The steps (N,) of value, slope and curvature at the ends of the mean over repetitions, where their changes have
    Legendre coefficients (degrees, P - 1), each off by as much as columns of `spread` (degrees, degrees); those that
    are too uncertain are left out."""
    along = 0.5 * (place + 1.0)
    bernoulli = (along - 0.5, along**2 - along + 1 / 6, along**3 - 1.5 * along**2 + 0.5 * along)
    out, factorial, count = np.zeros_like(place), 1.0, weights.shape[1]
    for order, polynomial in enumerate(bernoulli):
        begin, end = (2.0**order * legval(side, legder(np.eye(len(weights)), order)) for side in (-1.0, 1.0))
        # Every change is met where it begins, the last one where it ends as well.
        met = np.tile(begin, (count, 1))
        met[-1] += end
        step = float((met * weights.T).sum())
        if abs(step) < CERTAIN * float(np.linalg.norm(met @ spread)):
            break
        factorial *= order + 1
        out += step / (count + 1) / factorial * polynomial
    return out

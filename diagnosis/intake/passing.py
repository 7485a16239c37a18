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

import numpy as np
from numpy.polynomial.legendre import legder, legval, legvander
from numpy.typing import NDArray

Array = NDArray[np.float64]

DEGREES = 12  # at most, of the polynomials that changes from repetition to repetition are
# Nats that they must explain beside those of their coefficients' own choice (Schwarz, Ann. Stat. 6, 1978).
WORTH = 10.0
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
    noise explains how they differ."""
    count, samples = repetitions.shape
    nothing = np.zeros_like(repetitions)
    if count < 2:
        return nothing
    place = 2.0 * np.arange(samples) / samples - 1.0
    changes = np.diff(repetitions, axis=0)
    weights = _smooth(changes, place)
    if weights is None:
        return nothing
    changed = np.concatenate([nothing[:1], np.cumsum(legval(place, weights), axis=0)])
    return np.asarray(changed - changed.mean(axis=0) + _steps(weights, place))


def _smooth(changes: Array, place: Array) -> Array | None:
    """Legendre coefficients (degrees, P - 1) of changes (P - 1, N) from repetition to repetition; None where noise
    explains them."""
    directions, triangle = np.linalg.qr(legvander(place, DEGREES))
    shares = directions.T @ changes.T
    energy, size = float((changes**2).sum()), changes.size
    if energy == 0.0:
        return None
    left = np.maximum(energy - np.cumsum((shares**2).sum(axis=1)), 1e-30 * energy)
    chosen = len(changes) * np.arange(1, DEGREES + 2)
    gain = 0.5 * size * np.log(energy / left) - 0.5 * chosen * np.log(size)
    best = int(np.argmax(gain)) + 1
    if gain[best - 1] < WORTH:
        return None
    return np.asarray(np.linalg.solve(triangle[:best, :best], shares[:best]))


def _steps(weights: Array, place: Array) -> Array:
    """The steps (N,) of value, slope and curvature at the ends of the mean over repetitions, where their changes have
    Legendre coefficients (degrees, P - 1)."""
    along = 0.5 * (place + 1.0)
    bernoulli = (along - 0.5, along**2 - along + 1 / 6, along**3 - 1.5 * along**2 + 0.5 * along)
    out, factorial = np.zeros_like(place), 1.0
    for order, polynomial in enumerate(bernoulli):
        slope = 2.0**order * legder(weights, order) if order else weights
        ends = legval(-1.0, slope).sum() + float(legval(1.0, slope[:, -1]))
        factorial *= order + 1
        out += ends / (weights.shape[1] + 1) / factorial * polynomial
    return out

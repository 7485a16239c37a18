"""The mesh's elastic force at given deflections and the deflections under given forces, over arrays: what the
integrator's mesh does at an instant, without vibration."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.lumped.errors import LumpedError
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.reading import over_pairs, read_pairs

Array = NDArray[np.float64]

STEPS = 100
CLOSE = 1e-14  # of the tabulated deflections, at which a deflection is found


class Instants(NamedTuple):
    """A mesh at instants (n,): mesh phase [cycles], excess [m] and gain common to all pairs, excess [m] on the back
    flanks, and those that pairs have of their own (n, n_o), without columns where all teeth are alike."""

    phase: Array
    excess: Array
    gain: Array
    back: Array
    pair_excess: Array
    pair_gain: Array

    @property
    def differ(self) -> bool:
        """Whether the teeth differ."""
        return self.pair_excess.shape[1] > 0


class Pressed(NamedTuple):
    """Elastic force [N] (negative on the back flanks) and its tangent stiffness [N/m]; arrays."""

    force: Array
    tangent: Array


def alike(
    phase: ArrayLike, excess: ArrayLike = 0.0, gain: ArrayLike = 1.0, back: ArrayLike = 0.0
) -> Instants:
    """A mesh whose teeth do not differ."""
    at, over, factor, behind = np.broadcast_arrays(np.atleast_1d(np.asarray(phase, dtype=float)), excess, gain, back)
    none = np.empty((at.size, 0))
    return Instants(at, over, factor, behind, none, none)


def of_pairs(law: MeshLaw, at: Instants, travel: Array) -> Pressed:
    """What every pair (..., n, n_o) carries on the working flanks at the DTE `travel` (..., n) [m]."""
    excess, gain = at.excess[:, None], at.gain[:, None]
    if at.differ:
        excess, gain = excess + at.pair_excess, gain * at.pair_gain
    delta = np.broadcast_to(travel[..., None] + excess, (*travel.shape, len(law.offsets)))
    force, tangent = read_pairs(law, delta, at.phase)
    return Pressed(gain * force, gain * tangent)


def pressed(law: MeshLaw, at: Instants, travel: Array) -> Pressed:
    """What all pairs carry at the DTE `travel` (..., n) [m]."""
    force, tangent = law.evaluate(travel + at.excess, at.phase, at.excess + at.back)
    if not at.differ:
        return Pressed(at.gain * force, at.gain * tangent)
    pairs = of_pairs(law, at, travel)
    working, stiff = over_pairs(pairs.force), over_pairs(pairs.tangent)
    back = (force < 0.0) & (working == 0.0)
    return Pressed(np.where(back, at.gain * force, working), np.where(back, at.gain * tangent, stiff))


def turning(law: MeshLaw, at: Instants, force: Callable[[Instants], Array]) -> Array:
    """What a force (n,) [N/cycle] of the mesh changes by as it turns: between two rows of the law along a straight
    line."""
    row = np.floor(at.phase * law.phases)
    low, high = (
        force(at._replace(phase=np.clip(one / law.phases, 0.0, 1.0 - 1e-12))) for one in (row, row + 1)
    )
    return np.asarray((high - low) * law.phases)


def travel_under(law: MeshLaw, at: Instants, force: Array) -> Array:
    """DTE (..., n) [m] at which the mesh carries the forces > 0 [N], by Newton's method between bounds. Raises
    LumpedError."""
    force = np.broadcast_to(force, np.broadcast_shapes(np.shape(force), at.phase.shape))
    reach = at.excess + (at.pair_excess.max(axis=1) if at.differ else 0.0)
    low = np.broadcast_to(-reach, force.shape)
    high = low + law.approach[-1]
    for _ in range(STEPS):
        short = pressed(law, at, high).force < force
        if not short.any():
            break
        high = np.where(short, low + 2 * (high - low), high)
    else:
        raise LumpedError(f"the mesh carries {force.max():.4g} N at no deflection")
    travel = high
    for _ in range(STEPS):
        found, stiff = pressed(law, at, travel)
        low, high = np.where(found < force, travel, low), np.where(found < force, high, travel)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = travel + (force - found) / stiff
        halved = 0.5 * (low + high)
        # One that rounding leaves at a bound is there; half way to the other would begin anew.
        after = np.where((step >= low) & (step <= high), step, halved)
        if np.all(np.abs(after - travel) <= CLOSE * (high - low + law.approach[-1])):
            return np.asarray(after)
        travel = after
    return np.asarray(travel)

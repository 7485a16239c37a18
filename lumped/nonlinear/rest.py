"""A rig at rest under a constant force, and its small vibrations about that."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.lumped.errors import LumpedError
from gearbench.lumped.nonlinear.constants import Constants
from gearbench.lumped.nonlinear.coordinates import COORDINATES, FURTHER, U1
from gearbench.lumped.nonlinear.structure import Structure
from gearbench.rig import Support

Array = NDArray[np.float64]

BISECTIONS = 100
# Of a support whose stiffness depends on it [m]: at rest without load it would be 0 or infinite.
LEAST_DEFLECTION = 1e-9


class Around(NamedTuple):
    """A rig around its mesh: springs [N/m] and dampers [N s/m] (n, n) between its coordinates, inverse masses [1/kg]
    (n,), 0 for what does not move, and what each coordinate contributes to the DTE (n,)."""

    springs: Array
    dampers: Array
    inverse: Array
    mesh: Array


def centre_at_rest(support: Support, push: float, aside: float) -> tuple[float, float]:
    """Deflection along and across [m] of a support under a force along `push` and across `aside` [N].

    Raises LumpedError where a softening support gives way under its cross-coupling.
    """
    across, stiffness = support.across, support.stiffness
    if stiffness is None:  # rigid
        return 0.0, 0.0
    if across is None:
        return _along(support, stiffness, push), 0.0
    # x follows from the balance across; what is left along is the support's own spring less k_c^2/k_x.
    softer = across.coupling**2 / across.stiffness
    left = push - across.coupling * aside / across.stiffness
    if support.exponent:
        y = _along_less(support, stiffness, left, softer)
    else:
        y = left / (stiffness - softer)
    return y, (aside - across.coupling * y) / across.stiffness


def _along(support: Support, stiffness: float, push: float) -> float:
    deflection = push / stiffness
    if support.exponent:  # a linear support does not depend on its reference, not even in rounding
        reference = support.reference_deflection
        size = abs(deflection) / reference
        deflection = float(np.sign(push)) * reference * size ** (1 / (1 + support.exponent))
    return deflection


def _along_less(support: Support, stiffness: float, push: float, softer: float) -> float:
    """Deflection under `push` of the support beside a spring of stiffness -softer [N/m], by bisection."""

    def short(y: float) -> bool:
        own = stiffness * y * (y / support.reference_deflection) ** support.exponent
        return own - softer * y < abs(push)

    high = abs(_along(support, stiffness, push))
    for _ in range(BISECTIONS):
        if not short(high):
            break
        high *= 2
    else:
        raise LumpedError(
            f"a support with exponent = {support.exponent:g} gives way under its across.coupling_n_per_m: nothing holds"
            f" {abs(push):.4g} N"
        )
    low = 0.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if short(middle) else (low, middle)
    return float(np.sign(push)) * high


class Lifted(NamedTuple):
    """A housing at rest: both its motions [m], and those of driver's and driven support with them, along and across."""

    motions: tuple[float, float]
    along: tuple[float, float]
    across: tuple[float, float]


def housing_at_rest(s: Structure | None, push: float, aside: float) -> Lifted:
    """The housing where the mesh pushes the supports apart: the driver's by -push along and -aside across [N], the
    driven gear's by push and aside."""
    if s is None:
        return Lifted((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
    h, k = s.housing, s.rocking
    one, two = (
        (push * (move.share2 - move.share1) + aside * (move.across2 - move.across1)) / move.stiffness
        if move.inverse
        else 0.0
        for move in (h, k)
    )
    return Lifted(
        (one, two),
        (h.share1 * one + k.share1 * two, h.share2 * one + k.share2 * two),
        (h.across1 * one + k.across1 * two, h.across2 * one + k.across2 * two),
    )


def inverse_masses(c: Constants, s: Structure | None) -> Array:
    """Inverse masses [1/kg] of all coordinates, 0 for those that do not move; (5,) or (10,)."""
    plain = [c.inverse_u1, c.inverse_y1, c.inverse_y2, c.inverse_u2, c.inverse_w]
    if s is None:
        return np.array(plain)
    return np.array([*plain, s.inverse_load, s.housing.inverse, s.rocking.inverse, s.inverse_x1, s.inverse_x2])


def mesh_direction(c: Constants, s: Structure | None) -> Array:
    """What each coordinate contributes to the DTE; (5,) or (10,)."""
    plain = [1.0, c.factor, -c.factor, -1.0, 0.0]
    return np.array(plain if s is None else [*plain, 0.0, 0.0, 0.0, c.slide, -c.slide])


def support_directions(s: Structure | None) -> tuple[Array, Array]:
    """What each coordinate contributes to the deflections of both supports along their direction; (5,) or (10,)."""
    if s is None:
        _, y1, y2, _, _ = np.eye(COORDINATES)
        return y1, y2
    _, y1, y2, _, _, _, housing, rocking, _, _ = np.eye(COORDINATES + FURTHER)
    first = y1 - s.housing.share1 * housing - s.rocking.share1 * rocking
    return first, y2 - s.housing.share2 * housing - s.rocking.share2 * rocking


def across_directions(s: Structure) -> tuple[Array, Array]:
    """What each coordinate contributes to the deflections of both supports across their direction; (10,)."""
    housing, rocking, x1, x2 = np.eye(COORDINATES + FURTHER)[-4:]
    first = x1 - s.housing.across1 * housing - s.rocking.across1 * rocking
    return first, x2 - s.housing.across2 * housing - s.rocking.across2 * rocking


def displacement_directions(s: Structure | None, sensor_share: float) -> tuple[Array, Array]:
    """What each coordinate contributes to what the displacement sensors of driver and driven gear show, which make that
    part of the supports' motion with the housing; (5,) or (10,)."""
    (first, second), (one, two) = support_directions(None), support_directions(s)
    further = np.zeros(len(one) - COORDINATES)
    first, second = (np.concatenate([ground, further]) for ground in (first, second))
    return first + sensor_share * (one - first), second + sensor_share * (two - second)


class SupportSpring(NamedTuple):
    """A support: what coordinates contribute to its deflection (n,), stiffness [N/m], exponent and reference [m]."""

    along: tuple[float, ...]
    stiffness: float
    exponent: float
    reference: float

    def deflection(self, places: Array) -> Array:
        """Its deflection [m] at places (..., n)."""
        return np.asarray(places @ np.array(self.along))

    def force(self, places: Array) -> Array:
        """Its force [N] at places (..., n)."""
        deflection = self.deflection(places)
        return self.stiffness * deflection * (np.abs(deflection) / self.reference) ** self.exponent

    def tangent(self, deflection: Array | float) -> Array:
        """Its stiffness [N/m] about deflections [m]."""
        size = np.maximum(np.abs(deflection), LEAST_DEFLECTION) / self.reference
        return np.asarray(self.stiffness * (1 + self.exponent) * size**self.exponent)


def support_springs(c: Constants, s: Structure | None) -> tuple[SupportSpring, SupportSpring]:
    """The supports of driver and driven gear along their direction."""
    one, two = (tuple(float(part) for part in along) for along in support_directions(s))
    return (
        SupportSpring(one, c.stiffness1, c.exponent1, c.reference1),
        SupportSpring(two, c.stiffness2, c.exponent2, c.reference2),
    )


def springs_and_dampers(c: Constants, s: Structure | None, tangents: tuple[float, float]) -> tuple[Array, Array]:
    """Stiffness [N/m] and damping [N s/m] of all but the mesh, (n, n); tangents: of both supports along [N/m]."""
    size = COORDINATES if s is None else COORDINATES + FURTHER
    one = np.eye(size)
    u1, _, _, u2, w = one[:COORDINATES]
    shaft = u1 - w
    springs, dampers = c.shaft_stiffness * np.outer(shaft, shaft), c.shaft_damping * np.outer(shaft, shaft)
    dampers[U1, U1] += c.nudge
    if s is None:
        for row, k, d in ((1, tangents[0], c.damping1), (2, tangents[1], c.damping2)):
            springs[row, row] += k
            dampers[row, row] += d
        return springs, dampers
    load, housing, rocking = one[COORDINATES:-2]
    (first, second), (x1, x2) = support_directions(s), across_directions(s)
    pairs = (
        (u2 - load, s.load_stiffness, s.load_damping),
        (housing, s.housing.stiffness, s.housing.damping),
        (rocking, s.rocking.stiffness, s.rocking.damping),
        (first, tangents[0], c.damping1),
        (second, tangents[1], c.damping2),
        (x1, s.stiffness1, s.damping1),
        (x2, s.stiffness2, s.damping2),
    )
    seen, stiff, damped = (np.array(part) for part in zip(*pairs, strict=True))
    crossing = s.coupling1 * np.outer(first, x1) + s.coupling2 * np.outer(second, x2)
    return springs + (seen.T * stiff) @ seen + crossing + crossing.T, dampers + (seen.T * damped) @ seen

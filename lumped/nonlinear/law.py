"""The non-linear mesh: force over deflection and mesh phase, and how the tooth pairs share it, as tables.

Phase is that of the driven gear's rotation [cycles], 0 when driver tooth 0 touches at the pitch point; pair n is driver
tooth n mod z1 with driven tooth n mod z2 and passes the pitch point at phase n. The tables come from elsewhere (bench:
finite elements, or a stiffness k(phase)); this module only reads them, and needs numpy alone.

Between its nodes the force is deflection times a secant stiffness that is linear in phase and in the square root of the
deflection: exact where the mesh is linear, and dense near zero deflection, where contact stiffens.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.lumped.errors import LumpedError

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

REFERENCE = 0.3  # of the largest force, where the parts of the pairs are taken


def approach_grid(largest: float, nodes: int) -> Array:
    """Deflections (nodes,) [m] from 0 to `largest`, uniform in their square root."""
    return largest * (np.arange(nodes) / (nodes - 1)) ** 2


@dataclass(frozen=True, eq=False)
class MeshLaw:
    """Force of the mesh of sound, error-free gears, and the state of each pair in it.

    approach (n_d,) [m]: an `approach_grid`. force (n_p, n_d) [N] along the line of action, driver torque over base
    radius, at phases k/n_p. offsets (n_o,): successive whole numbers; the last column of `share` is zero at phase 0.
    share (n_p, n_o): part of the tangent stiffness that pair floor(phase) + offset carries at the reference load; adds
    up to 1. parts (n_p, n_d, n_o) [N]: what each pair carries of the force; they add up to it. rho1, rho2 (n_p, n_o):
    roll lengths [m] of those pairs' contacts. bending (n_p, n_o, 2): part that the driver's and the driven tooth's
    flexibility, without their local contact, has in their pair's. backlash [m]: along the line of action.
    base_pitch [m]. mirror: phase at which a pair's back flanks pass the pitch point. shared [m/N]: compliance through
    which the force of one pair bends the next. lead [m]: excess material at the first touch, from which deflections
    count.
    """

    approach: Array
    force: Array
    offsets: Integers
    share: Array
    parts: Array
    rho1: Array
    rho2: Array
    bending: Array
    backlash: float
    base_pitch: float
    mirror: float = 0.5
    shared: float = 0.0
    lead: float = 0.0

    def __post_init__(self) -> None:
        nodes = len(self.approach)
        if nodes < 3 or not np.allclose(self.approach, approach_grid(self.approach[-1], nodes), rtol=1e-9, atol=0):
            raise LumpedError("the deflections of a mesh law must be an approach_grid of at least 3 nodes")
        if self.force.ndim != 2 or self.force.shape[1] != nodes:
            raise LumpedError(f"the forces of a mesh law have shape {self.force.shape}, not (phases, {nodes})")
        shape = (len(self.force), len(self.offsets))
        for name in ("share", "rho1", "rho2"):
            if getattr(self, name).shape != shape:
                raise LumpedError(f"{name} of a mesh law has shape {getattr(self, name).shape}, not {shape}")
        if self.parts.shape != (*self.force.shape, len(self.offsets)):
            raise LumpedError(f"parts of a mesh law have shape {self.parts.shape}, not (phases, {nodes}, offsets)")
        if self.bending.shape != (*shape, 2):
            raise LumpedError(f"bending of a mesh law has shape {self.bending.shape}, not {(*shape, 2)}")

    def hardened(self, exponent: float, reference: float) -> MeshLaw:
        """The law F (F / reference)^exponent of the force F of this one; `reference` [N] > 0."""
        if exponent == 0.0:
            return self
        # Where there is no force, none becomes stiffer.
        level = np.ones_like(self.force)
        np.power(self.force / reference, exponent, out=level, where=self.force > 0.0)
        return replace(self, force=self.force * level, parts=self.parts * level[..., None])

    @property
    def phases(self) -> int:
        """Number of phases in a cycle."""
        return len(self.force)

    @cached_property
    def secant(self) -> Array:
        """Force over deflection [N/m] (phases + 1, n_d), the first phase repeated at the end; at zero deflection the
        line through the next two nodes."""
        table = np.empty((self.phases + 1, len(self.approach)))
        table[:-1] = _over(self.force, self.approach)
        table[-1] = table[0]
        return table

    @cached_property
    def pair_secants(self) -> Array:
        """Those of the pairs (phases + 1, n_d, n_o); where the cycle ends every pair has moved on by one offset."""
        return _moved_on(np.moveaxis(_over(np.moveaxis(self.parts, 1, 2), self.approach), 2, 1))

    @property
    def pitch_roll(self) -> tuple[float, float]:
        """Roll lengths [m] of driver and driven tooth at the pitch point; both are linear in the phase."""
        column = int(np.argmin(np.abs(self.offsets)))
        travel = self.offsets[column] * self.base_pitch
        return float(self.rho1[0, column] + travel), float(self.rho2[0, column] - travel)

    def evaluate(self, delta: ArrayLike, phase: ArrayLike, filled: ArrayLike = 0.0) -> tuple[Array, Array]:
        """Force [N] and tangent stiffness [N/m] at deflections [m] and phases [cycles] (shapes broadcast).

        Nothing touches from delta = 0 down to -backlash, which excess material on working and back flanks has `filled`
        [m] in part; below, the back flanks push the other way. Beyond the last node the force goes on as between the
        last two.
        """
        delta, phase = np.asarray(delta, dtype=float), np.asarray(phase, dtype=float)
        pressed = -delta - self.backlash + np.asarray(filled, dtype=float)
        back = (pressed > 0.0) & (delta <= 0.0)
        if np.any(back):
            depth = np.where(back, pressed, np.maximum(delta, 0.0))
            force, tangent = self._pressed(depth, np.where(back, self.mirror - phase, phase))
            return np.where(back, -force, force), np.where(back | (delta > 0), tangent, 0.0)
        force, tangent = self._pressed(np.maximum(delta, 0.0), phase)
        return force, np.where(delta > 0, tangent, 0.0)

    def _pressed(self, depth: Array, phase: Array) -> tuple[Array, Array]:
        """Force and tangent at deflections >= 0."""
        table = self.secant.ravel()
        row, weight = place_phase(phase, self.phases)
        last = len(self.approach) - 1
        root = last * np.sqrt(depth / self.approach[-1])
        node = np.minimum(root.astype(np.int64), last - 1)
        at, next_row = row * (last + 1) + node, last + 1
        low = table[at] + weight * (table[at + next_row] - table[at])
        at = at + 1
        high = table[at] + weight * (table[at + next_row] - table[at])
        rise = high - low
        stiffness = low + (root - node) * rise
        force, tangent = depth * stiffness, stiffness + 0.5 * root * rise
        beyond = root > last
        if np.any(beyond):
            before, end = self.approach[-2:]
            slope = np.maximum((end * high - before * low) / (end - before), 0.0)
            force = np.where(beyond, end * high + slope * (depth - end), force)
            tangent = np.where(beyond, slope, tangent)
        return force, tangent

    @cached_property
    def closed(self) -> tuple[Array, Array]:
        """share and bending with the end of the cycle appended, where every pair has moved on by one offset."""
        bending = self.bending[[*range(self.phases), -1]]
        bending[-1, 1:] = self.bending[0, :-1]
        return _moved_on(self.share), bending

    @property
    def reference_force(self) -> float:
        """Force [N] at which the parts of the pairs are taken."""
        return REFERENCE * float(self.force[:, -1].max())

    @cached_property
    def carried(self) -> Array:
        """Parts (phases + 1, n_o) of the force that the pairs carry at the reference force, the end of the cycle
        appended: a pair that begins to touch has little of it, whatever it adds to the stiffness."""
        level, rows = self.reference_force, np.arange(self.phases)
        node = np.clip((self.force < level).sum(axis=1), 1, len(self.approach) - 1)
        low, high = self.force[rows, node - 1], self.force[rows, node]
        weight = ((level - low) / (high - low))[:, None]
        at = self.parts[rows, node - 1] + weight * (self.parts[rows, node] - self.parts[rows, node - 1])
        return _moved_on(at / at.sum(axis=1, keepdims=True))

    def pairs(self, phase: ArrayLike) -> tuple[Integers, Array]:
        """Numbers (..., n_o) of the pairs near contact at `phase` (...), and their tangent shares (..., n_o)."""
        phase = np.asarray(phase, dtype=float)
        numbers = np.floor(phase).astype(np.int64)[..., None] + self.offsets
        return numbers, self._between(self.closed[0], phase)

    def carried_at(self, phase: ArrayLike) -> Array:
        """Parts (..., n_o) of the force that the pairs carry that `pairs` lists."""
        return self._between(self.carried, np.asarray(phase, dtype=float))

    def bending_of(self, phase: ArrayLike) -> Array:
        """Bending parts (..., n_o, 2) of the pairs that `pairs` lists."""
        return self._between(self.closed[1], np.asarray(phase, dtype=float))

    def _between(self, table: Array, phase: Array) -> Array:
        row, weight = place_phase(phase, self.phases)
        weight = weight.reshape(weight.shape + (1,) * (table.ndim - 1))
        return np.asarray(table[row] + weight * (table[row + 1] - table[row]))

    def friction(self, phase: ArrayLike, transition: float = 0.0) -> tuple[Array, Array, Array]:
        """Levers of friction: sums over the pairs of part sgn rho1 [m], part sgn [-] and part sgn rho2 [m], the part
        of the force that a pair carries.

        sgn is that of the steady rotation, which vibration may turn round (`lumped.nonlinear`): +1 after the pitch
        point, where the driver's flank slides faster, and -1 before. Friction of coefficient
        mu at the normal force N is mu N (-m1, -s sin a_w, +m2, +s sin a_w) on (driver rotation, driver y, driven
        rotation, driven y). `transition` [m] > 0 makes sgn a tanh of the distance from the pitch point over it.
        """
        phase = np.asarray(phase, dtype=float)
        away = (phase - np.floor(phase))[..., None] - self.offsets
        travel = away * self.base_pitch
        sign = np.sign(travel) if transition <= 0.0 else np.tanh(travel / transition)
        weight = self.carried_at(phase) * sign
        centre1, centre2 = self.pitch_roll
        total = weight.sum(axis=-1)
        spread = (weight * travel).sum(axis=-1)
        return centre1 * total + spread, total, centre2 * total - spread


def _over(force: Array, approach: Array) -> Array:
    """Secants (..., n_d) [N/m] of forces (..., n_d) [N] at the nodes of an approach_grid; at zero deflection the line
    through the next two nodes."""
    table = np.empty(force.shape)
    table[..., 1:] = force[..., 1:] / approach[1:]
    table[..., 0] = np.maximum(2 * table[..., 1] - table[..., 2], 0.0)
    return table


def _moved_on(table: Array) -> Array:
    """What pairs have (phases, ..., n_o) with the end of the cycle appended, where each has moved on by one offset."""
    closed = np.zeros((len(table) + 1, *table.shape[1:]))
    closed[:-1] = table
    closed[-1, ..., 1:] = table[0, ..., :-1]
    return closed


def place_phase(phase: ArrayLike, phases: int) -> tuple[Integers, Array]:
    """Row of the table below each phase [cycles], and the fraction of the interval that lies behind it."""
    position = np.asarray(phase, dtype=float)
    position = (position - np.floor(position)) * phases
    row = np.minimum(position.astype(np.int64), phases - 1)
    return row, position - row

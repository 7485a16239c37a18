"""Tooth pairs of the unreduced rig: where they press on hubs and outlines, and what of their approach the mesh lacks.

The mesh answers a pair's force with the work-conjugate displacement of a smooth patch. The true approach, that of the
contact law, is larger by the local half-plane's part. Over the patches' static flexibility A the residual approach

    R_p(F) = D_p(F_p) + sum over q of (C_pq - A_pq) F_q

needs no mass; it carries the material's damping, u + beta u' = R(F). At rest mesh and residual give the law's own
approach, whatever the mesh (docs/physics.md, "Full model").
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.coupling import coupling
from gearbench.fem.contact.law import Meetings, find_pairs, overlaps
from gearbench.fem.contact.static import MARGIN
from gearbench.fem.full.gear import FullGear
from gearbench.fem.full.machine import Angles, Machine

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Pressed(NamedTuple):
    """Where n pairs press on one gear: sectors (n,) and nodal forces (n, m) of its outline per unit of force."""

    sectors: Index
    patches: Array

    def field(self, teeth: int, force: Array) -> Array:
        """Nodal forces (m, teeth) of the outline under the pairs' forces (n,) [N]."""
        out = np.zeros((self.patches.shape[1], teeth))
        for sector, patch, f in zip(self.sectors, self.patches, force, strict=True):
            out[:, sector] += f * patch
        return out

    def moved(self, outline: Array) -> Array:
        """Inward displacements (n,) [m] of the patches when the outlines of their sectors move by (m, n)."""
        return np.einsum("nm,mn->n", self.patches, outline)

    def between(self, table: Array, teeth: int) -> Array:
        """Displacement (n, n) at patch p per force on patch q through a flexibility (2 reach + 1, m, m)."""
        reach = (len(table) - 1) // 2
        n = len(self.sectors)
        out = np.zeros((n, n))
        groups = [(int(j), np.flatnonzero(self.sectors == j)) for j in np.unique(self.sectors)]
        for j, here in groups:
            for k, there in groups:
                apart = (j - k + teeth // 2) % teeth - teeth // 2
                if abs(apart) <= reach:
                    moved = self.patches[there] @ table[apart + reach] @ self.patches[here].T
                    out[np.ix_(here, there)] = moved.T
        return out


class Met(NamedTuple):
    """Tooth pairs near contact: derivative (n, h) of their gaps by the hub unknowns, where they press on both gears,
    rigid overlaps (n,) [m], coupling (n, n) [m/N] that the meshes lack, and the lever (n,) [m] by which a force turns
    the driven gear on."""

    pairs: Meetings
    rows: Array
    pressed: tuple[Pressed, Pressed]
    over: Array
    cross: Array
    lever: Array


def meet(machine: Machine, at: Angles, y: Array) -> Met:
    """Tooth pairs at given angles and support motions (2,) [m]."""
    dx, dy = machine.law.centre + machine.axis[0] * (y[1] - y[0]), machine.axis[1] * (y[1] - y[0])
    pairs = find_pairs(machine.law, at.driver, at.driven, dx, dy, MARGIN)
    return met_pairs(machine, pairs)


def met_pairs(machine: Machine, pairs: Meetings) -> Met:
    """What the tooth pairs press on."""
    one, two = machine.gears
    pressed = (
        press(one, -pairs["tooth"], pairs["s1"], pairs["side"]),
        press(two, pairs["tooth"] + pairs["side"], pairs["s2"], pairs["side"]),
    )
    cross = coupling(machine.law, pairs)
    for gear, on in zip(machine.gears, pressed, strict=True):
        cross = cross - on.between(gear.compliance, gear.teeth)
    lever = (1.0 - 2.0 * pairs["side"]) * pairs["lever2"]
    return Met(pairs, hub_rows(machine, pairs), pressed, overlaps(pairs), cross, lever)


def press(gear: FullGear, teeth: Index, s: Array, side: Index) -> Pressed:
    """Patches at arc lengths s (n,) of flanks `side` (n,) of the teeth (n,), numbered counter-clockwise."""
    patches = [gear.outline.patch(float(at), int(flank)) for at, flank in zip(s, side, strict=True)]
    return Pressed(teeth % gear.teeth, np.array(patches).reshape(-1, gear.outline.size))


def hub_rows(machine: Machine, pairs: Meetings) -> Array:
    """Derivative (n, h) of every pair's gap by the hub unknowns, which is also the direction of its force on them."""
    r = machine.rotations
    rows = np.zeros((len(pairs), machine.hubs))
    sign = 1.0 - 2.0 * pairs["side"]
    rows[:, 0] = -sign * pairs["lever1"]
    if r == 2:
        rows[:, 1] = sign * pairs["lever2"]
    along = pairs["nx"] * machine.axis[0] + pairs["ny"] * machine.axis[1]
    rows[:, r], rows[:, r + 1] = -along, along
    return rows

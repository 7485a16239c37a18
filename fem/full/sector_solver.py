"""One matrix of a whole gear factorised once, sector by sector, and solved for fields over all sectors.

A field is (unknowns of a sector, teeth), every sector in the frame of its own tooth. Of a displacement, what lies on a
cut is held by both of its sectors; of forces, the two sectors' parts add up.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix

from gearbench.fem.full.columns import symmetric_sweeps
from gearbench.fem.gear.ring import Ring, Solver, make_ring
from gearbench.geometry.mesh.values import SectorMesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class SectorSolver:
    """The inverse of a gear's matrix, hub held: one sector condensed to its cuts, and the inverse (teeth//2 + 1, cut,
    cut) of the ring of cuts for every number of nodal diameters."""

    ring: Ring
    inverse: NDArray[np.complex128]

    def cuts(self, forces: Array) -> tuple[Array, Array]:
        """Displacements (cut unknowns, ..., teeth) of the cuts under forces (unknowns, ..., teeth), and what acts on
        the inner unknowns."""
        ring = self.ring
        inner = forces[ring.inner]
        on_cuts = forces[ring.cuts] - np.tensordot(ring.constraint_modes.T, inner, 1)
        return self.solve_cuts(on_cuts), inner

    def solve_cuts(self, on_cuts: Array) -> Array:
        """Displacements (cut unknowns, ..., teeth) under forces condensed to the cuts."""
        ring = self.ring
        n, turn = len(ring.low), ring.turn
        load = on_cuts[:n] + np.tensordot(turn.T, np.roll(on_cuts[n:], 1, axis=-1), 1)
        shape = load.shape
        spectrum = np.fft.rfft(load, axis=-1)
        columns = np.moveaxis(spectrum.reshape(n, -1, spectrum.shape[-1]), -1, 0)
        found = np.moveaxis(self.inverse @ columns, 0, -1).reshape(spectrum.shape)
        low = np.fft.irfft(found, n=ring.teeth, axis=-1).reshape(shape)
        return np.concatenate([low, np.tensordot(turn, np.roll(low, -1, axis=-1), 1)])

    def inside(self, on_cuts: Array, inner: Array) -> Array:
        """Displacements (unknowns, k) of k sectors from those of their cuts (cut unknowns, k) and the forces on their
        inner unknowns (inner unknowns, k)."""
        ring = self.ring
        out = np.zeros((ring.stiffness.shape[0], on_cuts.shape[1]))
        out[ring.cuts] = on_cuts
        out[ring.inner] = ring.solve_inner(inner) - ring.constraint_modes @ on_cuts
        return out

    def solve(self, forces: Array) -> Array:
        """Displacements (unknowns, teeth) under forces (unknowns, teeth)."""
        return self.inside(*self.cuts(forces))

    def solve_near(self, forces: Array, sectors: Index) -> Array:
        """Displacements (unknowns, k) of some sectors (k,) only."""
        on_cuts, inner = self.cuts(forces)
        return self.inside(on_cuts[:, sectors], inner[:, sectors])


def make_solver(
    sector: SectorMesh,
    matrix: csr_matrix,
    factorise: Callable[[csc_matrix], Solver] = symmetric_sweeps,
) -> SectorSolver:
    """Factorise the symmetric, definite matrix that `matrix` is one sector of."""
    ring = make_ring(sector, matrix, matrix, factorise)
    n, turn, s = len(ring.low), ring.turn, ring.cut_stiffness
    s_ll, s_lh, s_hh = s[:n, :n], s[:n, n:] @ turn, turn.T @ s[n:, n:] @ turn
    phases = np.exp(2j * pi * np.arange(ring.teeth // 2 + 1) / ring.teeth)
    return SectorSolver(ring, np.array([np.linalg.inv(s_ll + s_hh + s_lh * p + s_lh.T / p) for p in phases]))


def flexibility(solver: SectorSolver, unknowns: Index, reach: int) -> Array:
    """Displacements (2 reach + 1, m, m) of unknowns (m,) in the sectors -reach .. reach [sector, load, response] under
    unit forces on the same unknowns of sector 0."""
    ring = solver.ring
    count = len(unknowns)
    forces = np.zeros((ring.stiffness.shape[0], count))
    forces[unknowns, np.arange(count)] = 1.0
    inner = forces[ring.inner]
    on_cuts = np.zeros((len(ring.cuts), count, ring.teeth))
    on_cuts[:, :, 0] = forces[ring.cuts] - ring.constraint_modes.T @ inner
    moved = solver.solve_cuts(on_cuts)
    out = np.empty((2 * reach + 1, count, count))
    none = np.zeros_like(inner)
    for m in range(-reach, reach + 1):
        out[m + reach] = solver.inside(moved[:, :, m % ring.teeth], inner if m == 0 else none)[unknowns].T
    return out

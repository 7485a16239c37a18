"""A gear as a ring of identical tooth sectors, each in the frame of its own tooth, tied to a rigid hub.

Every sector is condensed once to its two radial cuts; the ring of cuts is block-circulant and solved by a discrete
Fourier transform over the teeth. One sector may differ from the others: it changes the ring by a matrix of low rank.
The result is that of the full gear's mesh, to rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.fillet import rotation

Array = NDArray[np.float64]
Solver = Callable[[Array], Array]
Indices = NDArray[np.int64]
SectorField = Callable[[int], Array]


def symmetric_lu(matrix: csc_matrix) -> Solver:
    """Factorise a symmetric sparse matrix with SuperLU's symmetric mode."""
    factor = splu(_narrow(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return factor.solve


def unknowns(nodes: Indices) -> Indices:
    """Unknowns 2 n, 2 n + 1 of nodes."""
    return (2 * np.asarray(nodes)[:, None] + np.arange(2)).ravel()


@dataclass(frozen=True)
class Ring:
    """`teeth` sectors with stiffness and mass of one sector, and its partition of unknowns."""

    teeth: int
    stiffness: csr_matrix
    mass: csr_matrix
    hub: Indices
    low: Indices
    high: Indices
    inner: Indices
    solve_inner: Solver
    constraint_modes: Array
    cut_stiffness: Array

    @property
    def cuts(self) -> Indices:
        """Unknowns of both cuts, the lower one first."""
        return np.concatenate([self.low, self.high])

    @cached_property
    def hub_stiffness(self) -> tuple[csr_matrix, csr_matrix]:
        """Stiffness between inner unknowns and hub, and between cuts and hub."""
        return self.stiffness[self.inner][:, self.hub], self.stiffness[self.cuts][:, self.hub]

    @property
    def turn(self) -> Array:
        """Block rotation that takes a cut's displacement from the next sector's frame to this one's."""
        return np.asarray(np.kron(np.eye(len(self.low) // 2), rotation(2 * pi / self.teeth)), dtype=np.float64)


def make_ring(
    sector: SectorMesh,
    stiffness: csr_matrix,
    mass: csr_matrix,
    factorise: Callable[[csc_matrix], Solver] = symmetric_lu,
) -> Ring:
    """Partition and condense one sector (hub held)."""
    hub_nodes = np.asarray(sector.hub)
    low_nodes = sector.cut_low[~np.isin(sector.cut_low, hub_nodes)]
    high_nodes = sector.cut_high[~np.isin(sector.cut_high, hub_nodes)]
    outer = np.concatenate([hub_nodes, low_nodes, high_nodes])
    inner_nodes = np.setdiff1d(np.arange(len(sector.points)), outer)
    hub, low, high, inner = (unknowns(n) for n in (hub_nodes, low_nodes, high_nodes, inner_nodes))
    cuts = np.concatenate([low, high])
    k_ii, k_ic = stiffness[inner][:, inner], stiffness[inner][:, cuts]
    solve = factorise(k_ii.tocsc())
    modes = solve(k_ic.toarray())
    condensed = stiffness[cuts][:, cuts].toarray() - k_ic.T @ modes
    return Ring(sector.teeth, stiffness, mass, hub, low, high, inner, solve, modes, 0.5 * (condensed + condensed.T))


def ring_response(ring: Ring, forces: SectorField, hub: SectorField, wanted: Indices) -> Array:
    """Displacements of chosen sectors under forces on all sectors and prescribed hub displacements.

    forces(j): (unknowns of a sector, loads); hub(j): (hub unknowns, loads); both in sector j's own frame.
    Returns (len(wanted), unknowns of a sector, loads).
    """
    kept: dict[int, tuple[Array, Array]] = {}
    f_cut = []
    for j in range(ring.teeth):
        f, u_hub = forces(j), hub(j)
        on_cuts, f_inner = to_cuts(ring, f, u_hub)
        f_cut.append(on_cuts)
        if j in wanted:
            kept[j] = (f_inner, u_hub)
    u_cut = _solve_cuts(ring, np.array(f_cut))
    out = np.zeros((len(wanted), ring.stiffness.shape[0], u_cut.shape[2]))
    for n, j in enumerate(wanted):
        f_inner, u_hub = kept[int(j)]
        out[n] = from_cuts(ring, u_cut[j], f_inner, u_hub)
    return out


def to_cuts(sector: Ring, forces: Array, hub: Array) -> tuple[Array, Array]:
    """Forces (unknowns, loads) and hub displacements of one sector, condensed to its cuts; and what of them acts on its
    inner unknowns."""
    inner_hub, cuts_hub = sector.hub_stiffness
    f_inner = forces[sector.inner] - inner_hub @ hub
    return forces[sector.cuts] - cuts_hub @ hub - sector.constraint_modes.T @ f_inner, f_inner


def from_cuts(sector: Ring, u_cut: Array, f_inner: Array, hub: Array) -> Array:
    """Displacements (unknowns, loads) of one sector from those of its cuts."""
    out = np.zeros((sector.stiffness.shape[0], u_cut.shape[1]))
    out[sector.hub] = hub
    out[sector.cuts] = u_cut
    out[sector.inner] = sector.solve_inner(f_inner) - sector.constraint_modes @ u_cut
    return out


def cut_influence(ring: Ring) -> Array:
    """Displacements (teeth, cut unknowns, cut unknowns) of all cuts under unit forces on those of sector 0."""
    size = len(ring.cuts)
    forces = np.zeros((ring.teeth, size, size))
    forces[0] = np.eye(size)
    return _solve_cuts(ring, forces)


def odd_sector_forces(ring: Ring, odd: Ring, influence: Array, moved: Array) -> Array:
    """What the cuts of sector 0 must be loaded with besides, for the ring to move as if that sector were `odd`.

    odd: a sector that fits into the ring, condensed by `make_ring`; influence: `cut_influence`; moved (cut unknowns,
    loads): those cuts' displacements without. With D the difference of both condensed stiffnesses and B the influence
    on the cuts themselves, g = -D (u + B g) (Sherman, Morrison and Woodbury), which is exact.
    """
    change = odd.cut_stiffness - ring.cut_stiffness
    return -np.linalg.solve(np.eye(len(change)) + change @ influence[0], change @ moved)


def _solve_cuts(ring: Ring, f_cut: Array) -> Array:
    """Block-circulant solution for both cuts of every sector; f_cut and result (teeth, cut unknowns, loads)."""
    n = len(ring.low)
    s, turn = ring.cut_stiffness, ring.turn
    s_ll, s_lh, s_hh = s[:n, :n], s[:n, n:] @ turn, turn.T @ s[n:, n:] @ turn
    load = f_cut[:, :n] + turn.T @ np.roll(f_cut[:, n:], 1, axis=0)
    spectrum = np.fft.rfft(load, axis=0)
    for h in range(spectrum.shape[0]):
        phase = np.exp(2j * pi * h / ring.teeth)
        block = s_ll + s_hh + s_lh * phase + s_lh.T / phase
        spectrum[h] = np.linalg.solve(block, spectrum[h])
    low = np.fft.irfft(spectrum, n=ring.teeth, axis=0)
    high = turn @ np.roll(low, -1, axis=0)
    return np.concatenate([low, high], axis=1)


def _narrow(matrix: csr_matrix) -> csc_matrix:
    """Compressed columns with contiguous data and 32-bit indices, which SuperLU asks for."""
    out = csc_matrix(matrix)
    data = np.ascontiguousarray(out.data)
    return csc_matrix((data, out.indices.astype(np.int32), out.indptr.astype(np.int32)), shape=out.shape)


@dataclass(frozen=True)
class RingMode:
    """One real fixed-hub mode: angular frequency [rad/s] and shape (teeth, unknowns), unit modal mass."""

    omega: float
    diameters: int
    shape: Array


def ring_modes(ring: Ring, density_thickness: float, thickness: float, count: int) -> list[RingMode]:
    """The lowest fixed-hub modes of the whole gear, degenerate pairs kept whole (so `count` may grow by one).

    density_thickness: rho b [kg/m^2]; thickness b [m]. Modes are mass-normalised over the whole gear.
    """
    if count == 0:
        return []
    found: list[RingMode] = []
    highest = ring.teeth // 2
    for h in range(highest + 1):
        per = max(2, (count + 3) // 4)
        modes = _harmonic_modes(ring, h, density_thickness, thickness, per)
        enough = len(found) >= count and modes[0].omega > sorted(m.omega for m in found)[count - 1]
        found.extend(modes)
        if enough and h >= 3:
            break
    found.sort(key=lambda m: (round(m.omega, 3), m.diameters))
    cut = count
    while cut < len(found) and found[cut].omega < found[cut - 1].omega * (1 + 1e-6):
        cut += 1
    return found[:cut]


def _harmonic_modes(ring: Ring, h: int, density: float, thickness: float, count: int) -> list[RingMode]:
    """Modes with h nodal diameters: the sector with its cuts tied by the phase of one tooth."""
    n_low = len(ring.low)
    phase = np.exp(2j * pi * h / ring.teeth)
    free = np.concatenate([ring.low, ring.inner])
    size = ring.stiffness.shape[0]
    rows = np.concatenate([ring.low, ring.inner])
    tie = csr_matrix((np.ones(len(free), complex), (rows, np.arange(len(free)))), shape=(size, len(free)))
    turn = csr_matrix(ring.turn * phase)
    expand = csr_matrix((np.ones(n_low), (ring.high, np.arange(n_low))), shape=(size, n_low))
    pick = csr_matrix((np.ones(n_low), (np.arange(n_low), np.arange(n_low))), shape=(n_low, len(free)))
    tie = tie + expand @ turn @ pick
    real = h == 0 or 2 * h == ring.teeth
    k = (tie.conj().T @ ring.stiffness @ tie) * thickness
    m = (tie.conj().T @ ring.mass @ tie) * density
    if real:
        k, m, tie = k.real, m.real, tie.real
    start = np.random.default_rng(1).standard_normal(len(free))
    k, m = _narrow(k), _narrow(m)
    inverse = LinearOperator(k.shape, symmetric_lu(k), dtype=k.dtype)
    squares, vectors = eigsh(k, k=count, M=m, sigma=0.0, v0=start.astype(k.dtype), OPinv=inverse)
    out: list[RingMode] = []
    turns = np.exp(2j * pi * h * np.arange(ring.teeth) / ring.teeth)
    for w2, v in sorted(zip(squares, vectors.T, strict=True), key=lambda pair: float(pair[0])):
        full = turns[:, None] * (tie @ v)[None, :]
        parts = [full.real] if real else [full.real * np.sqrt(2), full.imag * np.sqrt(2)]
        out.extend(RingMode(float(np.sqrt(w2)), h, p / np.sqrt(ring.teeth)) for p in parts)
    return out

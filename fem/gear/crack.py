"""A cracked tooth in the ring: its sector, meshed and condensed on its own, adds flexibility to that of sound teeth.

What is kept is the difference between the gear whose crack is open and the same mesh with the crack grown together: it
vanishes with the crack, and no difference of two meshes is in it. The faces of the crack are free. Loads on the working
flank open it. Loads on the back flank would press its faces together, which stay free to overlap here: for them the
tooth is too soft, by as much as the crack softens it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from gearbench.fem.gear.elasticity import PlaneModuli, assemble
from gearbench.fem.gear.flank import boundary_quadrature, flank_trace
from gearbench.fem.gear.flexibility import REACH, flank_loads, regular_forces, regular_motion
from gearbench.fem.gear.ring import Ring, cut_influence, make_ring, odd_sector_forces, ring_response, to_cuts
from gearbench.geometry.mesh.cracked_sector import cracked_sector
from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CrackedTooth:
    """What a crack adds to the flank kernels of a gear, per unit thickness [m per N/m].

    tooth: number of the cracked tooth. extra (2 reach + 1, 2 reach + 1, 2, 2, n, n): inward normal displacement [loaded
    tooth, responding tooth, loaded side, responding side, load at s_i, response at s_j]; teeth by how far
    counter-clockwise of the cracked one they lie, plus reach; side 0: working flank, 1: back flank.
    """

    tooth: int
    extra: Array

    @property
    def reach(self) -> int:
        """Number of teeth kept on either side of the cracked one."""
        return (len(self.extra) - 1) // 2


@dataclass(frozen=True)
class _Loads:
    """Unit loads at all samples of both flanks of every tooth within reach of the cracked one, tooth by tooth, side by
    side; `moved` (cut unknowns, loads): displacements of the cracked sector's cuts in the sound ring, the half-plane's
    left out, without what acts on that sector itself."""

    reach: int
    samples: int
    moved: Array


def condense_crack(
    gear: Gear,
    shape: Profile,
    ring: Ring,
    mesh: SectorMesh,
    moduli: PlaneModuli,
    s: Array,
    element_size: float | None = None,
) -> CrackedTooth:
    """The crack of a gear whose sound sectors have been condensed to `ring`; s (n,): arc lengths of the kernels'
    samples [m]. Raises GeometryError for a crack that does not fit into its sector."""
    assert gear.crack is not None
    influence = cut_influence(ring)
    reach = min(REACH, (ring.teeth - 1) // 2)
    loads = _sound_motion(ring, mesh, shape, moduli, s, reach)
    sectors = [cracked_sector(shape, gear, element_size, healed=healed) for healed in (False, True)]
    opened, closed = (_odd_sector(ring, influence, sector, shape, moduli, s, loads) for sector in sectors)
    pushed, own = opened[0] - closed[0], opened[1] - closed[1]
    extra = np.empty((2 * reach + 1, 2 * reach + 1, 2, 2, len(s), len(s)))
    traces = [flank_trace(shape, mesh, s, side) for side in (0, 1)]
    for b, offset in enumerate(range(-reach, reach + 1)):
        for side in (0, 1):
            answer = own[side] if offset == 0 else _answer(ring, traces[side], influence[offset]) @ pushed
            shaped = answer.reshape(len(s), 2 * reach + 1, 2, len(s))
            extra[:, b, :, side] = np.transpose(shaped, (1, 2, 3, 0))
    return CrackedTooth(gear.crack.tooth, extra)


def _answer(ring: Ring, trace: csr_matrix, u_cut: Array) -> Array:
    """What a flank's trace (n, unknowns) sees of cut displacements (cut unknowns, k) of its sector; (n, k)."""
    return np.asarray(trace[:, ring.cuts] @ u_cut - trace[:, ring.inner] @ (ring.constraint_modes @ u_cut))


def _sound_motion(ring: Ring, mesh: SectorMesh, shape: Profile, moduli: PlaneModuli, s: Array, reach: int) -> _Loads:
    """Loads on all teeth in question: those of one tooth's working flank, turned and mirrored."""
    quadrature = boundary_quadrature(shape, mesh)
    front = flank_loads(shape, s)
    hub_points = mesh.points[mesh.hub]
    offsets = np.arange(-reach, reach + 1)

    def sound_forces(j: int) -> Array:
        return regular_forces(quadrature, front.seen_from(j))

    def sound_hub(j: int) -> Array:
        return regular_motion(hub_points, front.seen_from(j), moduli)

    response = ring_response(ring, sound_forces, sound_hub, offsets % ring.teeth)
    influence = cut_influence(ring)
    moved = []
    for a in offsets:
        own, _ = to_cuts(ring, sound_forces(-int(a)), sound_hub(-int(a)))
        # A load on tooth a moves sector 0 as one on tooth 0 moves sector -a; on back flanks as in a mirror.
        seen = response[reach - a][ring.cuts] - influence[0] @ own
        own, _ = to_cuts(ring, sound_forces(int(a)), sound_hub(int(a)))
        mirrored = response[reach + a][ring.cuts] - influence[0] @ own
        moved += [seen, _mirrored_cuts(mirrored)]
    return _Loads(reach, len(s), np.concatenate(moved, axis=1))


def _mirrored_cuts(u: Array) -> Array:
    """Displacements (cut unknowns, loads) of the mirror image: lower and upper cut change places."""
    half = len(u) // 2
    return np.concatenate((u[half:], u[:half])) * np.tile([1.0, -1.0], half)[:, None]


def _odd_sector(
    ring: Ring, influence: Array, sector: SectorMesh, shape: Profile, moduli: PlaneModuli, s: Array, loads: _Loads
) -> tuple[Array, Array]:
    """Forces (cut unknowns, loads) with which sector 0 acts on a ring of sound sectors, and what each of its flanks
    does (side, n, loads), the half-plane's part left out."""
    odd = make_ring(sector, *assemble(sector, moduli))
    quadrature = boundary_quadrature(shape, sector, sides=(0, 1))
    on_cuts, on_inner = [], []
    for a in range(-loads.reach, loads.reach + 1):
        for side in (0, 1):
            seen = flank_loads(shape, s, side).seen_from(-a)
            hub = regular_motion(sector.points[sector.hub], seen, moduli)
            to_cut, to_inner = to_cuts(odd, regular_forces(quadrature, seen), hub)
            on_cuts.append(to_cut)
            on_inner.append(to_inner)
    acting = np.concatenate(on_cuts, axis=1)
    without = loads.moved + influence[0] @ acting
    pushed = odd_sector_forces(ring, odd, influence, without)
    u_cut = without + influence[0] @ pushed
    answers = []
    for side in (0, 1):
        trace = flank_trace(shape, sector, s, side)
        # Few samples, many loads: the trace is solved for, not the loads.
        weights = odd.solve_inner(trace[:, odd.inner].T.toarray())
        inner = np.concatenate([weights.T @ f for f in on_inner], axis=1)
        answers.append(inner + _answer(odd, trace, u_cut))
    return acting + pushed, np.array(answers)

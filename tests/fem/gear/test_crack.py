"""A cracked sector in the ring, and what it adds to the flanks' flexibility."""

from __future__ import annotations

from itertools import pairwise
from math import pi, radians
from typing import Any

import numpy as np
import pytest
from scipy.sparse.linalg import splu

from gearbench.fem.contact.law import make_law
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.gear.body import CondensedGear, condense
from gearbench.fem.gear.elasticity import assemble
from gearbench.fem.gear.ring import Ring, _solve_cuts, cut_influence, from_cuts, make_ring, odd_sector_forces, to_cuts
from gearbench.fem.gear.store import stored_gear
from gearbench.geometry.mesh.assembly import assembled
from gearbench.geometry.mesh.cracked_sector import cracked_sector
from gearbench.geometry.tooth.fillet import rotation
from gearbench.rig import Crack, Gear, Material

STEEL = Material()


def cracked(gear: Gear, length: float, direction: float = 60.0) -> Gear:
    return gear.model_copy(update={"crack": Crack(tooth=3, length=length, direction=radians(direction))})


def odd_ring_response(ring: Ring, odd: Ring, forces: Any, hub: Any, wanted: np.ndarray) -> list[np.ndarray]:
    """`ring_response` of a ring whose sector 0 is `odd`, with unknowns of its own."""
    sectors = [odd, *[ring] * (ring.teeth - 1)]
    moved = [hub(j) for j in range(ring.teeth)]
    pairs = [to_cuts(sector, forces(j), moved[j]) for j, sector in enumerate(sectors)]
    u_cut = _solve_cuts(ring, np.array([on_cuts for on_cuts, _ in pairs]))
    influence = cut_influence(ring)
    u_cut = u_cut + influence @ odd_sector_forces(ring, odd, influence, u_cut[0])
    return [from_cuts(sectors[j], u_cut[j], pairs[j][1], moved[j]) for j in wanted]


def dofs(nodes: np.ndarray) -> np.ndarray:
    return (2 * np.asarray(nodes)[:, None] + np.arange(2)).ravel()


@pytest.mark.validation
def test_ring_with_one_cracked_sector_equals_the_full_mesh(coarse: Any) -> None:
    """Forces on the cracked tooth and on others, cuts included, and a moving hub; one mesh of all, solved directly."""
    teeth, sound = coarse.full.teeth, coarse.sector
    mesh = cracked_sector(coarse.shape, cracked(coarse.gear, 1.5e-3), coarse.gear.module / 3)
    odd = make_ring(mesh, *assemble(mesh, coarse.moduli))
    sectors = [mesh, *[sound] * (teeth - 1)]
    full = assembled(sectors)
    points, node_of = full.points, full.node_of
    stiffness, _ = assemble(full, coarse.moduli)

    rng = np.random.default_rng(3)
    forces = [np.zeros((2 * len(s.points), 2)) for s in sectors]
    for k in (0, 1, 7, 19):
        edge = dofs(np.unique(np.concatenate([sectors[k].boundary_edges.ravel(), sectors[k].cut_low])))
        forces[k][edge] = 1e3 * rng.standard_normal((len(edge), 2))
        forces[k][dofs(sectors[k].hub)] = 0.0
    held = dofs(full.hub)
    u = np.zeros((2 * len(points), 2))
    x, y = points[held[::2] // 2].T
    u[held[::2], 0], u[held[1::2], 1], u[held[::2], 1] = -1e-6 * y, 2e-8, 1e-8
    u[held[1::2], 0] = 1e-6 * x
    load = np.zeros_like(u)
    turns = [rotation(2 * pi * k / teeth) for k in range(teeth)]
    for k in range(teeth):
        turned = np.einsum("ij,njl->nil", turns[k], forces[k].reshape(-1, 2, 2)).reshape(-1, 2)
        np.add.at(load, dofs(node_of[k]), turned)
    free = np.setdiff1d(np.arange(len(u)), held)
    u[free] = splu(stiffness[free][:, free].tocsc()).solve(load[free] - stiffness[free][:, held] @ u[held])
    local = [
        np.einsum("ij,njl->nil", turns[k].T, u[dofs(node_of[k])].reshape(-1, 2, 2)).reshape(-1, 2) for k in range(teeth)
    ]

    wanted = np.array([0, 1, 5, 19])
    hub = [local[k][dofs(sectors[k].hub)] for k in range(teeth)]
    found = odd_ring_response(coarse.ring, odd, lambda j: forces[j], lambda j: hub[j], wanted)
    for n, k in enumerate(wanted):
        assert np.abs(found[n] - local[k]).max() < 1e-9 * np.abs(u).max()


@pytest.fixture(scope="module")
def teeth(gear: Any) -> dict[float, CondensedGear]:
    """Cracks of several lengths [modules] in one gear of 20 teeth."""
    return {part: condense(cracked(gear(), part * 3e-3), STEEL, 0.5e-3, 0) for part in (0.01, 0.02, 0.3, 0.6)}


@pytest.mark.validation
def test_the_crack_vanishes_with_the_square_of_its_length(teeth: dict[float, CondensedGear]) -> None:
    """A short edge crack takes energy in proportion to a^2: what it adds does so too, and goes to nothing."""
    added = [np.abs(teeth[part].crack.extra).max() for part in (0.01, 0.02)]  # type: ignore[union-attr]
    assert added[1] / added[0] == pytest.approx(4.0, rel=0.05)
    assert added[0] < 2e-3 * np.abs(teeth[0.01].front).max()


@pytest.mark.validation
def test_longer_cracks_soften_more_and_reciprocity_holds(teeth: dict[float, CondensedGear]) -> None:
    extras = [gear.crack.extra for gear in teeth.values()]  # type: ignore[union-attr]
    for extra in extras:
        turned = np.transpose(extra, (1, 0, 3, 2, 5, 4))
        assert np.abs(extra - turned).max() < 3e-4 * np.abs(extra).max()
    own = [np.diag(extra[3, 3, 0, 0]) for extra in extras]
    for less, more in pairwise(own):
        assert np.all(more > less)
    assert np.all(own[0] > 0)
    # A crack only adds energy: the whole table is positive semi-definite.
    table = np.transpose(extras[-1], (0, 2, 4, 1, 3, 5))
    size = int(np.sqrt(table.size))
    least, most = np.linalg.eigvalsh(0.5 * (table.reshape(size, size) + table.reshape(size, size).T))[[0, -1]]
    assert least > -1e-4 * most


@pytest.mark.validation
def test_mesh_halved(teeth: dict[float, CondensedGear], gear: Any) -> None:
    fine = condense(cracked(gear(), 0.9e-3), STEEL, 0.25e-3, 0)
    coarse = teeth[0.3]
    at = len(coarse.s) // 2
    value = [g.crack.extra[3, 3, 0, 0] for g in (coarse, fine)]  # type: ignore[union-attr]
    np.testing.assert_array_equal(coarse.s, fine.s)
    assert value[0][at, at] == pytest.approx(value[1][at, at], rel=5e-3)


def test_the_cracked_tooth_gives_way_while_it_meshes(small: CondensedGear, twins: Any, gear: Any) -> None:
    """Where its pair carries alone the error grows by force times what the crack adds at the contact; which
    tooth that is follows from the numbering of each gear; a few pitches away nothing changes."""
    soft = stored_gear(cracked(gear(), 1.8e-3), STEEL, 0.5e-3, 0)
    assert soft.crack is not None
    phases, torque = np.array([3.0, 3.05, 8.0]), 150.0
    sound = static_cycle(twins.law, phases, torque=[torque]).transmission_error[0]
    rho = twins.pair.rho_pitch[0] + phases[:2] * twins.pair.base_pitch - 3 * twins.pair.base_pitch
    for gears, roll in (((soft, small), rho), ((small, soft), twins.pair.line_of_action - rho)):
        # The curves of a lone pair of teeth are those of sound teeth: the crack's part stands beside them.
        law = make_law(twins.pair, *gears, STEEL, curves=(twins.law.curves.driver, twins.law.curves.driven))
        more = static_cycle(law, phases, torque=[torque]).transmission_error[0] - sound
        s = roll**2 / (2 * twins.pair.driver.base_radius)
        own = np.interp(s, soft.s, np.diag(soft.crack.extra[3, 3, 0, 0])) / soft.face_width
        force = torque / twins.pair.driver.base_radius
        np.testing.assert_allclose(more[:2], force * own, rtol=0.02)
        assert abs(more[2]) < 1e-3 * more[0]

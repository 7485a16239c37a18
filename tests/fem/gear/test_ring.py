"""The ring of sectors against the same gear as one mesh, solved directly."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from gearbench.fem.gear.body import _rigid_shapes
from gearbench.fem.gear.elasticity import assemble, plane_moduli
from gearbench.fem.gear.ring import make_ring, ring_modes, ring_response, symmetric_lu
from gearbench.geometry.mesh.sector_mesh import sector_mesh
from gearbench.geometry.tooth.fillet import rotation
from gearbench.geometry.tooth.profile import profile
from gearbench.rig import Material

DENSITY, THICKNESS = Material().density * 0.02, 0.02


def world(teeth: int, k: int, field: np.ndarray) -> np.ndarray:
    """A sector's field (2 n, ...) turned into the frame of tooth 0."""
    turned = np.einsum("ij,nj...->ni...", rotation(2 * np.pi * k / teeth), field.reshape(-1, 2, *field.shape[1:]))
    return turned.reshape(field.shape)


def dofs(nodes: np.ndarray) -> np.ndarray:
    return (2 * np.asarray(nodes)[:, None] + np.arange(2)).ravel()


def gathered(coarse: Any, fields: Any) -> np.ndarray:
    """Sum of sector forces (teeth, 2 n, loads) on the full mesh."""
    full = coarse.full
    out = np.zeros((2 * len(full.points), fields[0].shape[1]))
    for k in range(full.teeth):
        np.add.at(out, dofs(full.node_of[k]), world(full.teeth, k, fields[k]))
    return out


def spread(coarse: Any, u: np.ndarray, k: int) -> np.ndarray:
    """Full-mesh displacement on sector k, in its own frame."""
    return world(coarse.full.teeth, -k, u[dofs(coarse.full.node_of[k])])


def test_response_equals_the_direct_solution_of_the_full_mesh(coarse: Any, rigid_motions: Any) -> None:
    """Forces on four teeth, cut nodes included, and a moving hub."""
    rng = np.random.default_rng(3)
    full, sector, teeth = coarse.full, coarse.sector, coarse.full.teeth
    size = 2 * len(sector.points)
    forces = np.zeros((teeth, size, 3))
    edge = dofs(np.unique(np.concatenate([sector.boundary_edges.ravel(), sector.cut_low, sector.cut_high])))
    for k in (0, 1, 7, 19):
        forces[k, edge] = rng.standard_normal((len(edge), 3)) * 1e3
    forces[:, dofs(sector.hub)] = 0.0
    motion = 1e-8 * rng.standard_normal((3, 3))
    hub_full = rigid_motions(full.points[full.hub]) @ motion
    everywhere = np.zeros((2 * len(full.points), 3))
    everywhere[dofs(full.hub)] = hub_full
    hub = np.array([spread(coarse, everywhere, k)[dofs(sector.hub)] for k in range(teeth)])

    wanted = np.array([0, 5, 18])
    found = ring_response(coarse.ring, lambda j: forces[j], lambda j: hub[j], wanted)

    held = dofs(full.hub)
    free = np.setdiff1d(np.arange(2 * len(full.points)), held)
    k = coarse.stiffness
    u = everywhere.copy()
    load = gathered(coarse, forces)[free] - k[free][:, held] @ hub_full
    u[free] = splu(k[free][:, free].tocsc()).solve(load)
    for n, j in enumerate(wanted):
        exact = spread(coarse, u, int(j))
        assert np.abs(found[n] - exact).max() < 1e-9 * np.abs(u).max()


def test_the_hub_takes_the_applied_force_and_moment(coarse: Any) -> None:
    """Reactions of all sectors, summed on the gear, against the resultant of the nodal forces on one tooth."""
    ring, sector, teeth = coarse.ring, coarse.sector, coarse.full.teeth
    rng = np.random.default_rng(0)
    f = np.zeros((2 * len(sector.points), 1))
    flank = dofs(np.unique(sector.boundary_edges)[5:15])
    f[flank, 0] = rng.standard_normal(len(flank))
    zero = np.zeros_like(f)
    hub = np.zeros((len(ring.hub), 1))
    u = ring_response(ring, lambda j: f if j == 0 else zero, lambda j: hub, np.arange(teeth))
    rigid = _rigid_shapes(sector.points, teeth)
    reaction = np.zeros(3)
    for k in range(teeth):
        sector_reaction = (ring.stiffness[ring.hub] @ u[k])[:, 0]
        reaction += rigid[:, k][:, ring.hub] @ sector_reaction
    applied = rigid[:, 0] @ f[:, 0]
    # K u - f vanishes but at the hub, so the hub's reaction and the applied forces cancel for any rigid motion.
    np.testing.assert_allclose(reaction, -applied, rtol=1e-9, atol=1e-9 * np.abs(applied).max())


@pytest.fixture(scope="module")
def modes(coarse: Any) -> Any:
    """Eight modes and the ninth that belongs to the last, with their shapes on the full mesh."""
    found = ring_modes(coarse.ring, DENSITY, THICKNESS, 8)
    assert len(found) == 9
    full = coarse.full
    shapes = np.zeros((len(found), 2 * len(full.points)))
    for m, mode in enumerate(found):
        for k in range(full.teeth):
            shapes[m, dofs(full.node_of[k])] = world(full.teeth, k, mode.shape[k])
    free = np.setdiff1d(np.arange(shapes.shape[1]), dofs(full.hub))
    return found, shapes, free, csr_matrix(coarse.mass[free][:, free] * DENSITY)


def test_modes_are_those_of_the_full_mesh_matrices(coarse: Any, modes: Any) -> None:
    """Orthonormal in its mass, and each balances its stiffness at its frequency."""
    found, shapes, free, mass = modes
    gram = shapes[:, free] @ mass @ shapes[:, free].T
    np.testing.assert_allclose(gram, np.eye(len(found)), atol=1e-8)
    stiffness = coarse.stiffness[free][:, free] * THICKNESS
    for mode, shape in zip(found, shapes[:, free], strict=True):
        elastic = stiffness @ shape
        assert np.abs(elastic - mode.omega**2 * (mass @ shape)).max() < 1e-6 * np.abs(elastic).max()


@pytest.mark.validation
def test_modes_are_the_lowest_of_the_full_mesh(coarse: Any, modes: Any) -> None:
    """None is missing: against eigsh's own, whose space they share."""
    found, shapes, free, mass = modes
    k = coarse.stiffness[free][:, free] * THICKNESS
    inverse = LinearOperator(k.shape, symmetric_lu(k.tocsc()), dtype=float)
    squares, vectors = eigsh(k, k=len(found), M=mass, sigma=0.0, OPinv=inverse)
    np.testing.assert_allclose([m.omega for m in found], np.sqrt(squares), rtol=1e-8)
    inside = shapes[:, free] @ mass @ vectors
    # Degenerate shapes may turn in their plane: the projection on the whole space keeps their length.
    np.testing.assert_allclose(np.sum(inside**2, axis=1), 1.0, atol=1e-6)


def test_degenerate_pairs_come_whole(modes: Any) -> None:
    found, shapes, free, mass = modes
    for diameters in {m.diameters for m in found} - {0, 10}:
        own = [n for n, m in enumerate(found) if m.diameters == diameters]
        assert len(own) % 2 == 0
        for a, b in zip(own[::2], own[1::2], strict=True):
            assert found[a].omega == pytest.approx(found[b].omega, rel=1e-9)
            assert abs(shapes[a, free] @ mass @ shapes[b, free]) < 1e-9


def test_hub_coupling_is_the_integral_over_the_full_mesh(coarse: Any, modes: Any, rigid_motions: Any) -> None:
    found, shapes, _, _ = modes
    rigid = _rigid_shapes(coarse.sector.points, coarse.full.teeth)
    sector = [[DENSITY * np.sum(r * (coarse.ring.mass @ m.shape.T).T) for r in rigid] for m in found]
    exact = DENSITY * shapes @ (coarse.mass @ rigid_motions(coarse.full.points))
    np.testing.assert_allclose(sector, exact, atol=1e-10 * np.abs(exact).max())
    # Only modes without and with one nodal diameter turn or shake the hub.
    for n, m in enumerate(found):
        still = np.abs(exact[n])
        scale = np.abs(exact).max(axis=0)
        if m.diameters != 0:
            assert still[2] < 1e-6 * scale[2]
        if m.diameters != 1:
            assert np.all(still[:2] < 1e-6 * scale[:2])


def test_the_body_twists_like_an_annulus(gear: Any) -> None:
    """Equal tangential loads on all teeth: u = T r/(4 pi G b) (1/r_i^2 - 1/r^2) below the rim (docs/physics.md,
    "Statics").

    The teeth disturb that by (r/rim)^z: 1e-4 of it is left at two thirds of the rim.
    """
    wheel = gear(20, hub_radius=8e-3)
    shape, moduli = profile(wheel), plane_moduli(Material())
    sector = sector_mesh(shape, wheel, wheel.module / 2.2)
    ring = make_ring(sector, *assemble(sector, moduli))
    node = int(sector.boundary_edges[len(sector.boundary_edges) // 2, 2])
    force = np.zeros((2 * len(sector.points), 1))
    force[2 * node + 1] = 1.0
    torque = wheel.teeth * sector.points[node, 0]
    held = np.zeros((len(ring.hub), 1))
    u = ring_response(ring, lambda j: force, lambda j: held, np.array([0]))[0, :, 0].reshape(-1, 2)
    radius = np.hypot(*sector.points.T)
    tangential = (sector.points[:, 0] * u[:, 1] - sector.points[:, 1] * u[:, 0]) / radius
    twist = torque / (4 * np.pi * moduli.lame[1]) * (1 / wheel.hub_radius**2 - 1 / radius**2) * radius
    inner = radius < 0.65 * shape.root_radius
    assert inner.sum() > 50
    assert np.abs(tangential - twist)[inner].max() < 1e-3 * twist[inner].max()


def test_no_modes_are_asked_for(coarse: Any) -> None:
    assert ring_modes(coarse.ring, DENSITY, THICKNESS, 0) == []


def test_the_factorisation_can_be_injected(coarse: Any) -> None:
    calls: list[int] = []

    def factorise(matrix: Any) -> Any:
        calls.append(matrix.shape[0])
        return splu(matrix.tocsc()).solve

    ring = make_ring(coarse.sector, coarse.ring.stiffness, coarse.ring.mass, factorise)
    assert len(calls) == 1
    np.testing.assert_allclose(ring.cut_stiffness, coarse.ring.cut_stiffness, rtol=1e-8, atol=1.0)

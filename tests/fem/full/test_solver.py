"""Solutions sector by sector against the whole gear's mesh; patches; modes of the gear on its hub and free."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import bmat, csr_matrix
from scipy.sparse.linalg import eigsh, splu

from gearbench.fem.full.columns import symmetric_sweeps
from gearbench.fem.full.gear import FullGear, effective, make_gear
from gearbench.fem.full.outline import spline_weights
from gearbench.fem.full.sector_solver import flexibility
from gearbench.fem.gear.elasticity import assemble, plane_moduli
from gearbench.fem.gear.ring import unknowns
from gearbench.geometry.mesh.assembly import full_mesh
from gearbench.geometry.tooth.fillet import rotation
from gearbench.rig import Gear, Material

Array = NDArray[np.float64]
STEEL = Material()


@pytest.fixture(scope="module")
def own(gear: Any) -> tuple[Gear, FullGear]:
    made = gear(12, profile_shift=0.3)
    return made, make_gear(made, STEEL, made.module / 2)


@pytest.fixture(scope="module")
def whole(own: tuple[Gear, FullGear]) -> tuple[csr_matrix, csr_matrix, csr_matrix, Array]:
    """Stiffness and mass of the whole gear's mesh, and the matrix that takes its displacements to those of a field
    (unknowns of sector 0, of sector 1, ...), and its nodes."""
    made, full = own
    mesh = full_mesh(full.sector)
    stiffness, mass = assemble(mesh, plane_moduli(STEEL))
    parts = []
    for j in range(full.teeth):
        turn = csr_matrix(np.kron(np.eye(len(mesh.node_of[j])), rotation(-2 * pi * j / full.teeth)))
        pick = csr_matrix(np.eye(2 * len(mesh.points))[unknowns(mesh.node_of[j])])
        parts.append(turn @ pick)
    to_field = csr_matrix(np.vstack([p.toarray() for p in parts]))
    width, density = made.face_width, STEEL.density
    return stiffness * width, mass * (width * density), to_field, mesh.points


@pytest.mark.validation
def test_sectors_give_the_solution_of_the_whole_mesh(own: Any, whole: Any) -> None:
    """Random forces on every unknown of every sector; scipy's factors of the gear in one piece are the truth."""
    _, full = own
    stiffness, mass, to_field, points = whole
    solver = effective(full, 0.8, 3e-11).solver
    forces = np.random.default_rng(1).standard_normal((full.mass.shape[0], full.teeth))
    forces[solver.ring.hub] = 0.0
    matrix = 0.8 * mass + 3e-11 * stiffness
    held = np.hypot(*points.T) < 1.0001 * np.hypot(*points.T).min()
    free = np.flatnonzero(~np.repeat(held, 2))
    load = to_field.T @ forces.T.ravel()
    moved = np.zeros(len(load))
    moved[free] = splu(matrix[free][:, free].tocsc()).solve(load[free])
    truth = (to_field @ moved).reshape(full.teeth, -1).T
    assert np.abs(solver.solve(forces) - truth).max() < 1e-9 * np.abs(truth).max()
    near = solver.solve_near(forces, np.array([3, 11]))
    assert np.abs(near - truth[:, [3, 11]]).max() < 1e-9 * np.abs(truth).max()


def test_flexibility_is_what_unit_forces_do(own: Any) -> None:
    _, full = own
    table = flexibility(full.static, full.loaded, 2)
    forces = np.zeros((full.mass.shape[0], full.teeth))
    forces[full.loaded[7], 0] = 1.0
    moved = full.static.solve(forces)[full.loaded]
    for m in range(-2, 3):
        assert np.allclose(table[m + 2, 7], moved[:, m % full.teeth], rtol=0, atol=1e-9 * np.abs(moved).max())


def test_sweeps_are_superlu_s_solution() -> None:
    rng = np.random.default_rng(2)
    rough = csr_matrix(rng.standard_normal((60, 60)) * (rng.random((60, 60)) < 0.1))
    matrix = (rough @ rough.T + csr_matrix(np.eye(60))).tocsc()
    for forces in (rng.standard_normal(60), rng.standard_normal((60, 7))):
        assert np.allclose(matrix @ symmetric_sweeps(matrix)(forces), forces, rtol=0, atol=1e-11)


@pytest.mark.parametrize("side", [0, 1])
def test_a_patch_has_resultant_and_moment_of_its_force(own: Any, side: int) -> None:
    _, full = own
    line, shape = full.outline, full.outline.shape
    at = full.sector.points[line.nodes]
    for s in np.linspace(shape.s_form, shape.s_end, 9):
        force = line.patch(float(s), side).reshape(-1, 2)
        point = shape.points(np.array([s]))[0] * (1.0, -1.0 if side else 1.0)
        into = line.inward(float(s), side)
        assert np.allclose(force.sum(axis=0), into, rtol=0, atol=1e-12)
        moment = float(at[:, 0] @ force[:, 1] - at[:, 1] @ force[:, 0])
        # The flank is curved over the patch: its centroid lies below the flank.
        assert moment == pytest.approx(point[0] * into[1] - point[1] * into[0], abs=2e-4 * shape.base_radius)


def test_patches_move_smoothly(own: Any) -> None:
    """Second differences of the weights are bounded by the square of the step: no jump of value or slope."""
    _, full = own
    centres, shape = full.outline.centres, full.outline.shape
    rough = []
    for n in (400, 800):
        s = np.linspace(shape.s_form, shape.s_end, n)
        weights = np.array([spline_weights(centres, float(x)) for x in s])
        assert np.allclose(weights @ centres, s, rtol=0, atol=1e-12)
        rough.append(np.abs(np.diff(weights, 2, axis=0)).max())
    assert rough[0] / rough[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.validation
def test_modes_of_the_gear_free_of_supports(own: Any, whole: Any) -> None:
    """Natural frequencies of hub and gear together, by inverse iteration with our own solver and Schur complement,
    against scipy's of the whole mesh whose hub nodes follow a rigid body."""
    _, full = own
    stiffness, mass, _, points = whole
    radius = np.hypot(*points.T)
    hub = np.flatnonzero(radius < 1.0001 * radius.min())
    free = np.setdiff1d(np.arange(len(points)), hub)
    rigid = np.zeros((2 * len(points), 3))
    rigid[0::2, 0] = rigid[1::2, 1] = 1.0
    rigid[0::2, 2], rigid[1::2, 2] = -points[:, 1], points[:, 0]
    tie = bmat([[csr_matrix(np.eye(2 * len(points))[:, unknowns(free)]), csr_matrix(rigid * _rows(points, hub))]])
    k, m = (tie.T @ stiffness @ tie).tocsc(), (tie.T @ mass @ tie).tocsc()
    shift = -1e8
    truth = np.sqrt(np.sort(eigsh(k, 9, m, sigma=shift, return_eigenvectors=False))[3:])

    solved = effective(full, -shift, 1.0)
    whole_hub = np.array([np.diag(rigid.T @ mass @ rigid)[i] for i in range(3)])
    schur = np.linalg.inv(np.diag(-shift * whole_hub) - shift**2 * solved.product)

    def inverse(x: Array) -> Array:
        field = x[3:].reshape(full.mass.shape[0], full.teeth)
        head = schur @ (x[:3] + shift * np.tensordot(solved.answer, field, ((0, 1), (0, 1))))
        return np.concatenate([head, solved.solver.solve(field + shift * full.rigid @ head).ravel()])

    def times_mass(x: Array) -> Array:
        field = x[3:].reshape(full.mass.shape[0], full.teeth)
        head = whole_hub * x[:3] + np.tensordot(full.rigid, field, ((0, 1), (0, 1)))
        return np.concatenate([head, (full.mass @ field + full.rigid @ x[:3]).ravel()])

    size = 3 + full.mass.shape[0] * full.teeth
    rng, basis = np.random.default_rng(3), []
    block = rng.standard_normal((size, 14))
    block[3:] = np.column_stack([inverse(b)[3:] for b in block.T])
    for _ in range(25):
        basis = np.column_stack([inverse(times_mass(b)) for b in block.T])
        block, _ = np.linalg.qr(basis)
    loaded = np.column_stack([times_mass(b) for b in block.T])
    flexible = block.T @ np.column_stack([times_mass(inverse(w)) for w in loaded.T])
    values = np.linalg.eigvals(np.linalg.solve(block.T @ loaded, flexible)).real
    ours = np.sort(1.0 / values + shift)[3:9]
    assert np.sqrt(ours) == pytest.approx(truth, rel=1e-5)


def _rows(points: Array, hub: Any) -> Array:
    out = np.zeros((2 * len(points), 1))
    out[unknowns(hub)] = 1.0
    return out

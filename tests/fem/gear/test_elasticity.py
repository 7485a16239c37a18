"""Assembly on the real curved sector and the full gear: patch test, rigid motions, mass, plane states."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from gearbench.fem.gear.elasticity import assemble, plane_moduli
from gearbench.geometry.mesh.values import Mesh
from gearbench.geometry.tooth.body import body
from gearbench.rig import Material


def test_a_linear_field_is_reproduced_on_curved_elements(coarse: Any) -> None:
    sector = coarse.sector
    gradient = np.array([[1e-3, -4e-4], [7e-4, 2e-3]])
    exact = (sector.points @ gradient.T + [1e-5, -2e-5]).ravel()
    k = coarse.ring.stiffness
    edge = np.unique(np.concatenate([sector.boundary_edges.ravel(), sector.hub, sector.cut_low, sector.cut_high]))
    held = (2 * edge[:, None] + np.arange(2)).ravel()
    free = np.setdiff1d(np.arange(k.shape[0]), held)
    u = exact.copy()
    u[free] = spsolve(k[free][:, free].tocsc(), -k[free][:, held] @ exact[held])
    assert np.abs(u - exact).max() < 1e-10 * np.abs(exact).max()


def test_the_energy_of_a_linear_field_is_hookes(coarse: Any) -> None:
    gradient = np.array([[1e-3, -4e-4], [7e-4, 2e-3]])
    strain = 0.5 * (gradient + gradient.T)
    material = Material()
    e, nu = material.youngs_modulus, material.poisson
    stress = e / (1 - nu**2) * ((1 - nu) * strain + nu * np.trace(strain) * np.eye(2))
    u = (coarse.full.points @ gradient.T).ravel()
    ones = np.tile([1.0, 0.0], len(coarse.full.points))
    area = ones @ coarse.mass @ ones
    assert u @ coarse.stiffness @ u == pytest.approx(np.sum(stress * strain) * area, rel=1e-10)


def test_rigid_motions_of_the_full_gear_carry_no_force(coarse: Any, rigid_motions: Any) -> None:
    motions = rigid_motions(coarse.full.points)
    forces = coarse.stiffness @ motions
    scale = abs(coarse.stiffness).max()
    assert np.abs(forces).max(axis=0) == pytest.approx([0, 0, 0], abs=1e-13 * scale)
    stretch = (coarse.full.points * [1.0, -1.0]).ravel()
    assert np.abs(coarse.stiffness @ stretch).max() > 1e-5 * scale * np.abs(stretch).max()


def test_mass_and_inertia_are_those_of_the_exact_profile(coarse: Any, rigid_motions: Any) -> None:
    material = Material()
    exact = body(coarse.shape, coarse.gear, material.density)
    motions = rigid_motions(coarse.full.points)
    found = material.density * coarse.gear.face_width * (motions.T @ coarse.mass @ motions)
    # The profile is interpolated between nodes 0.25 mm apart: 1e-5 of the area; the rest is rounding.
    assert found[0, 0] == pytest.approx(exact.mass_fe, rel=2e-5)
    assert found[1, 1] == pytest.approx(exact.mass_fe, rel=2e-5)
    assert found[2, 2] == pytest.approx(exact.inertia_fe, rel=5e-5)
    assert np.abs(found - np.diag(np.diag(found))).max() < 1e-9 * exact.mass_fe


@pytest.mark.parametrize("state", ["plane-stress", "plane-strain"])
def test_plane_moduli_follow_from_hookes_law_in_three_dimensions(state: Any) -> None:
    material = Material(state=state, youngs_modulus=70e9, poisson=0.34)
    e, nu = 70e9, 0.34
    compliance = (np.full((3, 3), -nu) + (1 + nu) * np.eye(3)) / e
    # In-plane compliance with sigma_z = 0, or in-plane stiffness with epsilon_z = 0.
    plane = compliance[:2, :2] if state == "plane-stress" else np.linalg.inv(np.linalg.inv(compliance)[:2, :2])
    moduli = plane_moduli(material)
    assert 1 / plane[0, 0] == pytest.approx(moduli.modulus, rel=1e-12)
    assert -plane[0, 1] / plane[0, 0] == pytest.approx(moduli.poisson, rel=1e-12)
    assert moduli.lame[1] == pytest.approx(e / (2 * (1 + nu)), rel=1e-12)


def test_a_node_outside_the_mesh_is_refused(coarse: Any) -> None:
    points = np.vstack([coarse.sector.points, [1.0, 1.0]])
    with pytest.raises(ValueError, match="belongs to no element"):
        assemble(Mesh(points, coarse.sector.cells), coarse.moduli)


def test_mass_of_a_quadratic_triangle_is_exact() -> None:
    """Of a straight element of area A: A/30 on corners, 8 A/45 in the middle of sides (Zienkiewicz, table of P2)."""
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [0.5, 1.0]])
    points = np.vstack([corners, 0.5 * (corners + np.roll(corners, -1, axis=0))])
    _, mass = assemble(Mesh(points, np.arange(6)[None]), plane_moduli(Material()))
    np.testing.assert_allclose(mass.diagonal()[::2], [1 / 30] * 3 + [8 / 45] * 3, rtol=1e-12)

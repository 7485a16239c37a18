"""Gears of quadrilaterals: the same gears as those of triangles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from gearbench.fem.contact.law import elastic_pair, make_law
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.gear.body import condense
from gearbench.fem.gear.elasticity import PlaneModuli, assemble
from gearbench.fem.gear.store import stored_gear
from gearbench.geometry import GeometryError
from gearbench.geometry.mesh.quads import quad_sector_mesh
from gearbench.geometry.mesh.sector import Element
from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.body import sector_area
from gearbench.geometry.tooth.profile import profile
from gearbench.rig import Crack, Gear, Material, Rig

STEEL = Material()
PLANE = PlaneModuli(2.0e11, 0.3)
PHASES = np.linspace(0.0, 1.0, 12, endpoint=False)


@pytest.fixture(scope="module")
def sector(gear: Any) -> SectorMesh:
    return quad_sector_mesh(profile(gear()), gear(), 0.75e-3)


@pytest.fixture(scope="module")
def matrices(sector: SectorMesh) -> tuple[csr_matrix, csr_matrix]:
    return assemble(sector, PLANE)


def test_patch(sector: SectorMesh, matrices: tuple[csr_matrix, csr_matrix], gear: Any) -> None:
    """A linear displacement leaves all nodes inside free of force; its energy and the mass are those of the area."""
    stiffness, mass = matrices
    area = sector_area(profile(gear()), gear().hub_radius)
    gradient = np.array([[3e-4, -1e-4], [5e-4, 2e-4]])
    u = (sector.points @ gradient.T).ravel()
    force = stiffness @ u
    outer = np.concatenate([sector.boundary_edges.ravel(), sector.hub, sector.cut_low, sector.cut_high])
    inside = np.setdiff1d(np.arange(len(sector.points)), outer)
    assert np.abs(force.reshape(-1, 2)[inside]).max() < 1e-11 * np.abs(force).max()
    strain = 0.5 * (gradient + gradient.T)
    modulus, poisson = PLANE.modulus, PLANE.poisson
    stress = modulus / (1 + poisson) * (strain + poisson / (1 - poisson) * np.trace(strain) * np.eye(2))
    assert u @ force == pytest.approx(area * np.sum(stress * strain), rel=1e-6)
    one = np.tile([1.0, 0.0], len(sector.points))
    assert one @ (mass @ one) == pytest.approx(area, rel=1e-6)


def test_rigid_motions_take_no_force(sector: SectorMesh, matrices: tuple[csr_matrix, csr_matrix]) -> None:
    spin = np.column_stack([-sector.points[:, 1], sector.points[:, 0]]).ravel()
    for motion in (np.tile([1.0, 0.0], len(sector.points)), np.tile([0.0, 1.0], len(sector.points)), spin):
        assert np.abs(matrices[0] @ motion).max() < 1e-9 * PLANE.modulus * np.abs(motion).max()


def torque(rig: Rig, size: float, element: Element) -> np.ndarray:
    """Driver torque [N m] at 15 um over the cycle, elements of `size` modules."""
    driver, driven = rig.driver, rig.driven
    one = condense(driver, rig.material, size * driver.module, 0, element)
    two = one if driven == driver else condense(driven, rig.material, size * driven.module, 0, element)
    law = make_law(elastic_pair(rig), one, two, rig.material)
    return static_cycle(law, PHASES, dte=[15e-6]).torque_driver[0]


@pytest.mark.validation
def test_torque_is_that_of_triangles(gear: Any, rig: Any) -> None:
    """Over the whole cycle to 0.1 % on gears that differ in teeth, shift and hub; rows_static halves the mesh."""
    driver = gear(19, profile_shift=0.2, hub_radius=13e-3)
    case = rig(driver, gear(33, profile_shift=-0.1), material=Material(state="plane-strain"))
    found = torque(case, 1 / 6, "quadrilateral")
    np.testing.assert_allclose(found, torque(case, 1 / 6, "triangle"), rtol=1e-3)


@pytest.mark.validation
def test_modes_are_those_of_triangles(gear: Any) -> None:
    quads = condense(gear(), STEEL, 0.5e-3, 8, "quadrilateral")
    triangles = condense(gear(), STEEL, 0.5e-3, 8)
    np.testing.assert_allclose(quads.omega, triangles.omega, rtol=3e-4)
    assert quads.unknowns > triangles.unknowns


def test_stored_gears_of_both_kinds_are_kept_apart(gear: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path))
    first, second = (stored_gear(gear(), STEEL, 1e-3, 0, kind) for kind in ("triangle", "quadrilateral"))
    assert second.unknowns > first.unknowns


def test_a_crack_among_quadrilaterals_is_refused(gear: Any) -> None:
    cracked: Gear = gear().model_copy(update={"crack": Crack(tooth=3, length=1e-3, direction=1.0)})
    with pytest.raises(GeometryError, match=r'gear\.crack cannot be meshed with element = "quadrilateral"'):
        condense(cracked, STEEL, 0.5e-3, 0, "quadrilateral")

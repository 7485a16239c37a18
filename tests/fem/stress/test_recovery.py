"""Stress recovery: patch tests, a thick ring, what the tensor's functions are worth."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.fem.gear.elasticity import PlaneModuli, assemble
from gearbench.fem.gear.ring import make_ring, ring_response
from gearbench.fem.stress.recovery import make_recovery, principal, ring_stress, turn_stress, von_mises
from gearbench.geometry.mesh.values import Mesh, SectorMesh

MODULI = PlaneModuli(2.0e11, 0.3)
INNER, OUTER, SECTORS = 0.02, 0.05, 12


def ring_sector(radial: int, around: int) -> SectorMesh:
    """A sector of a plain ring, every node on its circle; its boundary is the rim."""
    r = np.linspace(INNER, OUTER, 2 * radial + 1)
    phi = np.linspace(-pi / SECTORS, pi / SECTORS, 2 * around + 1)
    node = np.arange(len(r) * len(phi)).reshape(len(r), len(phi))
    points = np.stack(np.broadcast_arrays(r[:, None] * np.cos(phi), r[:, None] * np.sin(phi)), axis=-1).reshape(-1, 2)
    cells = []
    for i in range(0, 2 * radial, 2):
        for j in range(0, 2 * around, 2):
            n = node[i : i + 3, j : j + 3]
            cells.append([n[0, 0], n[2, 0], n[2, 2], n[1, 0], n[2, 1], n[1, 1]])
            cells.append([n[0, 0], n[2, 2], n[0, 2], n[1, 1], n[1, 2], n[0, 1]])
    rim = np.column_stack([node[-1, :-2:2], node[-1, 2::2], node[-1, 1::2]])
    return SectorMesh(points, np.array(cells), SECTORS, node[:, 0], node[:, -1], node[0], rim)


@pytest.fixture(scope="module")
def sector() -> SectorMesh:
    return ring_sector(16, 4)


def test_constant_strain_is_recovered_exactly_on_curved_elements(sector: SectorMesh) -> None:
    gradient = np.array([[1.0e-3, 2.0e-4], [-5.0e-4, 7.0e-4]])
    exx, eyy, gxy = 1.0e-3, 7.0e-4, -3.0e-4
    e, nu = MODULI.modulus, MODULI.poisson
    wanted = [e / (1 - nu**2) * (exx + nu * eyy), e / (1 - nu**2) * (eyy + nu * exx), e / (2 * (1 + nu)) * gxy]
    found = make_recovery(sector, MODULI).nodal(sector.points @ gradient.T)
    np.testing.assert_allclose(found, np.tile(wanted, (len(found), 1)), rtol=1e-9, atol=1e-9 * max(wanted))


def test_linear_strain_is_recovered_exactly_on_straight_elements() -> None:
    """Pure bending: sigma_xx = M y, also at the boundary's nodes."""
    side = np.linspace(0.0, 1.0, 9)
    x, y = (a.ravel() for a in np.meshgrid(side, side, indexing="ij"))
    node = np.arange(81).reshape(9, 9)
    cells = []
    for i in range(0, 8, 2):
        for j in range(0, 8, 2):
            n = node[i : i + 3, j : j + 3]
            cells.append([n[0, 0], n[2, 0], n[2, 2], n[1, 0], n[2, 1], n[1, 1]])
            cells.append([n[0, 0], n[2, 2], n[0, 2], n[1, 1], n[1, 2], n[0, 1]])
    points = np.column_stack([x, y])
    e, nu = MODULI.modulus, MODULI.poisson
    u = np.column_stack([x * y, -0.5 * x**2 - 0.5 * nu * y**2]) / e * 1e6
    found = make_recovery(Mesh(points, np.array(cells)), MODULI).nodal(u)
    np.testing.assert_allclose(found, np.column_stack([1e6 * y, 0 * y, 0 * y]), atol=1e-3)


def lame(sector: SectorMesh, pressure: float) -> NDArray[np.float64]:
    """Nodal stress of the ring pulled outwards at its rim and held at its hub, by sectors; sector 3's."""
    force = np.zeros((2 * len(sector.points), 1))
    # Simpson's weights are the consistent ones of an arc that is divided evenly.
    arc = OUTER * 2 * pi / SECTORS / len(sector.boundary_edges)
    for nodes in sector.boundary_edges:
        for n, weight in zip(nodes, (1 / 6, 1 / 6, 4 / 6), strict=True):
            force[2 * n : 2 * n + 2, 0] += pressure * arc * weight * sector.points[n] / OUTER
    ring = make_ring(sector, *assemble(sector, MODULI))
    held = np.zeros((len(ring.hub), 1))
    wanted = np.array([2, 3, 4])
    u = ring_response(ring, lambda j: force, lambda j: held, wanted)[:, :, 0].reshape(3, -1, 2)
    recovery = make_recovery(sector, MODULI)
    return ring_stress(recovery, sector, dict(zip([2, 3, 4], u, strict=True)))[3]


def test_a_thick_ring_has_lames_stresses(sector: SectorMesh) -> None:
    """u = A (r - ri^2/r), so sigma_r = E/(1-nu^2) A ((1+nu) + (1-nu) ri^2/r^2), sigma_t with the other sign."""
    pressure, nu = 1e8, MODULI.poisson
    radius, angle = np.hypot(*sector.points.T), np.arctan2(sector.points[:, 1], sector.points[:, 0])
    ratio = (INNER / radius) ** 2
    scale = pressure / ((1 + nu) + (1 - nu) * (INNER / OUTER) ** 2)
    wanted = np.column_stack([scale * ((1 + nu) + (1 - nu) * ratio), scale * ((1 + nu) - (1 - nu) * ratio), 0 * ratio])
    stress = lame(sector, pressure)
    found = np.array([turn_stress(s, -a) for s, a in zip(stress, angle, strict=True)])
    error = np.abs(found - wanted).max() / pressure
    assert error < 4e-3  # of the pressure; the stress is up to 1.8 times that
    coarse = ring_sector(8, 2)
    # The pointwise error falls with the square of the element size or faster, on cuts and boundaries too.
    radius, angle = np.hypot(*coarse.points.T), np.arctan2(coarse.points[:, 1], coarse.points[:, 0])
    ratio = (INNER / radius) ** 2
    wanted = np.column_stack([scale * ((1 + nu) + (1 - nu) * ratio), scale * ((1 + nu) - (1 - nu) * ratio), 0 * ratio])
    found = np.array([turn_stress(s, -a) for s, a in zip(lame(coarse, pressure), angle, strict=True)])
    assert np.abs(found - wanted).max() / pressure > 3.2 * error


def test_invariants() -> None:
    stress = np.array([[3.0, -1.0, 2.0]])
    np.testing.assert_allclose(principal(stress)[0], [1 + 8**0.5, 1 - 8**0.5])
    np.testing.assert_allclose(principal(turn_stress(stress, 0.3)), principal(stress))
    # Simple tension, pure shear, and hydrostatic stress with its third component.
    assert von_mises(np.array([5.0, 0.0, 0.0])) == pytest.approx(5.0)
    assert von_mises(np.array([0.0, 0.0, 2.0])) == pytest.approx(2 * 3**0.5)
    assert von_mises(np.array([4.0, 4.0, 0.0]), 4.0) == pytest.approx(0.0)

"""Quadrilaterals and swept solids: on the profile, none folded, area and volume those of the exact gear."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from shared.gears import likely_gear

from gearbench.geometry import (
    GeometryError,
    Mesh,
    PairMesh,
    full_mesh,
    gear_area,
    profile,
    quality,
    sector_area,
    sector_mesh,
    write_mesh,
)
from gearbench.geometry.mesh.gears import gear_plane
from gearbench.geometry.mesh.quads import quad_sector_mesh
from gearbench.geometry.mesh.quality import quad_determinants
from gearbench.geometry.mesh.sweep import sweep, swept
from gearbench.rig import Gear

MakeGear = Callable[..., Gear]

CASES: dict[str, dict[str, Any]] = {
    "ross": {"teeth": 62, "hub_radius": 0.0175},
    "thin rim": {"teeth": 62, "hub_radius": 0.0592},
    "sharp tip and rack": {"teeth": 40, "tip_edge_radius": 0.0, "rack_tip_radius": 0.0},
    "small hub": {"teeth": 10, "profile_shift": 0.55, "hub_radius": 0.0005},
    "undercut": {"teeth": 8, "hub_radius": 0.003},
    "deeply undercut": {"teeth": 12, "profile_shift": -0.4, "rack_tip_radius": 0.0, "hub_radius": 0.006},
    "positive": {"teeth": 62, "profile_shift": 1.6},
    "nearly pointed": {"teeth": 20, "profile_shift": 0.5, "tip_diameter": 47.03e-3, "tip_edge_radius": 20e-6},
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("per_module", [6, 12])
def test_quadrilaterals_fill_the_sector(name: str, per_module: int) -> None:
    gear = Gear(**{"teeth": 20, "module": 2e-3, "face_width": 0.02, "hub_radius": 0.01, **CASES[name]})
    tooth = profile(gear)
    mesh = quad_sector_mesh(tooth, gear, gear.module / per_module)
    found = quality(mesh)
    assert found.area == pytest.approx(sector_area(tooth, gear.hub_radius), rel=1e-5)
    assert found.jacobian > 0.1
    assert np.degrees(found.angle) > 15 and np.degrees(found.widest) < 165
    assert found.nodes == len(mesh.points)
    angle = 2 * pi / gear.teeth
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    assert np.abs(mesh.points[mesh.cut_low] @ turn.T - mesh.points[mesh.cut_high]).max() < 1e-15
    assert np.abs(mesh.points[mesh.mirror] - mesh.points * [1.0, -1.0]).max() < 1e-15
    # On the profile: the nodes of every triangle mesh's boundary are; these lie on the same smooth pieces.
    nodes = np.unique(mesh.boundary_edges)
    x, y = mesh.points[nodes].T
    radius, polar = np.hypot(x, y), np.abs(np.arctan2(y, x))
    flank = (radius > tooth.form_radius) & (radius < tooth.end_radius - 1e-9)
    assert flank.sum() > 10
    assert np.abs(radius * (polar - tooth.half_angle(radius)))[flank].max() < 1e-12


def test_areas_of_known_quadrilaterals() -> None:
    corners = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]])
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
    points = np.concatenate((corners, middles, [[1.5, 1.0]]))
    square = quality(Mesh(points, np.arange(9)[None]))
    assert (square.area, square.jacobian) == (pytest.approx(6.0), pytest.approx(1.0))
    assert (square.angle, square.widest) == (pytest.approx(pi / 2), pytest.approx(pi / 2))
    # A middle pushed out by h adds the parabola's 2/3 of chord times h.
    points[4] += [0.0, -0.3]
    assert quality(Mesh(points, np.arange(9)[None])).area == pytest.approx(6.0 + 2 / 3 * 3 * 0.3)
    sampled = quad_determinants(points, np.arange(9)[None], np.linspace(0, 1, 41)).min()
    bound = quality(Mesh(points, np.arange(9)[None]))
    assert bound.jacobian * bound.area <= sampled + 1e-12
    points[8] = [4.0, 1.0]  # beyond the opposite side: folded
    assert quality(Mesh(points, np.arange(9)[None])).jacobian < 0


def solid_volumes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Volume of each solid by its own second-order map: the sections' area integrated along the axis by Simpson's rule
    from three sections, whose area is that of the polygon through corners and middles with parabolic sides."""
    k = 3 if cells.shape[1] == 15 else 4
    down = points[np.column_stack((cells[:, :k], cells[:, 2 * k : 3 * k]))]
    height = points[cells[:, k], 2] - points[cells[:, 0], 2]
    corner, middle = down[:, :k, :2], down[:, k:, :2]
    after = np.roll(corner, -1, axis=1)
    chord = after - corner
    bulge = middle - 0.5 * (corner + after)
    polygon = 0.5 * (corner[..., 0] * after[..., 1] - corner[..., 1] * after[..., 0]).sum(axis=1)
    parabolas = 2 / 3 * (bulge[..., 0] * chord[..., 1] - bulge[..., 1] * chord[..., 0]).sum(axis=1)
    return (polygon + parabolas) * height


@pytest.mark.validation
@pytest.mark.parametrize("element", ["triangle", "quadrilateral"])
def test_swept_gear_has_the_volume_of_its_profile(tmp_path: Path, gear: MakeGear, element: str) -> None:
    one = gear(teeth=12, profile_shift=0.3)
    tooth = profile(one)
    sector = (sector_mesh if element == "triangle" else quad_sector_mesh)(tooth, one, one.module / 4)
    plane = gear_plane(full_mesh(sector))
    solid = sweep(plane, (one.face_width, one.face_width), 3)
    volume = solid_volumes(solid.points, solid.cells)
    exact = one.face_width * (gear_area(tooth)[0] - pi * one.hub_radius**2)
    assert volume.min() > 0
    assert volume.sum() == pytest.approx(exact, rel=1e-5)
    assert np.ptp(solid.points[:, 2]) == pytest.approx(one.face_width, rel=1e-12)
    assert len(np.unique(solid.cells)) == len(solid.points)
    assert len(solid.cells) == 3 * len(plane.cells)
    # Middles of upright sides lie between their corners.
    k = 3 if element == "triangle" else 4
    ends = 0.5 * (solid.points[solid.cells[:, :k]] + solid.points[solid.cells[:, k : 2 * k]])
    assert np.allclose(solid.points[solid.cells[:, -k:]], ends, atol=1e-15)
    for suffix in (".vtu", ".msh"):
        read = meshio.read(write_mesh(tmp_path / f"gear{suffix}", solid))
        assert np.array_equal(read.cells_dict[solid.kind.name], solid.cells)
    text = write_mesh(tmp_path / "gear.inp", solid).read_text()
    assert f"TYPE={'C3D15' if element == 'triangle' else 'C3D20'}, ELSET=E_DRIVER" in text


def test_layers_out_of_range() -> None:
    with pytest.raises(GeometryError, match=r"^layers = 0 must lie between 1 and 200$"):
        swept(np.zeros((6, 2)), np.arange(6)[None], 0.01, 0)


def test_quadrilaterals_of_many_gears() -> None:
    from hypothesis import HealthCheck, assume, given, settings

    @settings(max_examples=12, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck))
    @given(likely_gear())
    def check(gear: Gear) -> None:
        try:
            tooth = profile(gear)
        except GeometryError:
            assume(False)
            raise
        mesh = quad_sector_mesh(tooth, gear)
        found = quality(mesh)
        assert found.jacobian > 0.0
        assert abs(found.area / sector_area(tooth, gear.hub_radius) - 1) < 2e-5

    check()


def test_quads_round_trip(tmp_path: Path, gear: MakeGear) -> None:
    one = gear(teeth=9, hub_radius=0.003)
    plane: PairMesh = gear_plane(full_mesh(quad_sector_mesh(profile(one), one, one.module / 3)))
    for suffix in (".vtu", ".msh"):
        read = meshio.read(write_mesh(tmp_path / f"gear{suffix}", plane))
        assert np.array_equal(read.cells_dict["quad9"], plane.cells)

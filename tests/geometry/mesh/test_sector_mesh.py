"""The sector mesh: on the profile, valid, graded, symmetric, repeatable; the full gear without seams."""

from __future__ import annotations

import builtins
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from math import pi
from typing import Any

import numpy as np
import pytest

from gearbench.geometry import (
    GeometryError,
    MeshingUnavailable,
    Profile,
    SectorMesh,
    full_mesh,
    profile,
    quality,
    sector_area,
    sector_mesh,
)
from gearbench.geometry.mesh.assembly import assembled
from gearbench.geometry.mesh.filling import gmsh_session
from gearbench.geometry.mesh.quality import areas, determinants
from gearbench.rig import Gear

MakeGear = Callable[..., Gear]

CASES: dict[str, dict[str, Any]] = {
    "ross": {"teeth": 62, "bore_radius": 0.0175, "hub_radius": 0.0175},
    "z16": {"teeth": 16, "module": 3.175e-3, "profile_shift": 0.1, "hub_radius": 0.012},
    "z150, small hub": {"teeth": 150, "module": 1e-3, "hub_radius": 0.01},
    "thin rim": {"teeth": 62, "hub_radius": 0.0592},
    "sharp tip and rack": {"teeth": 40, "tip_edge_radius": 0.0, "rack_tip_radius": 0.0},
    "z10": {"teeth": 10, "profile_shift": 0.55, "hub_radius": 0.0005},
    "z8 undercut": {"teeth": 8, "hub_radius": 0.003},
    "z12 deeply undercut": {"teeth": 12, "profile_shift": -0.4, "rack_tip_radius": 0.0, "hub_radius": 0.006},
    "positive": {"teeth": 62, "profile_shift": 1.6},
    "negative": {"teeth": 62, "profile_shift": -1.3, "thinning": 50e-6},
    "nearly pointed": {"teeth": 20, "profile_shift": 0.5, "tip_diameter": 47.03e-3, "tip_edge_radius": 20e-6},
}


@pytest.fixture(scope="module", params=CASES)
def meshed(request: pytest.FixtureRequest) -> tuple[Gear, Profile, SectorMesh]:
    data = {"teeth": 20, "module": 2e-3, "face_width": 0.02, "hub_radius": 0.01, **CASES[request.param]}
    gear = Gear(**data)
    tooth = profile(gear)
    return gear, tooth, sector_mesh(tooth, gear)


Meshed = tuple[Gear, Profile, SectorMesh]


def off_profile(tooth: Profile, point: Sequence[float]) -> float:
    """Distance of a point from the tooth's outline, along the circle or the ray through it."""
    x, y = point[0], abs(point[1])
    radius, angle = float(np.hypot(x, y)), float(np.arctan2(y, x))
    gaps = []
    if angle <= tooth.tip_half_angle + 1e-12:
        gaps.append(abs(radius - tooth.tip_radius))
    if angle >= pi / tooth.teeth - tooth.root_half_angle - 1e-12:
        gaps.append(abs(radius - tooth.root_radius))
    gaps.append(abs(float(np.hypot(*(np.array([x, y]) - tooth.edge_centre))) - tooth.edge_radius))
    if radius >= tooth.form_radius - 1e-12:
        gaps.append(radius * abs(angle - float(tooth.half_angle(max(radius, tooth.base_radius)))))
    else:
        low, high = 0.0, tooth.beta_form
        for _ in range(45):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if np.hypot(*tooth.fillet(middle)) < radius else (low, middle)
        found = tooth.fillet(low)
        gaps.append(radius * abs(angle - float(np.arctan2(found[1], found[0]))))
    return min(gaps)


def test_boundary_nodes_lie_on_the_profile(meshed: Meshed) -> None:
    gear, tooth, mesh = meshed
    nodes = np.unique(mesh.boundary_edges)
    assert max(off_profile(tooth, mesh.points[node]) for node in nodes) < 1e-12
    assert np.allclose(np.hypot(*mesh.points[mesh.hub].T), gear.hub_radius, rtol=0, atol=1e-15)


def test_boundary_edges_run_counter_clockwise_from_cut_to_cut(meshed: Meshed) -> None:
    _, tooth, mesh = meshed
    edges = mesh.boundary_edges
    assert np.array_equal(edges[1:, 0], edges[:-1, 1])
    assert edges[0, 0] == mesh.cut_low[-1] and edges[-1, 1] == mesh.cut_high[-1]
    # Green's theorem on the curved edges, closed by cuts (no contribution) and hub: positive, and the exact
    # area.
    x, w = np.polynomial.legendre.leggauss(4)
    t = 0.5 * (x + 1)
    shapes = np.stack((2 * (t - 1) * (t - 0.5), 2 * t * (t - 0.5), 4 * t * (1 - t)))
    slopes = np.stack((4 * t - 3, 4 * t - 1, 4 - 8 * t))
    nodes = mesh.points[edges]
    at, along = np.einsum("kn,ekx->enx", shapes, nodes), np.einsum("kn,ekx->enx", slopes, nodes)
    area = np.sum(0.25 * w * (at[..., 0] * along[..., 1] - at[..., 1] * along[..., 0]))
    assert area == pytest.approx(sector_area(tooth, 0.0), rel=1e-6)


def test_triangles_are_valid_and_fill_the_sector(meshed: Meshed) -> None:
    gear, tooth, mesh = meshed
    found = quality(mesh)
    assert found.area == pytest.approx(sector_area(tooth, gear.hub_radius), rel=2e-6)
    assert found.jacobian > 0.5
    assert np.degrees(found.angle) > 20
    assert 600 < found.elements < 2600
    # Sampled densely, the determinant stays above the bound that the quality states.
    steps = np.linspace(0, 1, 9)
    at = np.array([(a, b) for a in steps for b in steps if a + b <= 1 + 1e-12])
    sampled = determinants(mesh.points, mesh.cells, at).min(axis=1) / (
        2 * areas(mesh.points, mesh.cells)
    )
    assert sampled.min() >= found.jacobian - 1e-9
    assert found.nodes == len(mesh.points) == len(np.unique(mesh.cells))


def test_cuts_match_by_rotation_and_the_mesh_is_its_mirror_image(meshed: Meshed) -> None:
    _, tooth, mesh = meshed
    angle = 2 * pi / tooth.teeth
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    assert np.abs(mesh.points[mesh.cut_low] @ turn.T - mesh.points[mesh.cut_high]).max() < 1e-15
    radii = np.hypot(*mesh.points[mesh.cut_low].T)
    assert np.all(np.diff(radii) > 0)
    assert np.allclose(radii[1::2], 0.5 * (radii[:-1:2] + radii[2::2]), atol=1e-15)
    assert len(radii) >= 25
    edges = np.diff(radii[::2])
    assert edges[-1] <= edges[0] * 1.1  # graded towards the root
    assert mesh.hub[0] == mesh.cut_low[0] and mesh.hub[-1] == mesh.cut_high[0]
    assert np.abs(mesh.points[mesh.mirror] - mesh.points * [1.0, -1.0]).max() < 1e-15
    assert np.array_equal(mesh.mirror[mesh.cut_low], mesh.cut_high)
    flipped = np.sort(mesh.mirror[mesh.cells], axis=1)
    assert {tuple(row) for row in flipped} == {tuple(row) for row in np.sort(mesh.cells, axis=1)}


def test_sizes_are_graded(meshed: Meshed) -> None:
    gear, tooth, mesh = meshed
    nodes = mesh.points[mesh.boundary_edges]
    length = np.linalg.norm(nodes[:, 1] - nodes[:, 0], axis=1)
    radius = np.hypot(*nodes[:, 2].T)
    assert length[radius < tooth.tip_radius - 1e-9].max() < 1.3 * gear.module / 12
    if gear.tip_edge_radius > 0:
        normal = np.linalg.norm(np.abs(nodes[:, 2]) - tooth.edge_centre, axis=1) - tooth.edge_radius
        edge = (np.abs(normal) < 1e-12) & (radius > tooth.end_radius) & (radius < tooth.tip_radius - 1e-12)
        assert edge.sum() >= 6
        assert length[edge].max() < 0.32 * tooth.edge_radius
    else:
        assert length.min() < 5e-6
    ratio = length[1:] / length[:-1]
    assert np.maximum(ratio, 1 / ratio).max() < 1.9
    assert np.mean(np.maximum(ratio, 1 / ratio) < 1.35) > 0.9


def test_finer_elements_everywhere(gear: MakeGear) -> None:
    one = gear(teeth=30, hub_radius=0.012)
    coarse, fine = (sector_mesh(profile(one), one, one.module / n) for n in (12, 24))
    assert 1.7 < len(fine.cells) / len(coarse.cells) < 5
    error = [
        abs(quality(mesh).area / sector_area(profile(one), 0.012) - 1)
        for mesh in (coarse, fine)
    ]
    assert error[1] < error[0] / 8  # curved boundaries: fourth order, here with different node counts


def test_deterministic_also_in_threads(gear: MakeGear) -> None:
    one = gear(teeth=25)
    tooth = profile(one)
    first = sector_mesh(tooth, one)
    with ThreadPoolExecutor(3) as pool:
        others = list(pool.map(lambda _: sector_mesh(tooth, one), range(3)))
    for other in others:
        assert np.array_equal(first.points, other.points)
        assert np.array_equal(first.cells, other.cells)


def test_a_running_gmsh_session_is_left_alone(gear: MakeGear, capfd: pytest.CaptureFixture[str]) -> None:
    import gmsh

    one = gear()
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.Smoothing", 3)
        gmsh.model.add("mine")
        sector_mesh(profile(one), one)
        assert gmsh.isInitialized()
        assert gmsh.model.getCurrent() == "mine"
        assert gmsh.option.getNumber("Mesh.Smoothing") == 3
    finally:
        gmsh.finalize()
    sector_mesh(profile(one), one)
    assert not gmsh.isInitialized()
    assert capfd.readouterr() == ("", "")


def test_full_gear_has_no_seams(gear: MakeGear) -> None:
    one = gear(teeth=17, profile_shift=0.1)
    tooth = profile(one)
    sector = sector_mesh(tooth, one)
    whole = full_mesh(sector)
    assert len(whole.points) == 17 * (len(sector.points) - len(sector.cut_low))
    assert len(np.unique(whole.points.round(10), axis=0)) == len(whole.points)
    assert areas(whole.points, whole.cells).sum() == pytest.approx(
        17 * sector_area(tooth, one.hub_radius), rel=1e-6
    )
    # Every tooth is the first one, rotated; every inner edge has two triangles, the rest is profile and hub.
    for k in (1, 5, 16):
        angle = 2 * pi * k / 17
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        assert np.abs(whole.points[whole.node_of[k]] - sector.points @ turn.T).max() < 1e-15
    middles, count = np.unique(whole.cells[:, 3:], return_counts=True)
    free = set(middles[count == 1])
    assert count.max() == 2
    hub_middles = set(whole.hub) & free
    assert free == set(whole.boundary_edges[:, 2]) | hub_middles
    assert len(whole.boundary_edges) == 17 * len(sector.boundary_edges)
    with pytest.raises(GeometryError, match=r"teeth = 18 .* 17 teeth"):
        assembled([sector] * 18)


@pytest.mark.parametrize("size", [0.0, 4e-6, 1.1e-3])
def test_element_size_out_of_range(gear: MakeGear, size: float) -> None:
    one = gear()
    with pytest.raises(
        GeometryError, match=r"simulation\.element_size_um = \S+ must lie between 5 .* and 1000"
    ):
        sector_mesh(profile(one), one, size)


def test_missing_system_libraries_are_named(gear: MakeGear, monkeypatch: pytest.MonkeyPatch) -> None:
    original = builtins.__import__

    def refusing(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "gmsh":
            raise OSError("libGLU.so.1: cannot open shared object file")
        return original(name, *args, **kwargs)

    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.setattr(builtins, "__import__", refusing)
    one = gear()
    with pytest.raises(MeshingUnavailable, match=r"libGLU\.so\.1.*libgl1 libegl1 libglu1-mesa .* libgomp1$"):
        sector_mesh(profile(one), one)


def test_a_closed_pipe_stays_an_error_after_meshing() -> None:
    """gmsh lets the system kill whoever writes to a closed pipe: a study would go with the first of its processes."""
    with gmsh_session():
        pass
    reading, writing = os.pipe()
    os.close(reading)
    with pytest.raises(BrokenPipeError):
        os.write(writing, b"to nobody")
    os.close(writing)

"""Meshes as files: what was written is what is read, nothing half-written is left."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
import pytest

from gearbench.files import FileError
from gearbench.geometry import GeometryError, PairMesh, mesh_pair, pair, write_mesh
from gearbench.geometry.mesh.quality import areas
from gearbench.rig import Gear, Rig

MakeGear = Callable[..., Gear]
MakeRig = Callable[..., Rig]


@pytest.fixture(scope="module")
def tiny() -> PairMesh:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5], [1.0, 1.0]])
    points = np.concatenate((points, [[1.0, 0.5], [0.5, 1.0]])) * 1e-3
    triangles = np.array([[0, 1, 2, 3, 4, 5], [1, 6, 2, 7, 8, 4]])
    return PairMesh(points, triangles, np.array([0, 1]), np.array([0, 3]))


@pytest.mark.parametrize("suffix", [".msh", ".vtu"])
def test_round_trip(tmp_path: Path, tiny: PairMesh, suffix: str) -> None:
    path = write_mesh(tmp_path / f"gear{suffix}", tiny)
    assert [entry.name for entry in tmp_path.iterdir()] == [f"gear{suffix}"]
    read = meshio.read(path)
    assert np.allclose(read.points[:, :2], tiny.points, atol=1e-18)
    assert np.array_equal(read.cells_dict["triangle6"], tiny.cells)
    if suffix == ".msh":
        assert np.array_equal(read.cell_data["gmsh:physical"][0], tiny.gear + 1)
    else:
        assert np.array_equal(read.cell_data["gear"][0], tiny.gear)
        assert np.array_equal(read.cell_data["tooth"][0], tiny.tooth)


def test_gmsh_itself_reads_the_file(tmp_path: Path, tiny: PairMesh) -> None:
    import gmsh

    path = write_mesh(tmp_path / "gear.msh", tiny)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        assert len(gmsh.model.mesh.getElementsByType(9)[0]) == 2
        assert {tag for _, tag in gmsh.model.getPhysicalGroups(2)} == {1, 2}
    finally:
        gmsh.finalize()


def test_refusals_leave_nothing_behind(
    tmp_path: Path, tiny: PairMesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(GeometryError, match=r"^out = gear\.stl has no known .* \.msh, \.vtu, \.inp, \.dxf or \.step$"):
        write_mesh(tmp_path / "gear.stl", tiny)
    with pytest.raises(FileError, match=r"must exist$"):
        write_mesh(tmp_path / "missing" / "gear.vtu", tiny)

    def breaking(*_: object, **__: object) -> None:
        raise RuntimeError("disk full")

    (tmp_path / "gear.vtu").write_text("old")
    monkeypatch.setattr(meshio, "write", breaking)
    with pytest.raises(RuntimeError, match="disk full"):
        write_mesh(tmp_path / "gear.vtu", tiny)
    assert [entry.read_text() for entry in tmp_path.iterdir()] == ["old"]


def test_pair_is_placed_in_contact_without_overlap(gear: MakeGear, rig: MakeRig) -> None:
    bench = rig(gear(teeth=17, profile_shift=0.1), gear(teeth=23), centre_distance=40.3e-3)
    plane, meshing = mesh_pair(bench), pair(bench)
    assert set(plane.gear) == {0, 1}
    for number, teeth in ((0, 17), (1, 23)):
        assert set(plane.tooth[plane.gear == number]) == set(range(teeth))
        centroid = plane.points[plane.cells[plane.gear == number]].mean(axis=1)
        assert centroid.mean(axis=0) == pytest.approx([number * 40.3e-3, 0.0], abs=1e-6)
    assert (areas(plane.points, plane.cells) > 0).all()
    # The pitch point lies on both flanks: between it and the nearest boundary edge's chord is at most its
    # bulge.
    point = np.array([meshing.pitch_radii[0], 0.0])
    # The driver's material lies behind the common normal there, the driven gear's before it.
    normal = np.array([np.sin(meshing.working_pressure_angle), np.cos(meshing.working_pressure_angle)])
    for number, side in ((0, -1), (1, 1)):
        corners = plane.points[plane.cells[plane.gear == number]]
        closest, nearest = np.inf, 0
        for i, j in ((0, 1), (1, 2), (2, 0)):
            a, b = corners[:, i], corners[:, j]
            t = np.clip(np.einsum("ij,ij->i", point - a, b - a) / np.einsum("ij,ij->i", b - a, b - a), 0, 1)
            gap = np.linalg.norm(a + t[:, None] * (b - a) - point, axis=1)
            if gap.min() < closest:
                closest, nearest = gap.min(), int(gap.argmin())
        assert closest < 1e-6
        assert side * ((corners[nearest, :3].mean(axis=0) - point) @ normal) > 0

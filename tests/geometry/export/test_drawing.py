"""Drawings read back: the outline is the profile, and the solids have the gears' volume and place."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from pathlib import Path

import numpy as np
import pytest

from gearbench.files import FileError, write_whole
from gearbench.geometry import gear_area
from gearbench.geometry.export.drawing import _write, placed_gears, write_dxf, write_step
from gearbench.rig import Gear, Rig

MakeGear = Callable[..., Gear]
MakeRig = Callable[..., Rig]


@pytest.fixture
def bench(gear: MakeGear, rig: MakeRig) -> Rig:
    """An undercut pinion and a wheel with a bore and an odd number of thinned teeth."""
    return rig(
        gear(teeth=10, hub_radius=4e-3),
        gear(teeth=31, hub_radius=15e-3, bore_radius=8e-3, face_width=0.016, thinning=4e-5),
    )


def entities(path: Path) -> list[dict[int, str]]:
    """Entities of an R12 file: group code -> value."""
    lines = path.read_text(encoding="ascii").split("\n")
    found: list[dict[int, str]] = []
    for code, value in zip(lines[0::2], lines[1::2], strict=False):
        if int(code) == 0:
            found.append({0: value})
        else:
            found[-1][int(code)] = value
    return found


def test_dxf_holds_both_outlines_in_contact(tmp_path: Path, bench: Rig) -> None:
    gears = placed_gears(bench)
    read = entities(write_dxf(tmp_path / "pair.dxf", gears))
    assert [entity[0] for entity in read[:1]] == ["SECTION"] and read[-1][0] == "EOF"
    outlines = {}
    for gear in gears:
        own = [entity for entity in read if entity[0] == "VERTEX" and entity[8] == gear.name]
        x, y = np.array([[float(entity[10]), float(entity[20])] for entity in own]).T
        outlines[gear.name] = np.column_stack((x, y))
        area = 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
        # Chords keep to 0.2 um of a contour of some 5 m/m^2 of area: counter-clockwise, closed, exact.
        assert area == pytest.approx(1e6 * gear_area(gear.tooth)[0], rel=1e-4)
        radius = np.hypot(x - 1e3 * gear.centre, y)
        assert radius.max() == pytest.approx(1e3 * gear.tooth.tip_radius, abs=1e-6)
        assert radius.min() == pytest.approx(1e3 * gear.tooth.root_radius, abs=1e-6)
    pitch = [10.0, 0.0]
    for outline in outlines.values():
        a, b = outline, np.roll(outline, -1, axis=0)
        t = np.clip(np.sum((pitch - a) * (b - a), axis=1) / np.sum((b - a) ** 2, axis=1), 0, 1)
        assert np.hypot(*(a + t[:, None] * (b - a) - pitch).T).min() < 2.5e-4
    circles = {entity[8]: (float(entity[10]), float(entity[40])) for entity in read if entity[0] == "CIRCLE"}
    assert circles["DRIVEN_BORE"] == (41.0, 8.0) and circles["DRIVER_HUB"] == (0.0, 4.0)
    assert "DRIVER_BORE" not in circles


@pytest.mark.validation
def test_step_holds_both_solids(tmp_path: Path, bench: Rig, capfd: pytest.CaptureFixture[str]) -> None:
    import gmsh

    gears = placed_gears(bench)
    path = write_step(tmp_path / "pair.step", gears)
    assert capfd.readouterr() == ("", "")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.importShapes(str(path))
        gmsh.model.occ.synchronize()
        solids = gmsh.model.getEntities(3)
        assert len(solids) == 2
        for solid, gear in zip(solids, gears, strict=True):
            area = gear_area(gear.tooth)[0] - pi * gear.bore**2
            assert gmsh.model.occ.getMass(*solid) == pytest.approx(1e9 * area * gear.width, rel=1e-5)
            x, y, z = gmsh.model.occ.getCenterOfMass(*solid)
            assert (x, y, z) == pytest.approx((1e3 * gear.centre, 0.0, 0.0), abs=1e-4)
    finally:
        gmsh.finalize()


def test_a_missing_folder_is_named(tmp_path: Path, bench: Rig) -> None:
    with pytest.raises(FileError, match=r"must exist$"):
        write_dxf(tmp_path / "none" / "pair.dxf", placed_gears(bench))


def test_a_step_file_that_cannot_be_written_is_one_sentence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What gmsh raises when the disk is full, as measured with a limit on the size of files."""

    class Gmsh:
        def write(self, name: str) -> None:
            raise Exception(f"Could not create file '{name}'")

    with pytest.raises(FileError, match=r"/a\.step cannot be written: its contents could not be written"):
        write_whole(tmp_path / "a.step", lambda target: _write(Gmsh(), target))
    assert not list(tmp_path.iterdir())

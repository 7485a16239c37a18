"""The full gear's mesh with a slit in one tooth."""

from __future__ import annotations

from collections import Counter
from functools import cache
from math import pi, radians

import numpy as np
import pytest

from gearbench.geometry import GeometryError, Mesh, PairMesh, mesh_pair, pair
from gearbench.geometry.mesh.gears import mesh_gear
from gearbench.geometry.mesh.quality import areas, quality
from gearbench.geometry.mesh.sweep import sweep
from gearbench.geometry.tooth.crack import slit
from gearbench.rig import Crack, Gear, Rig, Support, Supports

GEAR = Gear(teeth=20, module=2e-3, face_width=0.02, hub_radius=9e-3)
CRACK = Crack(tooth=3, length=0.9e-3, direction=radians(60))
CRACKED = GEAR.model_copy(update={"crack": CRACK})


def rig(cracked: int | None) -> Rig:
    """Two equal gears, of which one may be cracked."""
    driver, driven = (CRACKED if cracked == number else GEAR for number in (0, 1))
    support = Support(stiffness=6e6)
    return Rig(driver=driver, driven=driven, support=Supports(driver=support, driven=support))


@cache
def meshed(cracked: int | None) -> PairMesh:
    return mesh_pair(rig(cracked), GEAR.module / 4)


def in_two_places(points: np.ndarray) -> np.ndarray:
    """Places (n, d) that hold more than one node."""
    places, count = np.unique(np.round(points, 11), axis=0, return_counts=True)
    return np.asarray(places[count > 1])


def sides(mesh: PairMesh, number: int) -> Counter[tuple[int, int]]:
    """How often the corner edges of a gear's triangles occur."""
    cells = mesh.cells[mesh.gear == number][:, :3]
    ends = np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]])
    return Counter(map(tuple, np.sort(ends, axis=1).tolist()))


@pytest.mark.parametrize("number", [0, 1])
def test_the_slit_is_open_in_the_tooth_that_meshes_third(number: int) -> None:
    """The driver turns counter-clockwise, the driven gear clockwise: three pitches on, the cracked tooth touches at the
    pitch point, its crack behind the flank that carries."""
    meshing, mesh = pair(rig(number)), meshed(number)
    cut = in_two_places(mesh.points)
    centre = np.array([number * meshing.centre_distance, 0.0])
    turn = (1, -1)[number] * 3 * 2 * pi / GEAR.teeth
    x, y = (cut - centre).T
    turned = np.column_stack((np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y))
    # Into the frame of the tooth at the pitch point, its axis on +x and the carrying flank at y > 0.
    angle = -(meshing.driver_angle if number == 0 else pi + meshing.driven_angle)
    x, y = turned.T
    own = np.column_stack((np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y))
    shape = (meshing.driver, meshing.driven)[number]
    there = slit(shape, CRACKED, CRACK)
    along = np.sort((own - there.start) @ there.direction)
    across = (own - there.start) @ np.array([-there.direction[1], there.direction[0]])
    assert np.abs(across).max() < 1e-10 and there.start[1] > 0
    assert along[0] == pytest.approx(0.0, abs=1e-10)
    assert 0.9 * CRACK.length < along[-1] < CRACK.length - 1e-6
    # What touches the slit is numbered as the case numbers it.
    pressed = {int(node) for place in cut for node in np.flatnonzero(np.hypot(*(mesh.points - place).T) < 1e-10)}
    beside = np.isin(mesh.cells, list(pressed)).any(axis=1)
    assert set(mesh.tooth[beside]) == {3} and set(mesh.gear[beside]) == {number}


def test_it_is_one_gear_whose_outline_runs_round_the_slit() -> None:
    cracked, sound = meshed(0), meshed(None)
    found = []
    for mesh in (cracked, sound):
        count = sides(mesh, 0)
        assert set(count.values()) == {1, 2}
        cells = mesh.cells[mesh.gear == 0]
        # Euler: a ring, whether a slit runs into it or not.
        assert len(np.unique(cells[:, :3])) - len(count) + len(cells) == 0
        ends = np.array([side for side, times in count.items() if times == 1])
        found.append(np.hypot(*(mesh.points[ends[:, 0]] - mesh.points[ends[:, 1]]).T).sum())
        assert quality(Mesh(mesh.points, cells)).jacobian > 0.3
    assert found[0] - found[1] == pytest.approx(2 * CRACK.length, rel=0.01)
    own, other = (areas(m.points, m.cells[m.gear == 0]).sum() for m in (cracked, sound))
    assert own == pytest.approx(other, rel=1e-6)
    assert len(in_two_places(sound.points)) == 0


def test_the_swept_gear_has_the_slit_over_its_whole_width() -> None:
    plane = meshed(0)
    solid = sweep(plane, (GEAR.face_width, GEAR.face_width), 2)
    flat = in_two_places(plane.points)
    corners = np.isin(np.round(plane.points[np.unique(plane.cells[:, :3])], 11), flat).all(axis=1).sum() / 2
    assert len(in_two_places(solid.points)) == 3 * len(flat) + 2 * corners


def test_quadrilaterals_are_refused() -> None:
    with pytest.raises(GeometryError, match=r'^rig\.driven\.crack cannot be meshed with element = "quadrilateral"'):
        mesh_gear(pair(rig(1)).driven, CRACKED, None, "quadrilateral", 1)

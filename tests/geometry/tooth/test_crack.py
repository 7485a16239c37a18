"""Where a crack lies, what is refused, and the mesh that it is cut into."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, degrees, pi, radians, sin
from typing import Any

import numpy as np
import pytest

from gearbench.geometry.error import GeometryError
from gearbench.geometry.mesh.cracked_sector import cracked_sector
from gearbench.geometry.mesh.quality import quality
from gearbench.geometry.mesh.sector_mesh import sector_mesh
from gearbench.geometry.tooth.crack import slit
from gearbench.geometry.tooth.profile import profile
from gearbench.rig import Crack, Gear


@pytest.fixture
def cracked(gear: Callable[..., Gear]) -> Callable[..., Gear]:
    def make(length: float = 0.8e-3, direction: float = 60.0, start: float = 30.0, **changes: Any) -> Gear:
        crack = Crack(tooth=3, length=length, direction=radians(direction), start=radians(start))
        return gear(crack=crack, **changes)

    return make


def refusal(gear: Gear) -> str:
    with pytest.raises(GeometryError) as caught:
        slit(profile(gear), gear, gear.crack, "rig.driver")  # type: ignore[arg-type]
    return str(caught.value)


@pytest.mark.parametrize("start", [25.0, 30.0, 60.0])
def test_it_starts_where_the_fillet_has_that_angle(cracked: Callable[..., Gear], start: float) -> None:
    """The tangent by finite differences of the outline, its angle against the tooth's axis (+x)."""
    gear = cracked(start=start)
    shape = profile(gear)
    cut = slit(shape, gear, gear.crack)  # type: ignore[arg-type]
    beta = np.linspace(0.0, shape.beta_form, 100_001)
    points = shape.fillet(beta)
    at = int(np.argmin(np.hypot(*(points - cut.start).T)))
    tangent = points[at + 1] - points[at - 1]
    assert degrees(atan2(-tangent[1], tangent[0])) == pytest.approx(start, abs=0.01)
    assert cut.start[1] > 0


def test_direction_runs_from_the_centre_line(cracked: Callable[..., Gear]) -> None:
    """0: parallel to the axis towards the hub; 90: across the tooth to its other side; 30: down and inwards."""
    for angle, wanted in ((0.0, (-1.0, 0.0)), (90.0, (0.0, -1.0)), (30.0, (-cos(pi / 6), -sin(pi / 6)))):
        gear = cracked(direction=angle)
        cut = slit(profile(gear), gear, gear.crack)  # type: ignore[arg-type]
        np.testing.assert_allclose(cut.direction, wanted, atol=1e-15)
        np.testing.assert_allclose(cut.tip - cut.start, 0.8e-3 * np.array(wanted), atol=1e-18)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"length": 19e-3, "direction": 10.0}, ["rig.driver.crack.length_mm = 19", "less than", "the hub circle"]),
        ({"length": 9e-3, "direction": 90.0}, ["length_mm = 9", "the other flank or fillet"]),
        ({"length": 9e-3, "direction": -10.0}, ["length_mm = 9", "the next tooth's sector"]),
        ({"length": 9e-3, "direction": 130.0}, ["length_mm = 9", "flank or fillet"]),
        ({"length": 1e-6}, ["length_mm = 0.001", "at least 0.01"]),
        ({"direction": 140.0}, ["rig.driver.crack.direction_deg = 140", "between -15 and 135"]),
        ({"start": 88.0}, ["rig.driver.crack.start_deg = 88", "must lie between"]),
    ],
)
def test_cracks_that_do_not_fit_are_refused(
    cracked: Callable[..., Gear], changes: dict[str, float], words: list[str]
) -> None:
    sentence = refusal(cracked(**changes))
    for word in words:
        assert word in sentence, sentence


@pytest.mark.parametrize(
    ("length", "direction", "start"), [(0.02e-3, 60.0, 30.0), (1.6e-3, 75.0, 30.0), (0.6e-3, 20.0, 70.0)]
)
def test_the_mesh_has_a_slit_and_the_neighbours_cuts(
    cracked: Callable[..., Gear], length: float, direction: float, start: float
) -> None:
    gear = cracked(length, direction, start)
    shape = profile(gear)
    mesh, sound = cracked_sector(shape, gear), sector_mesh(shape, gear)
    for name in ("cut_low", "cut_high", "hub"):
        np.testing.assert_allclose(mesh.points[getattr(mesh, name)], sound.points[getattr(sound, name)], atol=1e-15)
    found = quality(mesh)
    assert found.jacobian > 0.8
    assert found.angle > radians(20)
    assert found.area == pytest.approx(quality(sound).area, rel=1e-6)
    # Both faces are there, as long as the crack, and end in one tip.
    nodes = mesh.crack
    assert nodes is not None and sound.crack is None
    right, left = np.split(nodes.faces, 2)
    np.testing.assert_array_equal(mesh.points[right], mesh.points[left])
    ends = mesh.points[right[:, :2]]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(length, rel=1e-12)
    assert set(right.ravel()) & set(left.ravel()) == {nodes.line[-1]}
    # Every edge belongs to two triangles, but for those of the boundary: as many as outline, faces, cuts and hub have.
    local = mesh.cells[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, times = np.unique(np.sort(local, axis=1), axis=0, return_counts=True)
    others = (len(mesh.cut_low) + len(mesh.cut_high) + len(mesh.hub) - 3) // 2
    assert times.max() == 2
    assert (times == 1).sum() == len(mesh.free_edges) + others
    # The outline stays closed but for the open mouth.
    assert len(np.unique(mesh.boundary_edges[:, :2])) == len(mesh.boundary_edges) + 2


@pytest.mark.parametrize("direction", [2.0, 3.0, 8.0, 14.0])
def test_a_crack_that_meets_nothing_is_limited_by_its_length(cracked: Callable[..., Gear], direction: float) -> None:
    """Of many teeth a direction near the radius leads past everything for 8 modules."""
    changes = {"teeth": 62, "hub_radius": 30e-3, "direction": direction}
    gear = cracked(**changes)
    assert slit(profile(gear), gear, gear.crack).length == 0.8e-3  # type: ignore[arg-type]
    module = 1e3 * gear.module
    assert refusal(cracked(length=8.01e-3 * module, **changes)).endswith(
        f"less than {8 * module:.4g}, the longest crack that is meshed (8 modules)"
    )

"""Rigid supports are none of the rig's modes, and a bore that is the hub is called by its name."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest

import gearbench as gb
from gearbench.bench.results.exact import lumped_periodic_system
from gearbench.geometry import GeometryError, pair
from gearbench.identification.response.modes import frozen_modes

GEARS = """
[rig.driver]
teeth = 23
module_mm = 2.5
face_width_mm = 18
bore_radius_mm = {bore}
inertia_kg_m2 = 1.5e-4
[rig.driven]
teeth = 41
module_mm = 2.5
face_width_mm = 18
[experiment]
mesh_frequency_hz = 100
torque_mean_nm = 60
[simulation]
model = "lumped"
mesh_stiffness = "rectangular"
stiffness_single_n_per_m = 2e8
stiffness_double_n_per_m = 3e8
"""


def written(folder: Path, bore: float = 10.0) -> Path:
    path = folder / "mine.toml"
    path.write_text(GEARS.format(bore=bore), encoding="utf-8")
    return path


def test_held_centres_leave_the_mode_of_the_mesh_alone(tmp_path: Path) -> None:
    system = lumped_periodic_system(gb.read_case(written(tmp_path)))
    frequency, _ = frozen_modes(system, np.arange(64) / 64, modes=1)
    # The driver on the teeth against a driven gear of constant speed: sqrt(k / (J / r_b^2)) / 2 pi.
    mass = 1.5e-4 / (0.5 * 2.5e-3 * 23 * np.cos(20 * pi / 180)) ** 2
    expected = [sqrt(k / mass) / (2 * pi) for k in (2e8, 3e8)]
    assert (np.nanmin(frequency), np.nanmax(frequency)) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(("bore", "words"), [(26.0, "is too large: at most 25.5"), (0.001, "is too small to be")])
def test_a_bore_is_called_a_bore(tmp_path: Path, bore: float, words: str) -> None:
    case = gb.read_case(written(tmp_path, bore))
    with pytest.raises(GeometryError, match=rf"rig\.driver\.bore_radius_mm = {bore:g} {words}"):
        pair(case.rig)
    with pytest.raises(GeometryError, match=r"rig\.driver\.hub_radius_mm = 26 is too large"):
        pair(gb.read_case(written(tmp_path), ["rig.driver.hub_radius_mm=26"]).rig)

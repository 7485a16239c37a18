"""Records of rigs without supports, whose centres are held: nothing is concluded from how they hardly move."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearbench as gb
from gearbench.records import RecordError
from gearbench.records.checks import check_record
from gearbench.records.seen.mesh_force import Accounts

CASE = """
[rig.driver]
teeth = 24
module_mm = 3
face_width_mm = 20
bore_radius_mm = 12
[rig.driven]
teeth = 37
module_mm = 3
face_width_mm = 20
[experiment]
speed_driver_rpm = 1000
torque_mean_nm = 100
[experiment.multisine]
rms_nm = 5
band_hz = [5, 3000]
[simulation]
model = "lumped"
"""


def test_a_case_of_two_gears_gives_a_sound_record(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(CASE, encoding="utf-8")
    record = gb.simulate(gb.read_case(tmp_path / "mine.toml"))
    assert not [one for one in check_record(record) if "y_driver" in one.sentence]


def test_a_displacement_in_the_wrong_unit_is_no_held_centre() -> None:
    record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=1"]))
    y = record["y_driver"]
    with pytest.raises(RecordError, match="y_driver moves"):
        check_record(record.assign(y_driver=(y.dims, 1e-6 * y.values, y.attrs)))


def test_accounts_of_no_force_agree_without_a_warning(recwarn: pytest.WarningsRecorder) -> None:
    nothing = np.zeros(5, dtype=complex)
    gears = {gear: {f"torque_{gear}": nothing} for gear in ("driver", "driven")}
    accounts = Accounts(gears, {"driver": np.ones((5, 3), dtype=complex)}, np.arange(1.0, 6.0))
    assert [float(accounts.misfit(one)[0]) for one in accounts.relations()] == [0.0, 0.0, 0.0]
    assert not recwarn.list

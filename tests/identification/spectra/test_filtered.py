"""Records behind an anti-alias filter that all channels passed: their spectra are those of the rig."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import gearbench as gb
from gearbench.identification.spectra.course import course_spectra
from gearbench.identification.spectra.records import PASSED, record_spectra
from gearbench.records.antialias import common_lag

RIG = ("experiment.realisations=1", "rig.sensors.noise_torque_nm=1e-9")


@pytest.fixture(scope="module")
def plain() -> xr.Dataset:
    return gb.simulate(gb.read_case("quick_lumped", list(RIG)))


def test_what_all_channels_passed_is_taken_back(plain: xr.Dataset) -> None:
    """Each line has its own delay: sidebands err by 20 % and more beside the lines that they stem from, and by the
    filter's slow delay alone every branch is turned round with the mesh."""
    corner = 2500.0
    filtered = gb.simulate(gb.read_case("quick_lumped", [*RIG, f"rig.sensors.filter_hz={corner}"]))
    (one, _, _), (other, _, _) = (record_spectra([record], sidebands=8) for record in (plain, filtered))
    lag = common_lag(filtered)
    assert lag is not None
    top = other.dte.shape[1]
    passed = np.abs(lag.response(other.spacing * np.arange(one.dte.shape[1]))) >= PASSED
    assert top <= one.dte.shape[1] and passed[:top].all()
    for name in ("force", "dte"):
        wanted, found = getattr(one, name)[:, 1:top], getattr(other, name)[:, 1:]
        assert np.linalg.norm(found - wanted) < 1e-4 * np.linalg.norm(wanted)
    assert other.start_phase == pytest.approx(one.start_phase)


def test_a_delay_that_all_channels_state_is_taken_back(plain: xr.Dataset) -> None:
    count, delay = 7, 7 / float(plain.attrs["sampling_rate"])
    late = plain.copy(deep=True)
    for name in late.data_vars:
        if name != "mesh_phase":
            late[name].attrs["delay"] = delay
            if name in ("dte", "force"):
                late[name].values[:] = np.roll(plain[name].values, count, axis=1)
    (one, _, _), (other, _, _) = (record_spectra([record], sidebands=8) for record in (plain, late))
    for name in ("force", "dte"):
        wanted = getattr(one, name)[:, 1:]
        assert np.linalg.norm(getattr(other, name)[:, 1:] - wanted) < 1e-9 * np.linalg.norm(wanted)


def test_at_a_varying_speed_the_mesh_is_taken_as_much_earlier(plain: xr.Dataset) -> None:
    late = plain.copy(deep=True)
    time, rate = plain["time"].values, float(plain.attrs["sampling_rate"])
    cycles = 400.0 * time + 300.0 * time**2
    for name in late.data_vars:
        late[name].attrs["delay"] = 3.5 / rate
    late["mesh_phase"] = (plain["dte"].dims, np.broadcast_to(cycles, plain["dte"].shape).copy(), {"units": "cycles"})
    _, course = course_spectra([late])
    true = 400.0 * (time - 3.5 / rate) + 300.0 * (time - 3.5 / rate) ** 2
    assert course.cycles[0, 4:] == pytest.approx(true[4:], abs=1e-5)
    assert course.cycles[0, :4] == pytest.approx(true[:4], abs=1e-3)

"""Mesh feedback at a speed that varies explains too little: the local polynomial method is tried as far as it goes."""

import numpy as np
import pytest
import xarray as xr
from shared.ptv import periodic_filter

from gearbench.identification import IdentificationSettings, htf, identify
from gearbench.identification.spectra.course import speed_varies
from gearbench.records.record import make_record

SAMPLES, PERIOD = 1600, 32
# A random filter takes work from nowhere, as no rig does.
SETTINGS = IdentificationSettings(
    "mesh-feedback", 6, band=(0.05, 0.4), phases=16, modes=0, step=5, accept_doubts=True
)


def record(wander: float) -> xr.Dataset:
    """A random filter that turns with an even mesh; the phase that was measured of it swings by `wander` cycles."""
    system = periodic_filter(2, PERIOD, taps=6)
    force = np.random.default_rng(4).standard_normal((3, SAMPLES))
    phase = np.arange(SAMPLES) / PERIOD + wander * np.sin(6 * np.pi * np.arange(SAMPLES) / SAMPLES)
    channels = {"dte": 1e-9 * system.response(force), "force": force, "mesh_phase": np.tile(phase, (3, 1))}
    attributes = {"sampling_rate": 1.0, "samples_per_period": SAMPLES, "periods": 1, "mesh_period": float(PERIOD)}
    return make_record(channels, {**attributes, "settling_residual": 0.0})


@pytest.mark.parametrize(("wander", "most"), [pytest.param(0.07, 0.05, marks=pytest.mark.validation), (0.4, 0.15)])
def test_a_wander_is_left_to_the_local_polynomial_method(wander: float, most: float) -> None:
    """Half of a radian at branch 1, and 2.5: its result is taken, says so, promises little and is close at branch 0."""
    swinging = record(wander)
    assert speed_varies([swinging])
    frf = identify([swinging], SETTINGS)
    assert frf.attrs["method"] == "lpm"
    assert "this is the result of the local polynomial method instead" in frf.attrs["warnings"]
    plain = IdentificationSettings(harmonics=2, band=(0.05, 0.4), phases=16, modes=0, step=5, accept_doubts=True)
    steady = identify([record(0.0)], plain)
    found, wanted = (htf(one).sel(harmonic=0).values for one in (frf, steady))
    error = np.linalg.norm(found - wanted) / np.linalg.norm(wanted)
    assert error < most and frf.attrs["expected_error"] > error

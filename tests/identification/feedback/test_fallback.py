"""Mesh feedback at a speed that varies explains too little: the local polynomial method is tried as far as it goes."""

import numpy as np
import pytest
import xarray as xr
from shared.ptv import periodic_filter

from gearbench.identification import IdentificationSettings, SpectraError, htf, identify
from gearbench.identification.feedback.varying_frf import speed_varies
from gearbench.records.record import make_record

SAMPLES, PERIOD = 1600, 32
SETTINGS = IdentificationSettings("mesh-feedback", 6, band=(0.05, 0.4), phases=16, modes=0, step=5)


def record(wander: float) -> xr.Dataset:
    """A random filter that turns with an even mesh; the phase that was measured of it swings by `wander` cycles."""
    system = periodic_filter(2, PERIOD, taps=6)
    force = np.random.default_rng(4).standard_normal((3, SAMPLES))
    phase = np.arange(SAMPLES) / PERIOD + wander * np.sin(6 * np.pi * np.arange(SAMPLES) / SAMPLES)
    channels = {"dte": 1e-9 * system.response(force), "force": force, "mesh_phase": np.tile(phase, (3, 1))}
    attributes = {"sampling_rate": 1.0, "samples_per_period": SAMPLES, "periods": 1, "mesh_period": float(PERIOD)}
    return make_record(channels, {**attributes, "settling_residual": 0.0})


def test_a_small_wander_is_left_to_the_local_polynomial_method() -> None:
    """Half of a radian at branch 1: its result is taken, says so, and is right about branch 0."""
    swinging = record(0.07)
    assert speed_varies([swinging])
    frf = identify([swinging], SETTINGS)
    assert frf.attrs["method"] == "lpm"
    assert "this is the result of the local polynomial method instead" in frf.attrs["warnings"]
    assert "departs from constant speed" in frf.attrs["warnings"]
    steady = identify([record(0.0)], IdentificationSettings(harmonics=2, band=(0.05, 0.4), phases=16, modes=0, step=5))
    found, wanted = (htf(one).sel(harmonic=0).values for one in (frf, steady))
    assert np.linalg.norm(found - wanted) < 0.05 * np.linalg.norm(wanted)


def test_a_large_one_stays_with_mesh_feedback_and_says_what_is_wrong() -> None:
    swinging = record(0.4)
    frf = identify([swinging], SETTINGS)
    assert frf.attrs["method"] == "mesh-feedback"
    assert frf.attrs["expected_error"] > 0.05
    assert "does not explain this record" in frf.attrs["warnings"]
    with pytest.raises(SpectraError, match="method mesh-feedback follows the measured phase"):
        identify([swinging], IdentificationSettings(harmonics=2, band=(0.05, 0.4)))

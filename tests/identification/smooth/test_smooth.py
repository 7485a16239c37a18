"""Smooth branches on the reference system's short records, beside polynomials, and their error bars."""

from functools import cache

import numpy as np
import pytest
import xarray as xr
from shared.reference_rig import ReferenceRig, reference_record

from gearbench.identification import IdentificationSettings, LpmError, exact_itf, identify, itf

RIG = ReferenceRig(mesh_frequency=64.0, edge=0.05)
BAND = (900.0, 1300.0)


@cache
def record(seed: int = 0) -> xr.Dataset:
    """Half a second of one realisation, 40 dB: 25 times too short for polynomials."""
    return reference_record(RIG, realisations=1, duration=0.5, band=(2.0, 2600.0), noise=0.01, seed=seed)


def found(seed: int = 0, **chosen: object) -> tuple[xr.Dataset, float]:
    """The result with choices, and its error."""
    settings = IdentificationSettings(band=BAND, phases=64, step=4, modes=0, **chosen)  # type: ignore[arg-type]
    frf = identify([record(seed)], settings)
    exact = exact_itf(RIG.system(512), frf.frequency.values, frf.phase.values)
    return frf, float(np.linalg.norm(itf(frf).values - exact) / np.linalg.norm(exact))


def test_a_short_record_is_left_to_smooth_branches() -> None:
    frf, error = found()
    _, other = found(branches="polynomials")
    assert frf.attrs["branches"] == "smooth" and "order" not in frf.attrs
    assert error < 0.6 * other
    assert 0.8 < frf.attrs["expected_error"] / error < 1.6
    assert 20.0 < frf.attrs["smooth_bandwidth"] < 250.0  # half-power bandwidths: 110 to 170 Hz
    parts = [frf.attrs[f"{name}_error"] for name in ("noise", "branches", "window", "record")]
    assert np.linalg.norm(parts) == pytest.approx(frf.attrs["expected_error"], rel=1e-6)


def test_branches_that_nobody_tried_count_as_missing() -> None:
    """Three branches a side, of some twelve: as noise, what is missing would go on hiding in an even residual."""
    frf, error = found(branches="smooth", harmonics=3)
    assert 0.75 < frf.attrs["expected_error"] / error < 1.6


def test_error_bars_hold_over_records() -> None:
    """Other multisines and noise: rms of the stated deviations of the ITF over rms of its errors."""
    stated = actual = 0.0
    for seed in range(1, 5):
        frf, _ = found(seed, branches="smooth", harmonics=12)
        exact = exact_itf(RIG.system(512), frf.frequency.values, frf.phase.values)
        stated += float(frf["itf_var"].values.sum())
        actual += float(np.sum(np.abs(itf(frf).values - exact) ** 2))
    assert 0.8 < np.sqrt(stated / actual) < 1.6


@pytest.mark.parametrize(
    ("chosen", "said"),
    [
        ({"branches": "rough"}, "branches = 'rough' must be 'auto', 'polynomials' or 'smooth'"),
        ({"branches": "smooth", "order": 2}, "order = 2 belongs to branches = 'polynomials'"),
        ({"branches": "smooth", "method": "mesh-feedback"}, "branches = 'smooth' belongs to method 'lpm'"),
    ],
)
def test_choices_that_contradict_each_other_are_refused(chosen: dict[str, object], said: str) -> None:
    with pytest.raises(LpmError, match=said):
        IdentificationSettings(**chosen)  # type: ignore[arg-type]


def test_more_sidebands_than_the_record_holds_are_refused() -> None:
    with pytest.raises(LpmError, match="at most 43 fit"):
        found(branches="smooth", harmonics=60)

"""Measures of results against signals whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from gearbench.bench.results.measures import itf_difference, median_in, mesh_orders, mode_range, synchronous_mean


def test_mesh_orders_are_amplitudes() -> None:
    phase = np.arange(40) / 40
    wave = 7.0 + 3 * np.cos(2 * np.pi * (phase - 0.3)) + 0.5 * np.sin(6 * np.pi * phase)
    assert mesh_orders(wave) == pytest.approx([3.0, 0.0, 0.5], abs=1e-14)
    with pytest.raises(ValueError, match="7 are needed"):
        mesh_orders(wave[:6])


@pytest.mark.parametrize("with_phase", [True, False])
def test_synchronous_mean_keeps_what_repeats_with_the_mesh(with_phase: bool) -> None:
    rate, mesh, start = 1000.0, 5.0, 0.0
    time = np.arange(4000) / rate
    start = 0.25 if with_phase else 0.0
    phase = mesh * time + start
    shape = np.cos(2 * np.pi * phase) + 0.2 * np.sin(4 * np.pi * phase)
    other = np.cos(2 * np.pi * 7.25 * time)  # repeats every 4 s, with no mesh order in it
    record = xr.Dataset(
        {"dte": (("realisation", "time"), np.array([shape + other, shape - other]))},
        coords={"time": time},
        attrs={"mesh_period": 1 / mesh},
    )
    if with_phase:
        record["mesh_phase"] = (("realisation", "time"), np.array([phase, phase]))
    grid, mean = synchronous_mean(record, points=100)
    assert mean == pytest.approx(np.cos(2 * np.pi * grid) + 0.2 * np.sin(4 * np.pi * grid), abs=0.04)


def frf(frequency: np.ndarray, phases: int, scale: float = 1.0) -> xr.Dataset:
    phase = np.arange(phases) / phases
    itf = scale * np.outer(1 / (1 + 1j * frequency / 100), 1 + 0.3 * np.exp(2j * np.pi * phase))
    natural = np.array([1000 + 100 * np.cos(2 * np.pi * phase)])
    return xr.Dataset(
        {
            "itf_re": (("frequency", "phase"), itf.real),
            "itf_im": (("frequency", "phase"), itf.imag),
            "natural_frequency": (("mode", "phase"), natural),
        },
        coords={"frequency": frequency, "phase": phase},
    )


def test_itf_difference_over_common_frequencies_and_any_phases() -> None:
    one, two = frf(np.arange(10.0, 200.0, 2.0), 32), frf(np.arange(10.0, 300.0, 5.0), 50)
    assert itf_difference(one, two) == pytest.approx(0.0, abs=1e-12)
    assert itf_difference(frf(np.arange(10.0, 200.0, 2.0), 32, 1.1), two) == pytest.approx(0.1, rel=1e-9)
    assert np.isnan(itf_difference(one, two, (201.0, 299.0)))


def test_mode_ranges_and_medians() -> None:
    found = frf(np.array([1.0]), 100)
    assert mode_range(found) == pytest.approx((900.0, 1100.0))
    assert np.isnan(mode_range(found, 1)[0])
    assert median_in(found, [(0.4, 0.6)]) < 925 < 950 < median_in(found, [(0.4, 0.6)], inside=False)
    found["natural_frequency"][0, 50] = np.nan
    assert mode_range(found)[0] == pytest.approx(900.0, abs=0.3)

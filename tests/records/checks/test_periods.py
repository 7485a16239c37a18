"""Forces that repeat after another period than the declared one, channels that stick, clips under noise."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from shared.spoilt import bare, simulated, with_values

from gearbench.records import RecordError
from gearbench.records.checks import check_record
from gearbench.records.checks.clipping import clipped_ends
from gearbench.records.checks.periods import differences, force_repeats_as_declared
from gearbench.records.clocks.dropouts import stuck
from gearbench.records.record import make_record


def test_a_channel_that_sticks_is_named() -> None:
    record = bare(simulated("free"))
    values = record.y_driver.values.copy()
    middle = int(np.argmin(np.abs(values[0] - np.median(values[0]))))
    values[0, middle : middle + 100] = values[0, middle]
    (found,) = [one for one in check_record(with_values(record, "y_driver", values)) if "stands still" in one.sentence]
    assert "y_driver stands still for 100 samples" in found.sentence
    assert found.error == pytest.approx(np.sqrt(200 / values.shape[1]), rel=1e-6)
    assert stuck(np.round(np.sin(np.arange(5000) / 700) * 20))[0] == 0


@pytest.mark.parametrize("noise", [1e-5, 1e-4])
def test_noise_after_a_clip_does_not_hide_it(noise: float) -> None:
    values = np.clip(np.sin(np.arange(20000) / 7.3), -1.0, 0.8)
    found = clipped_ends(values + noise * np.random.default_rng(1).standard_normal(values.size))
    assert found[0] == pytest.approx(float(np.mean(values >= 0.8)), rel=0.1) and found[1] == 0.0


@pytest.mark.parametrize("noise", [0.0, 1e-4, 3e-4])
def test_a_peak_that_comes_back_under_noise_is_not_clipped(noise: float) -> None:
    """Fourteen peaks of five samples, each a little earlier or later: flat at their tops, steep beside."""
    rng = np.random.default_rng(6)
    late = rng.uniform(-0.1, 0.1, 14)[:, None]
    values = np.maximum(1.0 - ((np.arange(585) - 300 - late) / 3) ** 2, 0.1 * np.sin(np.arange(585) / 9)).ravel()
    assert clipped_ends(values + noise * rng.standard_normal(values.size)) == (0.0, 0.0)


def repeated(period: int, count: int, noise: float) -> xr.Dataset:
    """Force and dte that repeat every `period` samples, white noise on both."""
    rng = np.random.default_rng(4)
    lines = np.fft.rfft(rng.standard_normal(period)) * (np.arange(period // 2 + 1) < period // 6)
    signal = np.tile(np.fft.irfft(lines, period), count)[None]
    signal = signal / signal.std()
    made = {name: signal + noise * rng.standard_normal(signal.shape) for name in ("force", "dte")}
    attributes = {"sampling_rate": 8192.0, "samples_per_period": period, "periods": count, "mesh_period": 64 / 8192.0}
    return make_record(
        {"force": 1e4 * (10 + made["force"]), "dte": 1e-4 * made["dte"]}, attributes
    )


@pytest.mark.parametrize(("samples", "noise"), [(1024, 0.0), (2560, 0.1), (5120, 0.0), (512 * 13, 0.01)])
def test_a_wrong_excitation_period_is_refused(samples: int, noise: float) -> None:
    """Half of it, 1.25, 2.5 and 3.25 of it in a record that holds whole mesh periods all the same."""
    record = repeated(2048, 5, noise)
    kept = record.sizes["time"] // samples
    wrong = record.isel(time=slice(0, samples * kept)).assign_attrs(samples_per_period=samples, periods=kept)
    with pytest.raises(RecordError, match=rf"every 20(48|4[79]) samples .* samples_per_period = {samples}"):
        check_record(wrong, checks=[force_repeats_as_declared])


@pytest.mark.parametrize(("samples", "noise"), [(2048, 0.0), (2048, 0.3), (4096, 0.0), (10240, 0.0)])
def test_excitation_periods_that_are_whole_pass(samples: int, noise: float) -> None:
    record = repeated(2048, 5, noise)
    kept = record.sizes["time"] // samples
    right = record.isel(time=slice(0, samples * kept)).assign_attrs(samples_per_period=samples, periods=kept)
    assert check_record(right, checks=[force_repeats_as_declared]) == ()


def test_a_force_that_does_not_repeat_at_all_is_refused() -> None:
    record = repeated(2048, 5, 0.0)
    noise = np.random.default_rng(1).standard_normal(record.force.shape)
    with pytest.raises(RecordError, match=r"does not repeat after samples_per_period = 2048"):
        check_record(with_values(record, "force", 1e4 * (10 + noise)), checks=[force_repeats_as_declared])


def test_differences_are_those_of_the_samples() -> None:
    values = np.random.default_rng(0).standard_normal(400)
    found = differences(values)
    for lag in (0, 1, 37, 299):
        first, second = values[: 400 - lag], values[lag:]
        wanted = np.sqrt(np.sum((first - second) ** 2) / np.sum(first**2 + second**2))
        assert found[lag] == pytest.approx(wanted, abs=1e-7)

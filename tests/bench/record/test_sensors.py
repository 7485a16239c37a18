"""Delays against the shifted signal itself, noise against its level and independence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shared.effect_rig import make_rig

from gearbench.bench import BenchError
from gearbench.bench.record.sensors import CHANNELS, Signal, check_delays, delayed, measured
from gearbench.rig import Rig, Sensors

RATE = 2048.0
SAMPLES = 512


def rig_with(**sensors: Any) -> Rig:
    return make_rig(sensors=Sensors(**sensors))


def quiet(samples: int = SAMPLES, realisations: int = 1) -> dict[str, Signal]:
    return {name: Signal(np.zeros((realisations, samples))) for name in CHANNELS}


def wave(time: np.ndarray) -> np.ndarray:
    return np.asarray(1.5 + np.cos(2 * np.pi * 12 * time + 0.3) + 0.2 * np.sin(2 * np.pi * 1000 * time))


def test_a_late_channel_is_the_signal_at_earlier_times() -> None:
    time = np.arange(SAMPLES) / RATE
    late = delayed(Signal(wave(time)[None], ramp=30.0), 137e-6, RATE)
    np.testing.assert_allclose(late.swing[0] + late.ramp * time, wave(time - 137e-6) + 30 * (time - 137e-6), atol=1e-12)


@pytest.mark.parametrize("samples", [256, 255])
def test_a_delay_is_a_phase_ramp_and_taken_back_by_its_opposite(samples: int) -> None:
    # An even number of samples keeps of its highest line only what a real signal can have.
    noise = np.random.default_rng(2).standard_normal(samples)
    spectrum = np.fft.rfft(noise)
    if samples % 2 == 0:
        spectrum[-1] = 0.0
    swing = np.fft.irfft(spectrum, n=samples)
    late = delayed(Signal(swing[None]), 210e-6, RATE).swing
    ratio = np.fft.rfft(late[0])[1:-1] / spectrum[1:-1]
    frequency = np.fft.rfftfreq(samples, 1 / RATE)[1:-1]
    np.testing.assert_allclose(ratio, np.exp(-2j * np.pi * frequency * 210e-6), rtol=1e-9)
    np.testing.assert_allclose(delayed(Signal(late), -210e-6, RATE).swing[0], swing, atol=1e-12)


def test_each_delay_belongs_to_its_channel() -> None:
    time = np.arange(SAMPLES) / RATE
    signals = {name: Signal(wave(time)[None]) for name in CHANNELS}
    rig = rig_with(delay_y_driven=50e-6, delay_torque_driver=-20e-6)
    seen = measured(signals, rig, RATE, seed=1, samples=SAMPLES, samples_per_period=SAMPLES)
    for name in CHANNELS:
        shift = {"y_driven": 50e-6, "torque_driver": -20e-6}.get(name, 0.0)
        np.testing.assert_allclose(seen[name].swing[0], wave(time - shift), atol=1e-12)


def test_noise_has_its_level_and_every_row_its_own() -> None:
    samples, period, runs = 3 * 4096, 4096, 2
    rig = rig_with(noise_angle=1e-6, noise_displacement=2e-8, noise_torque=0.3)
    seen = measured(quiet(period, runs), rig, RATE, seed=5, samples=samples, samples_per_period=period)
    rows = np.array([seen[name].swing.reshape(-1, period) for name in CHANNELS])
    levels = {"angle": 1e-6, "y": 2e-8, "torque": 0.3}
    expected = np.array([levels[name.split("_")[0]] for name in CHANNELS])
    np.testing.assert_allclose(rows.std(axis=(1, 2)), expected, rtol=0.02)
    scaled = (rows / expected[:, None, None]).reshape(-1, period)
    correlation = scaled @ scaled.T / period - np.eye(len(scaled))
    assert np.abs(correlation).max() < 6 / np.sqrt(period)
    # White: no lag is correlated.
    power = np.abs(np.fft.rfft(scaled, axis=1)) ** 2 / period
    assert power.mean(axis=0)[1:-1].reshape(-1, 89).mean(axis=1) == pytest.approx(np.ones(23), abs=0.15)


def test_noise_repeats_with_the_seed_and_is_absent_at_level_zero() -> None:
    rig = rig_with(noise_angle=1e-6)
    once, again, other = (
        measured(quiet(), rig, RATE, seed=seed, samples=SAMPLES, samples_per_period=SAMPLES) for seed in (3, 3, 4)
    )
    np.testing.assert_array_equal(once["angle_driver"].swing, again["angle_driver"].swing)
    assert not np.array_equal(once["angle_driver"].swing, other["angle_driver"].swing)
    assert not once["y_driver"].swing.any()


def test_a_delay_needs_a_record_that_repeats() -> None:
    check_delays(rig_with(), False, 1.2)
    check_delays(rig_with(delay_y_driver=1e-5), True, 1.2)
    with pytest.raises(BenchError, match=r"rig\.sensors\.delay_y_driver_us needs a record that repeats: .* 1\.2 s"):
        check_delays(rig_with(delay_y_driver=1e-5), False, 1.2)

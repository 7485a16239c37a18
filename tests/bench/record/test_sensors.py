"""Delays against the shifted signal itself, noise against its level and independence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, freqs, lsim
from shared.effect_rig import make_rig

from gearbench.bench import BenchError
from gearbench.bench.record.sensors import (
    CHANNELS,
    Signal,
    check_delays,
    delayed,
    encoder_error,
    filter_delay,
    filter_response,
    filtered,
    imposed,
    measured,
    shown_by,
)
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
    levels = {"angle": 1e-6, "y": 2e-8, "x": 2e-8, "torque": 0.3}
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


@pytest.mark.parametrize("corner", [150.0, 700.0])
def test_the_filter_is_a_butterworth_low_pass_of_order_eight(corner: float) -> None:
    # Against scipy's design of the analogue filter, and its time response against its spectrum.
    frequency = np.linspace(0.0, 2000.0, 201)
    b, a = butter(8, 2 * np.pi * corner, analog=True)
    _, expected = freqs(b, a, 2 * np.pi * frequency)
    np.testing.assert_allclose(filter_response(frequency, corner), expected, rtol=1e-9)
    slope = np.gradient(np.unwrap(np.angle(filter_response(np.linspace(0, 1e-2 * corner, 11), corner))), 1e-3 * corner)
    assert filter_delay(corner) == pytest.approx(-slope[5] / (2 * np.pi), rel=1e-3)


def test_a_filtered_channel_lags_as_a_whole_and_no_sample_precedes_its_cause() -> None:
    time, fine = np.arange(SAMPLES) / RATE, np.arange(SAMPLES * 16) / (16 * RATE)
    kick = np.exp(-(((fine - 0.05) * 600) ** 2))
    seen = filtered(Signal(kick[None, ::16], ramp=30.0), 300.0, RATE)
    _, expected, _ = lsim(butter(8, 2 * np.pi * 300.0, analog=True), kick, fine)
    np.testing.assert_allclose(seen.swing[0] + 30.0 * filter_delay(300.0), expected[::16], atol=1e-4)
    assert np.abs(seen.swing[0][time < 0.045] + 30.0 * filter_delay(300.0)).max() < 1e-6


def test_gain_filter_and_steps_act_in_the_order_of_the_chain() -> None:
    time = np.arange(SAMPLES) / RATE
    signals = {name: Signal(wave(time)[None], 300.0 if "angle" in name else 0.0) for name in CHANNELS}
    rig = rig_with(gain_torque_driven=1.25, filter=600.0, quantisation_angle=0.01, quantisation_torque=0.02)
    seen = measured(signals, rig, RATE, seed=1, samples=SAMPLES, samples_per_period=SAMPLES, start=2.0)
    slow, fast = filter_response(np.array([12.0, 1000.0]), 600.0)
    late = filter_delay(600.0)
    through = 1.5 + (slow * np.exp(1j * (2 * np.pi * 12 * time + 0.3))).real
    through += 0.2 * (fast * np.exp(1j * (2 * np.pi * 1000 * time - np.pi / 2))).real
    np.testing.assert_allclose(seen["y_driver"].swing[0], through, atol=1e-12)
    np.testing.assert_allclose(seen["torque_driver"].swing[0], through, atol=0.01 + 1e-12)
    np.testing.assert_allclose(seen["torque_driven"].swing[0], 1.25 * through, atol=0.01 + 1e-12)
    angle = seen["angle_driven"].swing[0] + 300.0 * (2.0 + time)
    np.testing.assert_allclose(angle, through + 300.0 * (2.0 + time - late), atol=0.005 + 1e-9)
    for values, step in ((angle, 0.01), (seen["torque_driven"].swing[0], 0.02)):
        assert np.abs(values / step - np.round(values / step)).max() < 1e-6
    assert len(np.unique(np.round(angle / 0.01))) > 100


def test_a_small_change_is_shown_as_two_records_differ() -> None:
    time = np.arange(SAMPLES) / RATE
    rig = rig_with(gain_torque_driven=1.25, delay_torque_driven=80e-6, delay_y_driver=-30e-6, filter=700.0)
    change = np.stack([np.cos(2 * np.pi * 40 * time), np.sin(2 * np.pi * 300 * time + 1)])
    for name in ("torque_driven", "y_driver", "angle_driver"):
        before, after = (
            measured({name: Signal(wave(time) + part * change)}, rig, RATE, seed=1, samples=SAMPLES,
                     samples_per_period=SAMPLES)[name].swing
            for part in (0.0, 1.0)
        )  # fmt: skip
        response = shown_by(rig.sensors, name, np.fft.rfftfreq(SAMPLES, 1 / RATE))
        shown = np.fft.irfft(response * np.fft.rfft(change, axis=1), SAMPLES, axis=1)
        np.testing.assert_allclose(shown, after - before, atol=1e-12)
        assert np.abs(shown - change).max() > 0.005


def test_a_driver_torque_is_recovered_from_what_its_sensor_shows() -> None:
    time = np.arange(SAMPLES) / RATE
    applied = 100.0 + 3 * np.cos(2 * np.pi * 40 * time) + np.sin(2 * np.pi * 500 * time + 1)
    rig = rig_with(gain_torque_driver=0.97, delay_torque_driver=80e-6, filter=700.0)
    signals = {"torque_driver": Signal(applied[None])}
    seen = measured(signals, rig, RATE, seed=1, samples=SAMPLES, samples_per_period=SAMPLES)["torque_driver"].swing
    assert np.abs(seen[0] - applied).max() > 1.0
    np.testing.assert_allclose(imposed(seen, rig.sensors, RATE)[0], applied, atol=1e-9)


def test_encoder_error_returns_with_every_turn() -> None:
    sensors = Sensors(encoder_runout_driven=20e-6, encoder_runout_driven_phase=1.0)
    turn = np.linspace(0.0, 4 * np.pi, 9)
    np.testing.assert_allclose(encoder_error(sensors, "driven", turn), 20e-6 * np.cos(turn - 1.0))
    assert not encoder_error(sensors, "driver", turn).any()


def test_a_record_of_more_than_whole_blocks_is_delayed_block_by_block() -> None:
    # One and a half blocks of 256 samples: the signal repeats after a block, not after the record.
    samples, block = 384, 256
    time = np.arange(samples) / RATE

    def signal(t: np.ndarray) -> np.ndarray:
        return np.asarray(np.cos(2 * np.pi * RATE / block * 5 * t) + 0.3 * np.sin(2 * np.pi * RATE / block * 9 * t))

    rig = rig_with(delay_y_driver=90e-6)
    signals = {"y_driver": Signal(signal(time)[None])}
    seen = measured(signals, rig, RATE, seed=1, samples=samples, samples_per_period=block, block=block)
    np.testing.assert_allclose(seen["y_driver"].swing[0], signal(time - 90e-6), atol=1e-12)


def test_a_filter_needs_a_record_that_repeats_too() -> None:
    with pytest.raises(BenchError, match=r"rig\.sensors\.filter_hz needs a record that repeats"):
        check_delays(rig_with(filter=500.0), False, 3.0)

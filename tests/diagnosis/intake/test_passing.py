"""What passes away in a record, against motion written out here: what repeats, and what decays beside it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.diagnosis.intake.passing import passing, passing_away

SAMPLES, NOISE = 2000, 1e-7
TIME = np.arange(3 * SAMPLES) / SAMPLES  # in repetitions


def repeated(count: int) -> NDArray[np.float64]:
    """Teeth and shafts: lines up to the highest, the smallest of the size of the noise."""
    rng = np.random.default_rng(7)
    spectrum = np.fft.rfft(rng.standard_normal(SAMPLES)) * 1e-5 / (1.0 + np.arange(SAMPLES // 2 + 1) / 10)
    return np.tile(np.fft.irfft(spectrum), (count, 1))


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize(("rate", "turning"), [(4.0, 0.0), (6.0, 3.0), (1.0, 1.0)])
def test_what_decays_is_taken_off_every_line_but_the_lowest(count: int, rate: float, turning: float) -> None:
    time = TIME[: count * SAMPLES]
    decaying = 3e-5 * np.exp(-rate * time) * np.cos(turning * time + 0.4)
    noise = NOISE * np.random.default_rng(3).standard_normal(time.size)
    real = repeated(count)
    measured = real + (decaying + noise).reshape(count, SAMPLES)
    found = measured - passing(measured)
    spread = np.abs(np.fft.rfft(found.mean(axis=0) - real[0]))[10:] / SAMPLES
    before = np.abs(np.fft.rfft(measured.mean(axis=0) - real[0]))[10:] / SAMPLES
    floor = NOISE / np.sqrt(count * SAMPLES)
    assert np.median(before[:50]) > 10 * floor
    assert np.sqrt((spread**2).mean()) < 1.1 * floor and spread[:20].max() < 4 * floor
    # Repetitions differ by noise alone.
    assert np.diff(found, axis=0).std() == pytest.approx(np.sqrt(2) * NOISE, rel=0.03)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_noise_stays_as_it_is(count: int) -> None:
    measured = repeated(count) + NOISE * np.random.default_rng(5).standard_normal((count, SAMPLES))
    assert not passing(measured).any()
    assert not passing(repeated(count)).any()


def test_a_tone_that_does_not_repeat_is_not_slow() -> None:
    tone = 1e-5 * np.sin(2 * np.pi * 100.3 * TIME[: 2 * SAMPLES]).reshape(2, SAMPLES)
    assert np.abs(passing(repeated(2) + tone)).max() < 0.05 * 1e-5


@pytest.mark.parametrize("rate", [4.0, 40.0, 400.0])
def test_gears_that_turn_on_together_make_no_transmission_error(rate: float) -> None:
    """A motion of both that no polynomial of this degree is, above all where it decays fast."""
    time, radii = TIME[: 2 * SAMPLES], (0.08, 0.32)
    turned = 1e-3 * np.exp(-rate * time) * np.cos(20.0 * time)
    error = 1e-6 * np.cos(2 * np.pi * time)
    rng = np.random.default_rng(11)
    channels = {
        f"angle_{gear}": (moved / radius + NOISE / radius * rng.standard_normal(time.size)).reshape(2, SAMPLES)
        for gear, radius, moved in zip(("driver", "driven"), radii, (turned + error, turned), strict=True)
    }
    passed = passing_away(channels, radii)
    left = {name: values - passed[name] for name, values in channels.items()}
    seen = radii[0] * left["angle_driver"] - radii[1] * left["angle_driven"]
    lines = np.fft.rfft(seen.mean(axis=0) - error[:SAMPLES]) / SAMPLES
    assert np.abs(lines[1:20]).max() < 5 * NOISE / np.sqrt(SAMPLES)
    assert passed["angle_driver"].any()

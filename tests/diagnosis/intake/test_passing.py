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
    """A motion of both that no polynomial is, above all where it decays fast."""
    time, radii = TIME[: 2 * SAMPLES], (0.08, 0.32)
    turned = 1e-3 * np.exp(-rate * time) * np.cos(4.0 * time)
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
    assert passed["angle_driver"].any() == (rate < 100.0)  # what is over at once is nothing slow


@pytest.mark.parametrize("cycles", [1.7, 2.6, 4.4, 7.2])
def test_a_slow_tone_that_does_not_repeat_is_left(cycles: float) -> None:
    """As of a bearing's cage, to its own size: polynomials nearly hold it, and bend at the ends as it does not."""
    tone = 1e-5 * np.sin(2 * np.pi * cycles * TIME + 0.4).reshape(3, SAMPLES)
    noise = NOISE * np.random.default_rng(3).standard_normal((3, SAMPLES))
    assert np.abs(passing(repeated(3) + tone + noise).mean(axis=0)).max() < 1e-5


@pytest.mark.parametrize("seed", range(8))
def test_noise_that_falls_with_frequency_is_left(seed: int) -> None:
    """Sensors have it: of 1/f noise no more is taken off than it has itself."""
    lines = np.fft.rfft(np.random.default_rng(seed).standard_normal(4 * SAMPLES))
    lines[1:] /= np.sqrt(np.arange(1, lines.size))
    noise = np.fft.irfft(lines)
    noise = 1e-6 * (noise / noise.std()).reshape(4, SAMPLES)
    found = passing(repeated(4) + noise)
    assert np.sqrt((found.mean(axis=0) ** 2).mean()) < 0.3e-6


def test_slow_motion_is_taken_off_beside_a_tone() -> None:
    turned = 3e-4 * np.exp(-1.5 * TIME).reshape(3, SAMPLES)
    tone = 1e-6 * np.sin(2 * np.pi * 4.4 * TIME + 0.4).reshape(3, SAMPLES)
    left = np.fft.rfft((turned + tone - passing(repeated(3) + turned + tone)).mean(axis=0))[10:100] / SAMPLES
    before = np.fft.rfft(turned.mean(axis=0))[10:100] / SAMPLES
    assert np.abs(left).max() < 0.02 * np.abs(before).max()

"""The excited band of forces that are measured: noise of the torque is no excitation."""

import numpy as np
import pytest

from gearbench.identification.spectra.course import excited_rows
from gearbench.identification.spectra.records import record_spectra
from gearbench.records import make_record

RATE, SAMPLES, MESH = 8000.0, 4000, 40.0  # lines 2 Hz apart
LOW, HIGH = 100, 1500  # excited: 200 to 3000 Hz


def record(noise: float, periods: int, *, low: int = LOW, high: int = HIGH, shaped: bool = False):
    """A force of equal lines (or lines that fall by 40 dB over the band), and white noise of `noise` times its rms."""
    rng = np.random.default_rng(5)
    spectrum = np.zeros(SAMPLES // 2 + 1, dtype=complex)
    lines = np.arange(low, high + 1)
    size = 10 ** (-2 * (lines - low) / (high - low)) if shaped else np.ones(lines.size)
    spectrum[lines] = size * np.exp(2j * np.pi * rng.uniform(size=lines.size))
    force = np.tile(np.fft.irfft(spectrum, SAMPLES), periods)
    force = 100.0 + 10.0 * (force / force.std() + noise * rng.standard_normal(force.size))
    time = np.arange(force.size) / RATE
    return make_record(
        {"force": force[None], "dte": 1e-8 * force[None], "mesh_phase": MESH * time[None]},
        {"sampling_rate": RATE, "samples_per_period": SAMPLES, "periods": periods, "mesh_period": 1 / MESH},
    )


@pytest.mark.parametrize("periods", [1, 2, 8])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 0.01, 0.1])
def test_noise_of_the_force_is_no_excitation(noise: float, periods: int) -> None:
    _, band, _ = record_spectra([record(noise, periods)], sidebands=2)
    assert band == (2.0 * LOW, 2.0 * HIGH)


@pytest.mark.parametrize("periods", [1, 4])
def test_weak_lines_without_noise_are_excited(periods: int) -> None:
    _, band, _ = record_spectra([record(0.0, periods, shaped=True)], sidebands=2)
    assert band == (2.0 * LOW, 2.0 * HIGH)


@pytest.mark.parametrize("periods", [1, 4])
def test_an_excitation_to_the_end_of_the_spectrum_is_its_own_measure(periods: int) -> None:
    _, band, _ = record_spectra([record(0.01, periods, low=1, high=SAMPLES // 2 - 1)], sidebands=2)
    assert band == (2.0, RATE / 2 - 2.0)


def test_periods_that_do_not_repeat_hide_no_excitation() -> None:
    _, band, _ = record_spectra([record(3.0, 2)], sidebands=2)
    assert band[0] < 400.0 and band[1] > 2500.0


def test_noise_is_no_excitation_at_a_speed_that_varies() -> None:
    _, _, lowest, highest = excited_rows([record(0.1, 1)])
    assert (lowest, highest) == (LOW, HIGH)

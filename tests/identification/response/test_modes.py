"""Modes against phase: closed-form rational responses, eigenvalues, noise, and modes that come and go."""

import numpy as np
import pytest
from shared.reference_rig import ReferenceRig

from gearbench.identification.response.modes import frozen_modes, itf_modes
from gearbench.identification.truth.periodic import PeriodicSystem, frozen_itf

FREQUENCY = np.arange(600.0, 2000.0, 2.0)


def resonances(natural: np.ndarray, damping: np.ndarray, strength: np.ndarray) -> np.ndarray:
    """Sum of unit oscillators (mode, phase): ITF (frequency, phase)."""
    s = 2j * np.pi * FREQUENCY[:, None, None]
    w = 2 * np.pi * natural
    return np.sum(strength * w**2 / (s**2 + 2 * damping * w * s + w**2), axis=1)


def travelling(phases: int = 24) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    turn = 2 * np.pi * np.arange(phases) / phases
    natural = np.array([1000 + 120 * np.sin(turn), 1600 + 40 * np.cos(turn)])
    damping = np.array([0.03 + 0.01 * np.cos(turn), np.full(phases, 0.02)])
    return natural, damping, np.array([[1.0], [0.4]])


def test_modes_of_a_rational_response() -> None:
    natural, damping, strength = travelling()
    found, ratio = itf_modes(FREQUENCY, resonances(natural, damping, strength))
    assert found == pytest.approx(natural, rel=3e-4)
    assert ratio == pytest.approx(damping, rel=0.02)


def test_modes_of_a_noisy_response() -> None:
    """25 % rms error of the ITF: natural frequency to 0.3 %, nothing invented between the modes."""
    natural, damping, strength = travelling(64)
    clean = resonances(natural, damping, strength)
    rng = np.random.default_rng(0)
    size = 0.25 * np.sqrt(np.mean(np.abs(clean) ** 2))
    noise = size * (rng.standard_normal(clean.shape) + 1j * rng.standard_normal(clean.shape)) / np.sqrt(2)
    found, ratio = itf_modes(FREQUENCY, clean + noise, np.full(clean.shape, size**2))
    assert found.shape == (2, 64)
    assert np.nanmedian(np.abs(found[0] / natural[0] - 1)) < 0.003
    # The output error leaves the damping ratio without bias; the linearised fit alone is 10 % low here.
    assert np.nanmean(ratio[0] / damping[0] - 1) == pytest.approx(0.0, abs=0.03)
    assert np.isnan(found[0]).sum() == 0


def test_at_most_the_wanted_modes() -> None:
    natural, damping, strength = travelling()
    response = resonances(natural, damping, strength)
    found, _ = itf_modes(FREQUENCY, response, modes=1)
    assert found == pytest.approx(natural[:1], rel=1e-3)
    assert itf_modes(FREQUENCY, response, modes=0)[0].shape == (0, 24)


def test_a_mode_that_fades_is_nan_there_and_keeps_its_row() -> None:
    natural, damping, strength = travelling()
    fading = np.ones(24)
    fading[5:9] = 0.0
    lower = strength * np.array([fading, np.ones(24)])
    found, _ = itf_modes(FREQUENCY, resonances(natural, damping, lower))
    assert found.shape == (2, 24)
    assert np.isnan(found[0, 5:9]).all()
    assert np.isfinite(found[0, [0, 4, 9, 20]]).all()
    assert found[1] == pytest.approx(natural[1], rel=2e-3)


def test_no_peak_no_mode() -> None:
    flat = np.ones((FREQUENCY.size, 8), dtype=complex) / (1 + FREQUENCY[:, None] / 1000)
    natural, damping = itf_modes(FREQUENCY, flat)
    assert natural.shape == damping.shape == (0, 8)


def test_fit_agrees_with_eigenvalues_on_the_frozen_reference_rig() -> None:
    phase = np.arange(32) / 32
    system = ReferenceRig().system(512)
    natural, damping = frozen_modes(system, phase)
    found, ratio = itf_modes(FREQUENCY, frozen_itf(system, FREQUENCY, phase), modes=1)
    assert found[0] == pytest.approx(natural[0], rel=2e-4)
    assert ratio[0] == pytest.approx(damping[0], rel=0.01)


def test_frozen_reference_mode_range() -> None:
    """The stated range of the reference: 1013 to 1231 Hz."""
    natural, _ = frozen_modes(ReferenceRig().system(2048), np.arange(2048) / 2048)
    assert (round(natural[0].min()), round(natural[0].max())) == (1013, 1231)


def test_overdamped_states_are_no_modes() -> None:
    w0 = 100.0
    a = np.zeros((1, 4, 4))
    a[0, :2, :2] = [[0.0, 1.0], [-(w0**2), -4 * w0]]  # damping ratio 2
    a[0, 2:, 2:] = [[0.0, 1.0], [-4 * w0**2, -0.4 * w0]]  # 2 w0, damping ratio 0.1
    natural, damping = frozen_modes(PeriodicSystem(1.0, a, np.ones(4), np.ones(4)), [0.0])
    assert natural[0, 0] == pytest.approx(200 / (2 * np.pi))
    assert damping[0, 0] == pytest.approx(0.1)
    assert np.isnan(natural[1, 0])


@pytest.mark.parametrize(("natural", "ratio"), [(1410.0, 0.29), (1300.0, 0.2), (1775.0, 0.33)])
def test_a_strongly_damped_mode_is_a_hump_and_is_found(natural: float, ratio: float) -> None:
    """Over-damped supports make the mesh mode so broad that it hardly stands out; closed-form oscillator and lag."""
    frequency = np.arange(2.0, 3000.0, 2.0)
    s, w = 2j * np.pi * frequency, 2 * np.pi * natural
    response = 1e-9 * w**2 / (s**2 + 2 * ratio * w * s + w**2) + 1e-10 / (1 + s / (2 * np.pi * 1500))
    found, damping = itf_modes(frequency, np.tile(response[:, None], (1, 2)))
    assert found[0] == pytest.approx(natural, rel=0.025)
    assert damping[0] == pytest.approx(ratio, rel=0.025)


def test_a_hump_within_the_noise_is_no_mode() -> None:
    frequency = np.arange(2.0, 3000.0, 2.0)
    noise = np.random.default_rng(4).standard_normal((2, frequency.size)) * 1e-10
    response = 1e-9 / (1 + 2j * np.pi * frequency / (2 * np.pi * 4000)) + noise[0] + 1j * noise[1]
    found, _ = itf_modes(frequency, np.tile(response[:, None], (1, 2)), np.full((frequency.size, 2), 2e-20))
    assert found.size == 0 or np.isnan(found).all()

"""The exact ITF: two formulations against each other, against time integration, and in its limits."""

import numpy as np
import pytest
from shared.reference_rig import ReferenceRig

from gearbench.identification.truth.harmonic_balance import harmonic_balance_itf
from gearbench.identification.truth.monodromy import exact_itf, floquet_multipliers
from gearbench.identification.truth.periodic import (
    PeriodicSystem,
    PeriodicSystemError,
    frozen_itf,
    htf_from_itf,
    itf_from_htf,
    truncation_error,
)

PHASES = np.arange(32) / 32
FREQUENCIES = np.array([150.0, 1010.0, 1190.0, 2300.0])


def oscillator(stiffness: np.ndarray, *, period: float, interpolation: str, mass: float = 1.0) -> PeriodicSystem:
    """m x'' + c x' + k(t) x = F, output x; 5 % damping at the mean stiffness."""
    k = np.asarray(stiffness, dtype=float)
    a = np.zeros((k.size, 2, 2))
    a[:, 0, 1] = 1.0
    a[:, 1, 0] = -k / mass
    a[:, 1, 1] = -0.1 * np.sqrt(k.mean() / mass)
    return PeriodicSystem(period, a, np.array([0.0, 1 / mass]), np.array([1.0, 0.0]), interpolation=interpolation)


def smooth(phase: np.ndarray) -> np.ndarray:
    return 4e7 * (1 + 0.3 * np.cos(2 * np.pi * phase) + 0.1 * np.sin(4 * np.pi * phase))


def relative(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


@pytest.mark.parametrize("mesh_frequency", [100.0, 450.0])
def test_monodromy_and_harmonic_balance_agree(mesh_frequency: float) -> None:
    grid = np.arange(64) / 64
    rig = ReferenceRig(mesh_frequency=mesh_frequency)
    # k(t) of few harmonics, in the whole six-state rig; also B, C of the rig and a feed-through.
    wave = smooth(grid)
    a, b, c = rig.matrices(np.zeros(grid.size))
    direction = np.array([1.0, 1.0, -1.0])
    a[:, 3:, :3] -= np.einsum("p,i,j->pij", wave / 4, direction / np.array([1.0, 2.0, 2.6]), direction)
    b = b * (1 + 0.2 * np.cos(2 * np.pi * grid))[:, None]
    system = PeriodicSystem(1 / mesh_frequency, a, b, c, d=2e-9, interpolation="trigonometric")
    first = exact_itf(system, FREQUENCIES, PHASES, steps=4096)
    second = harmonic_balance_itf(system, FREQUENCIES, PHASES, tolerance=1e-11)
    assert relative(first, second) < 1e-8


@pytest.mark.parametrize("mesh_frequency", [2.0, 50.0, 200.0])
def test_default_steps_are_good_to_five_millionths(mesh_frequency: float) -> None:
    system = oscillator(smooth(np.arange(64) / 64), period=1 / mesh_frequency, interpolation="trigonometric")
    truth = harmonic_balance_itf(system, FREQUENCIES, PHASES, tolerance=1e-11)
    assert relative(exact_itf(system, FREQUENCIES, PHASES), truth) < 5e-6


def test_smooth_monodromy_converges_with_order_four() -> None:
    system = oscillator(smooth(np.arange(64) / 64), period=1 / 200, interpolation="trigonometric")
    truth = harmonic_balance_itf(system, FREQUENCIES, PHASES, tolerance=1e-12)
    errors = [relative(exact_itf(system, FREQUENCIES, PHASES, steps=steps), truth) for steps in (64, 128, 256)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(4.0, abs=0.3)


@pytest.mark.validation
def test_piecewise_itf_against_runge_kutta() -> None:
    """Response to cos(w t) of a rectangular k(t), integrated until it repeats: Re of G exp(j w t)."""
    phases, period, frequency = 8, 1 / 160, 480.0
    k = np.where(np.arange(phases) < 5, 3e7, 5e7)
    system = oscillator(k, period=period, interpolation="piecewise")
    per_piece = 200
    step = period / phases / per_piece
    a, b = system.a, system.b
    x, trace = np.zeros(2), []
    for index in range(60 * phases * per_piece):
        piece = (index // per_piece) % phases
        t = index * step

        def slope(state: np.ndarray, time: float, piece: int = piece) -> np.ndarray:
            return a[piece] @ state + b[piece] * np.cos(2 * np.pi * frequency * time)

        if index >= 59 * phases * per_piece and index % per_piece == 0:
            trace.append((t, x[0]))
        k1 = slope(x, t)
        k2 = slope(x + step / 2 * k1, t + step / 2)
        k3 = slope(x + step / 2 * k2, t + step / 2)
        x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + slope(x + step * k3, t + step))
    time, response = np.array(trace).T
    itf = exact_itf(system, frequency, np.arange(phases) / phases)[0]
    assert response == pytest.approx((itf * np.exp(2j * np.pi * frequency * time)).real, abs=1e-7 * np.abs(itf).max())


def test_pieces_may_be_cut_anywhere() -> None:
    """Odd phases, and the same system on a finer grid, give the same ITF."""
    k = np.array([3e7, 3e7, 5e7, 4e7])
    coarse = oscillator(k, period=0.01, interpolation="piecewise")
    fine = oscillator(np.repeat(k, 6), period=0.01, interpolation="piecewise")
    phases = np.array([0.0, 0.1, 0.25, 0.777, 0.999])
    assert relative(exact_itf(coarse, FREQUENCIES, phases), exact_itf(fine, FREQUENCIES, phases)) < 1e-11


def test_defective_pieces_are_solved() -> None:
    """Critical damping: A has one eigenvector only; the answer is the closed form 1 / (s + w0)^2."""
    w0 = 300.0
    a = np.tile(np.array([[0.0, 1.0], [-(w0**2), -2 * w0]]), (4, 1, 1))
    system = PeriodicSystem(0.02, a, np.array([0.0, 1.0]), np.array([1.0, 0.0]))
    wanted = 1 / (2j * np.pi * FREQUENCIES + w0) ** 2
    assert relative(exact_itf(system, FREQUENCIES, PHASES), np.repeat(wanted[:, None], 32, axis=1)) < 1e-9
    assert relative(frozen_itf(system, FREQUENCIES, [0.3])[:, 0], wanted) < 1e-9


@pytest.mark.parametrize("interpolation", ["piecewise", "trigonometric"])
def test_time_invariant_system_has_its_transfer_function(interpolation: str) -> None:
    system = oscillator(np.full(8, 4e7), period=0.01, interpolation=interpolation)
    s = 2j * np.pi * FREQUENCIES
    wanted = 1 / (s**2 + 0.1 * np.sqrt(4e7) * s + 4e7)
    for itf in (exact_itf(system, FREQUENCIES, PHASES), frozen_itf(system, FREQUENCIES, PHASES)):
        assert relative(itf, np.repeat(wanted[:, None], 32, axis=1)) < 1e-10


def test_slow_variation_tends_to_the_frozen_transfer_function() -> None:
    errors = []
    for period in (0.5, 5.0):
        system = oscillator(smooth(np.arange(64) / 64), period=period, interpolation="trigonometric")
        frozen = frozen_itf(system, FREQUENCIES, PHASES)
        errors.append(relative(frozen, exact_itf(system, FREQUENCIES, PHASES)))
    assert errors[1] < 0.02
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)


def test_frozen_is_far_from_the_truth_on_the_reference_rig() -> None:
    """16 % rms at 2 Hz mesh and 5 % damping; 1013 to 1231 Hz is in test_modes."""
    rig = ReferenceRig()
    system = rig.system(2048)
    frequency, phase = np.arange(700.0, 2500.0, 20.0), np.arange(256) / 256
    exact = exact_itf(system, frequency, phase)
    assert relative(frozen_itf(system, frequency, phase), exact) == pytest.approx(0.16, abs=0.01)


def test_floquet_multipliers_of_a_constant_system() -> None:
    system = oscillator(np.full(4, 4e7), period=1e-3, interpolation="piecewise")
    wanted = np.exp(np.linalg.eigvals(system.a[0]) * 1e-3)
    found = floquet_multipliers(system)
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(wanted), rel=1e-9)


def test_unstable_system_is_refused() -> None:
    """Parametric resonance: k varies by 80 % at twice the natural frequency."""
    k = 4e7 * (1 + 0.8 * np.sign(np.cos(2 * np.pi * (np.arange(16) + 0.5) / 16)))
    system = oscillator(k, period=np.pi / np.sqrt(4e7), interpolation="piecewise")
    with pytest.raises(PeriodicSystemError, match=r"unstable.*multiplier 1\.\d+"):
        exact_itf(system, FREQUENCIES, PHASES)


def test_htf_and_itf_are_a_fourier_pair() -> None:
    rng = np.random.default_rng(0)
    htf = rng.standard_normal((7, 5)) + 1j * rng.standard_normal((7, 5))
    phase = np.arange(16) / 16
    wanted = sum(htf[n + 3][:, None] * np.exp(2j * np.pi * n * phase) for n in range(-3, 4))
    assert itf_from_htf(htf, 16) == pytest.approx(wanted, abs=1e-12)
    assert htf_from_itf(wanted, 3) == pytest.approx(htf, abs=1e-12)
    # Fewer phases than branches: still the sum at those phases.
    assert itf_from_htf(htf, 4) == pytest.approx(wanted[:, ::4], abs=1e-12)
    with pytest.raises(PeriodicSystemError, match=r"16 phases.*up to 8; 17"):
        htf_from_itf(wanted, 8)


def test_truncation_error_is_the_norm_of_what_is_left_out() -> None:
    rng = np.random.default_rng(1)
    htf = rng.standard_normal((9, 6)) + 1j * rng.standard_normal((9, 6))
    full = itf_from_htf(htf, 32)
    kept = itf_from_htf(htf[2:-2], 32)
    assert truncation_error(full, 2) == pytest.approx(relative(kept, full), rel=1e-12)
    assert truncation_error(full, 4) < 1e-14


def test_trigonometric_coefficients_pass_through_their_samples() -> None:
    """Even number of samples with content at half their rate; between them the closed form."""
    grid = np.arange(8) / 8
    wave = 4e7 * (1 + 0.2 * np.cos(2 * np.pi * grid) + 0.1 * np.cos(8 * np.pi * grid))
    system = oscillator(wave, period=0.01, interpolation="trigonometric")
    assert -system.at(grid)[0][:, 1, 0] == pytest.approx(wave)
    phase = np.array([0.03, 0.41])
    wanted = 4e7 * (1 + 0.2 * np.cos(2 * np.pi * phase) + 0.1 * np.cos(8 * np.pi * phase))
    assert -system.at(phase)[0][:, 1, 0] == pytest.approx(wanted)
    assert -system.at(grid + 0.03)[0][0, 1, 0] == pytest.approx(wanted[0])  # the uniform grid takes another way


def test_malformed_systems_are_refused() -> None:
    a = np.zeros((4, 2, 2))
    good = np.zeros(2)
    for kwargs, words in [
        ({"a": np.zeros((4, 2, 3)), "b": good, "c": good}, "a has shape"),
        ({"a": a, "b": np.zeros(3), "c": good}, "b has shape"),
        ({"a": a, "b": good, "c": good, "period": -1.0}, "period = -1 s"),
        ({"a": a * np.nan, "b": good, "c": good}, "a holds values"),
        ({"a": a, "b": good, "c": good, "interpolation": "linear"}, "'linear'"),
    ]:
        with pytest.raises(PeriodicSystemError, match=words):
            PeriodicSystem(**{"period": 1.0, **kwargs})
    with pytest.raises(PeriodicSystemError, match="piecewise"):
        harmonic_balance_itf(PeriodicSystem(1.0, a, good, good), 1.0, 0.0)

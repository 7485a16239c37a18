"""The compiled integrator against SciPy, closed forms and an energy balance."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from gearbench.lumped import Lumped, LumpedError, PairStiffness, tabulated_stiffness
from gearbench.lumped.linear.runge_kutta import Mesh, Tables, columns, integrate, tabulate

MESH = 100.0  # mesh frequency [Hz]


@dataclass(frozen=True)
class Smooth:
    """A stiffness without any kink [N/m]."""

    def at(self, phase: ArrayLike, *, finest: float = 0.0) -> np.ndarray:
        angle = 2 * np.pi * np.asarray(phase)
        return 1e8 * (1 + 0.3 * np.cos(angle) + 0.1 * np.sin(3 * angle))


def make_model(**changes: Any) -> Lumped:
    values: dict[str, Any] = {
        "mesh_mass": 1.3,
        "support_factor": 0.94,
        "masses": (2.0, 2.6),
        "support_stiffness": (3.2e8, 4.5e8),
        "support_damping": (900.0, 1500.0),
        "damping_ratio": 0.05,
        "stiffness": tabulated_stiffness([1e8, 1e8]),
    }
    return Lumped(**{**values, **changes})


def force_at(time: np.ndarray | float) -> np.ndarray:
    """A periodic force with two lines, period 1/MESH [N]."""
    angle = 2 * np.pi * MESH * np.asarray(time)
    return 1000 + 300 * np.cos(3 * angle + 0.4) + 200 * np.sin(11 * angle)


def run_period(model: Lumped, steps: int, *, constant: bool = False) -> np.ndarray:
    """State after one mesh period from the equilibrium under 1000 N, under `force_at` or 1000 N."""
    step = 1 / (MESH * steps)
    tables = tabulate(model, cycles=1, steps=steps, step=step)
    force = np.full(2, 1000.0) if constant else force_at(np.arange(2 * steps) * step / 2)
    state, _ = integrate(tables, force, model.equilibrium(1000.0), samples=steps, substeps=1)
    return state


def scipy_period(model: Lumped) -> np.ndarray:
    """The same by an eighth-order method on the equations written out once more."""
    me, g, (m1, m2) = model.mesh_mass, model.support_factor, model.masses
    (k1, k2), (c1, c2) = model.support_stiffness, model.support_damping
    amplitudes = np.array(model.error)
    orders = 2j * np.pi * np.arange(1, amplitudes.size + 1)

    def rate(time: float, s: np.ndarray) -> list[float]:
        k = float(model.stiffness.at(MESH * time))
        turning = amplitudes * np.exp(orders * MESH * time)
        error, speed = turning.sum().real, (turning * orders).sum().real * MESH
        c = 2 * 0.05 * np.sqrt(k * me)
        fm = k * (s[0] + g * (s[1] - s[2]) - error) + c * (s[3] + g * (s[4] - s[5]) - speed)
        return [
            *s[3:],
            (float(force_at(time)) - fm) / me,
            (-g * fm - c1 * s[4] - k1 * s[1]) / m1,
            (g * fm - c2 * s[5] - k2 * s[2]) / m2,
        ]

    start = model.equilibrium(1000.0)
    return solve_ivp(rate, (0, 1 / MESH), start, method="DOP853", rtol=1e-12, atol=1e-16).y[:, -1]


@pytest.mark.parametrize("error", [(), (2e-6 + 1e-6j, 0.5e-6j)])
def test_order_four_on_a_periodic_system(error: tuple[complex, ...]) -> None:
    model = make_model(stiffness=Smooth(), error=error)
    exact = scipy_period(model)
    scale = np.array([1e-6] * 3 + [1e-2] * 3)
    errors = [np.linalg.norm((run_period(model, n) - exact) / scale) for n in (512, 1024, 2048)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 4.0, atol=0.15)
    assert errors[-1] < 1e-4


def test_constant_stiffness_answers_a_sine_with_its_transfer_function() -> None:
    model, steps, line = make_model(), 1000, 9
    angle = 2 * np.pi * line * np.arange(2 * steps) / (2 * steps)
    tables = tabulate(model, cycles=1, steps=steps, step=1 / (MESH * steps))
    state = np.zeros(6)
    for _ in range(30):
        state, out = integrate(tables, 50 * np.cos(angle), state, samples=steps, substeps=1)
    dte = out[:, :3] @ model.output_vector[:3]
    response = 2 * np.mean(dte * np.exp(-1j * angle[::2])) / 50
    s = 2j * np.pi * line * MESH
    k = 1e8
    z = k + s * 2 * 0.05 * np.sqrt(k * 1.3)
    yx = 1 / (s**2 * 1.3)
    ys = 0.94**2 * (1 / (2.0 * s**2 + 900 * s + 3.2e8) + 1 / (2.6 * s**2 + 1500 * s + 4.5e8))
    assert response == pytest.approx(yx / (1 + z * (yx + ys)), rel=2e-4)
    # The mesh force is what accelerates the rest: F - m_e x'' at the line.
    force = 2 * np.mean(columns(out).mesh_force * np.exp(-1j * angle[::2])) / 50
    assert force == pytest.approx(z * response, rel=1e-6)


def test_free_decay_loses_exactly_what_the_dampers_take() -> None:
    model, step, k = make_model(), 2e-6, 1e8
    tables = tabulate(model, cycles=1, steps=2, step=step)
    g, me = model.support_factor, model.mesh_mass
    mass = np.array([me, *model.masses])
    dampers = np.array([*model.support_damping])
    mesh_damper = 2 * 0.05 * np.sqrt(k * me)

    def energy(s: np.ndarray) -> float:
        dte = s[0] + g * (s[1] - s[2])
        springs = 3.2e8 * s[1] ** 2 + 4.5e8 * s[2] ** 2
        return 0.5 * float(mass @ s[3:] ** 2 + k * dte**2 + springs)

    def power(s: np.ndarray) -> float:
        rate = s[3] + g * (s[4] - s[5])
        return float(dampers @ s[4:] ** 2 + mesh_damper * rate**2)

    state = model.equilibrium(2000.0)
    energies, powers = [energy(state)], [power(state)]
    for _ in range(2000):
        state, _ = integrate(tables, np.zeros(2), state, samples=1, substeps=1)
        energies.append(energy(state))
        powers.append(power(state))
    lost = energies[0] - energies[-1]
    assert lost > 0.5 * energies[0]
    taken = step / 3 * (powers[0] + 4 * sum(powers[1:-1:2]) + 2 * sum(powers[2:-1:2]) + powers[-1])
    assert lost == pytest.approx(taken, rel=1e-6)


def test_equilibrium_stays_under_its_force() -> None:
    model = make_model()
    tables = tabulate(model, cycles=1, steps=100, step=1e-5)
    start = model.equilibrium(1500.0)
    state, out = integrate(tables, np.full(2, 1500.0), start, samples=500, substeps=2)
    np.testing.assert_allclose(state, start, atol=1e-15)
    np.testing.assert_allclose(columns(out).mesh_force, 1500.0, rtol=1e-9)


def test_slow_mesh_follows_stiffness_and_transmission_error() -> None:
    # Quasi-static limit: dte = F / k(phase) + e(phase). Mesh at 0.2 Hz against modes near 1 kHz.
    model = make_model(stiffness=Smooth(), error=(3e-6,), damping_ratio=0.3)
    steps = 2**18
    tables = tabulate(model, cycles=1, steps=steps, step=5.0 / steps)
    _, out = integrate(
        tables, np.full(2, 2000.0), model.equilibrium(2000.0), samples=steps // 64, substeps=64
    )
    phase = np.arange(steps // 64) / (steps // 64)
    expected = 2000.0 / model.stiffness.at(phase) + 3e-6 * np.cos(2 * np.pi * phase)
    dte = out[:, :3] @ model.output_vector[:3]
    assert np.abs(dte - expected).max() < 1e-3 * np.ptp(expected)


def test_pieces_of_a_run_join_without_a_seam() -> None:
    model, steps = make_model(stiffness=Smooth()), 600
    step = 1 / (MESH * steps)
    tables = tabulate(model, cycles=1, steps=steps, step=step)
    force = force_at(np.arange(2 * steps) * step / 2)
    start = model.equilibrium(1000.0)
    whole, outputs = integrate(tables, force, start, samples=250, substeps=4)
    half, first = integrate(tables, force, start, samples=100, substeps=4)
    joined, second = integrate(tables, force, half, samples=150, substeps=4, first_step=400)
    np.testing.assert_array_equal(joined, whole)
    np.testing.assert_array_equal(np.concatenate([first, second]), outputs)
    np.testing.assert_array_equal(start, model.equilibrium(1000.0))


def test_tables_cover_mesh_periods_that_hold_no_whole_number_of_steps() -> None:
    # Three mesh periods in 2000 steps (666.7 a period), and the force over the same time.
    model = make_model(stiffness=Smooth())
    steps, step = 2000, 3 / (MESH * 2000)
    tables = tabulate(model, cycles=3, steps=steps, step=step)
    force = force_at(np.arange(2 * steps) * step / 2)
    state, _ = integrate(tables, force, model.equilibrium(1000.0), samples=steps, substeps=1)
    fine = model.equilibrium(1000.0)
    for _ in range(3):
        step = 1 / (MESH * 4000)
        tables = tabulate(model, cycles=1, steps=4000, step=step)
        force = force_at(np.arange(8000) * step / 2)
        fine, _ = integrate(tables, force, fine, samples=4000, substeps=1)
    np.testing.assert_allclose(state[:3], fine[:3], rtol=3e-4)


def sharp_period(model: Lumped, switches: list[float]) -> np.ndarray:
    """State after one mesh period under 1000 N with k constant between switches: exponentials."""
    state = model.equilibrium(1000.0)
    edges = [0.0, *sorted(switches), 1.0]
    for start, stop in pairwise(edges):
        a = model.state_matrix(float(model.stiffness.at((start + stop) / 2)))
        rest = -np.linalg.solve(a, model.input_vector * 1000.0)
        state = rest + expm(a * (stop - start) / MESH) @ (state - rest)
    return state


def test_sharp_switches_keep_their_instant() -> None:
    """Unless widened to the grid, a switch snaps to it: ten times these errors, falling slower than h."""
    rng = np.random.default_rng(3)
    errors = []
    for _ in range(12):
        first, last = -0.35 + 0.05 * rng.random(), 0.8 + 0.05 * rng.random()
        model = make_model(stiffness=PairStiffness(np.array([first, last]), np.full(2, 0.8e8)))
        exact = sharp_period(model, [first % 1.0, last])
        errors.append([np.abs(run_period(model, n, constant=True) - exact)[:3].max() for n in (700, 2800)])
    coarse, fine = np.sqrt(np.mean(np.square(errors), axis=0)) / (1000.0 / 0.8e8)
    assert coarse < 1e-3
    assert fine < coarse / 6


@pytest.mark.parametrize("entries", [0, 3])
def test_odd_and_empty_tables_are_refused(entries: int) -> None:
    model = make_model()
    tables = tabulate(model, cycles=1, steps=2, step=1e-6)
    with pytest.raises(LumpedError, match=f"force table has {entries} entries"):
        integrate(tables, np.zeros(entries), np.zeros(6), samples=1, substeps=1)
    broken = Tables(Mesh(*np.zeros((3, entries))), tables.parameters, tables.step)
    with pytest.raises(LumpedError, match=f"mesh table has {entries} entries"):
        integrate(broken, np.zeros(2), np.zeros(6), samples=1, substeps=1)


def test_steps_that_are_too_long_are_reported() -> None:
    model = make_model()
    tables = tabulate(model, cycles=1, steps=2, step=1e-3)
    with pytest.raises(LumpedError, match="integration overflowed"):
        integrate(tables, np.ones(2), np.zeros(6), samples=1000, substeps=1)

"""The non-linear model with every effect at once against plainly written equations, and without any against the linear
model."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import pairwise
from math import acos, cos, pi, sin, tanh
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from shared.effect_rig import GEARS, MASSES, PATH, ZETA, along_line_of_action, make_model, make_rig, run
from shared.hat_mesh import ALPHA, BASE_PITCH, BEND, BENDING, PHASES, PITCH_ROLL, RADII, TOP, hat, hat_law, stiffness

from gearbench.lumped import Lumped, LumpedError, tabulated_stiffness
from gearbench.lumped.linear.runge_kutta import integrate as integrate_linear
from gearbench.lumped.linear.runge_kutta import tabulate
from gearbench.lumped.nonlinear.coordinates import COORDINATES
from gearbench.lumped.nonlinear.step import columns, integrate
from gearbench.lumped.nonlinear.tables import Motion, instants, tables
from gearbench.rig import (
    Coupling,
    Crack,
    Damping,
    Drive,
    Friction,
    Load,
    MeshCorrection,
    Rig,
    Ripple,
    Support,
    Supports,
)

Array = NDArray[np.float64]


def rich_rig(boundary: str) -> Rig:
    """A rig with every effect at once."""
    rng = np.random.default_rng(5)
    return make_rig(
        driver={"pitch_error": tuple(rng.normal(0, 3e-6, 20)), "runout": 6e-6, "runout_phase": 1.0},
        driven={
            "pitch_error": tuple(rng.normal(0, 3e-6, 30)),
            "runout": 3.5e-6,
            "runout_phase": -0.4,
            "crack": Crack(tooth=1, stiffness_loss=0.5),
        },
        support=Supports(
            driver=Support(stiffness=1e8, damping=3e3, exponent=0.35, reference_deflection=8e-6),
            driven=Support(stiffness=1.4e8, damping=2e3, exponent=0.2),
        ),
        drive=Drive(
            coupling=Coupling(inertia=2e-3, stiffness=9e3, damping=0.6),
            ripple=Ripple(orders=(6, 13), amplitude=(3.0, 2.0), phase=(0.5, -1.1)),
        ),
        load=Load(boundary=boundary),
        friction=Friction(coefficient=0.06, transition_speed=20e-3),
        damping=Damping(mesh_ratio=ZETA, mesh_exponent=0.7, mesh_reference_force=2e3),
        mesh=MeshCorrection(
            stiffness_scale=1.1,
            stiffness_cos=(0.05, 0.02),
            stiffness_sin=(-0.03, 0.01),
            error_mean=2e-6,
            error_cos=(1e-6,),
            error_sin=(-0.5e-6,),
        ),
    )


def pair_stiffness(phase: float, n: int) -> float:
    """That of pair n [N/m], between the phases of the law's tables as these are read."""
    low, weight = divmod(phase * PHASES, 1.0)
    first, second = in_row(low, n), in_row(low + 1, n)
    return first + weight * (second - first)


@cache
def in_row(row: float, n: int) -> float:
    return float(stiffness(row / PHASES) * hat(row / PHASES - n))


def plain_equations(rig: Rig, mesh_frequency: float, torque: Callable[[float], float]) -> Callable[..., list[float]]:
    """Right-hand side for u1, y1, y2, u2, w and their rates, written from the equations and nothing else."""
    (r1, r2), (m1, m2), (j1, j2) = RADII, MASSES, GEARS
    coupling, ripple, mesh, friction = rig.drive.coupling, rig.drive.ripple, rig.mesh, rig.friction
    assert coupling is not None and ripple is not None and coupling.stiffness is not None
    spring, shaft_damping = coupling.stiffness, coupling.damping
    crack = rig.driven.crack
    assert crack is not None
    free = rig.load.boundary == "torque"
    both = GEARS[0] + coupling.inertia
    m_e = both * j2 / (both * r2**2 + j2 * r1**2) if free else both / r1**2
    speed1, speed2 = 2 * pi * mesh_frequency / 20, 2 * pi * mesh_frequency / 30

    def material(t: float) -> float:
        phase = mesh_frequency * t
        total = mesh.error_mean + mesh.error_cos[0] * cos(2 * pi * phase) + mesh.error_sin[0] * sin(2 * pi * phase)
        for gear, speed in ((rig.driver, speed1), (rig.driven, speed2)):
            total += gear.runout / 2 * cos(speed * t - gear.runout_phase)
        return total

    def leaning(t: float) -> tuple[float, float, float, float]:
        """What run-out does with gears whose centres stand off their axes: how far [cycles] it turns the mesh on, the
        turn [rad] of the line of action that touches both base circles, and the levers [m] of the force about the
        axes."""
        angles = (speed1 * t - rig.driver.runout_phase, pi - speed2 * t + rig.driven.runout_phase)
        one, two = (
            gear.runout / 2 * np.exp(1j * (pi / 2 - ALPHA + angle))
            for gear, angle in zip((rig.driver, rig.driven), angles, strict=True)
        )
        apart = sum(RADII) / cos(ALPHA) + two - one
        tilt = float(np.angle(apart)) - acos(sum(RADII) / abs(apart)) + ALPHA
        normal = np.exp(1j * (pi / 2 - ALPHA))
        proud = float(((one - two) * np.conj(normal)).real)
        begin, end = r2 * tilt / BASE_PITCH, -(proud + r1 * tilt) / BASE_PITCH
        # Pairs begin at 0.2 and end at 0.8 of the cycle.
        near = float(np.interp(mesh_frequency * t % 1.0, (-0.2, 0.2, 0.8, 1.2), (1.0, 0.0, 1.0, 0.0)))
        levers = [float((np.conj(centre) * normal).imag) for centre in (one, two)]
        return begin + near * (end - begin), tilt, r1 + levers[0], r2 - levers[1]

    def rates(t: float, q: Array) -> list[float]:
        u1, y1, y2, u2, w, v1, vy1, vy2, v2, vw = q
        phase = mesh_frequency * t
        late, early = material(t + 1e-7), material(max(t - 1e-7, 0.0))
        turned, turn, arm1, arm2 = leaning(t)
        along, part1, part2 = cos(ALPHA - turn), arm1 / r1, arm2 / r2
        delta = part1 * u1 - part2 * u2 + along * (y1 - y2) + material(t)
        closing = part1 * v1 - part2 * v2 + along * (vy1 - vy2) + (late - early) / (1e-7 + min(t, 1e-7))
        gain = mesh.stiffness_scale * (
            1
            + sum(c * cos(2 * pi * (n + 1) * phase) for n, c in enumerate(mesh.stiffness_cos))
            + sum(s * sin(2 * pi * (n + 1) * phase) for n, s in enumerate(mesh.stiffness_sin))
        )
        levers, elastic, tangent = [0.0, 0.0, 0.0], 0.0, 0.0
        # Seen from the line of centres, which their motion turns, the driven gear turns back.
        first, tilt = int(phase), (y1 - y2) * cos(ALPHA) / sum(RADII)
        phase += turned - r2 * tilt / BASE_PITCH
        for n in range(first - 1, first + 3):
            share = float(hat(phase - n))
            k = pair_stiffness(phase, n) * gain
            if n % 30 == crack.tooth:
                k /= 1 + BENDING[1] * (1 / (1 - crack.stiffness_loss) - 1)
            own = max(delta + rig.driver.pitch_error[n % 20] + rig.driven.pitch_error[n % 30], 0.0)
            elastic += k * own * (1 + BEND * (own / TOP) ** 0.5)
            tangent += k * (1 + 1.5 * BEND * (own / TOP) ** 0.5) * (own > 0)
            path = (phase - n) * BASE_PITCH
            roll1, roll2 = PITCH_ROLL[0] + path, PITCH_ROLL[1] - path
            sliding = path * (speed1 + speed2) + roll1 * v1 / r1 - roll2 * v2 / r2 + (vy1 - vy2) * sin(ALPHA)
            slides = tanh(sliding / friction.transition_speed)
            levers[0] += share * slides * roll1
            levers[1] += share * slides
            levers[2] += share * slides * roll2
        force = 0.0
        if elastic > 0:
            damper = 2 * ZETA * (tangent * m_e) ** 0.5 * (elastic / 2e3) ** 0.7
            force = max(elastic + damper * closing, 0.0)
        rub = friction.coefficient * force
        drive = torque(t) + sum(
            a * cos(o * speed1 * t + p) for o, a, p in zip(ripple.orders, ripple.amplitude, ripple.phase, strict=True)
        )
        twist = spring * (w - u1) / r1 + shaft_damping * (vw - v1) / r1  # torque through the coupling
        balanced = r2 / r1 * (torque(t) - rub * levers[0] - arm1 * force) + arm2 * force + rub * levers[2]
        supports = [
            s.stiffness * y * (abs(y) / s.reference_deflection) ** s.exponent + s.damping * v
            for s, y, v in ((rig.support.driver, y1, vy1), (rig.support.driven, y2, vy2))
        ]
        across = force * along + rub * levers[1] * sin(ALPHA)
        return [
            v1,
            vy1,
            vy2,
            v2,
            vw,
            r1 / j1 * (twist - arm1 * force - rub * levers[0]),
            (-across - supports[0]) / m1,
            (across - supports[1]) / m2,
            r2 / j2 * (arm2 * force + rub * levers[2] - balanced) if free else 0.0,
            r1 / coupling.inertia * (drive - twist),
        ]

    return rates


@pytest.mark.parametrize("boundary", ["speed", pytest.param("torque", marks=pytest.mark.validation)])
def test_a_rig_with_every_effect_follows_the_plain_equations(boundary: str) -> None:
    """Run-out to first order: what is left goes with its square, 1e-6 for 12 um."""
    rig = rich_rig(boundary)
    model = make_model(rig)

    def torque(t: Any) -> Any:
        return 100.0 + 20 * np.sin(2 * pi * 700 * t) + 10 * np.sin(2 * pi * 1900 * t + 1)

    first = tables(model, Motion(cycles=1.0, entries=2, step=1.0))
    state = model.equilibrium(float(torque(0.0)) / RADII[0], instants(model, first, 1))
    frequency, cycles, steps = 100.0, 2.0, 51200
    time, out = run(model, lambda t: torque(t) / RADII[0], state, mesh_frequency=frequency, cycles=cycles, steps=steps)
    assert out.mesh_force.min() > 0
    motion = np.stack(out[:COORDINATES], axis=1)
    # Whole phases are kinks of the hats, and the ends of contact: the reference does not step over them.
    plain = plain_equations(rig, frequency, torque)
    kinks = [n + place for n in range(int(cycles)) for place in (0.0, *(end % 1.0 for end in PATH))]
    for first_kink, next_kink in pairwise([*kinks, cycles]):
        span = first_kink / frequency, next_kink / frequency
        part = (time >= span[0]) & (time < span[1])
        found = solve_ivp(plain, span, state, "DOP853", dense_output=True, rtol=1e-9, atol=1e-14, max_step=2e-4)
        error = np.abs(found.sol(time[part]).T[:, :COORDINATES] - motion[part]).max(axis=0)
        assert np.all(error <= 1e-6 * np.ptp(motion, axis=0)), error
        state = found.y[:, -1]


@pytest.mark.parametrize("boundary", ["speed", "torque"])
def test_without_effects_it_is_the_linear_model(boundary: str) -> None:
    # Along the line of action: there the linear model's fixed phase is that of the mesh.
    model = make_model(along_line_of_action(make_rig(load=Load(boundary=boundary))), hat_law(bend=0.0))
    steps, cycles, frequency = 4096, 4.0, 100.0
    step = cycles / frequency / steps
    time = np.arange(2 * steps) * step / 2
    force = 3500 + 800 * np.sin(2 * pi * 650 * time)
    supports = (model.rig.support.driver, model.rig.support.driven)
    linear = Lumped(
        mesh_mass=model.mesh_mass,
        support_factor=1.0,
        masses=MASSES,
        support_stiffness=(supports[0].stiffness, supports[1].stiffness),
        support_damping=(supports[0].damping, supports[1].damping),
        damping_ratio=ZETA,
        stiffness=tabulated_stiffness(stiffness(np.arange(PHASES) / PHASES)),
    )
    state = linear.equilibrium(3500.0)
    _, expected = integrate_linear(
        tabulate(linear, cycles=int(cycles), steps=steps, step=step), force, state, samples=steps, substeps=1
    )
    start = np.array([*state[:3], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    table = tables(model, Motion(cycles, 2 * steps, step))
    _, samples = integrate(model, table, force, start, step=step, substeps=1, mesh_frequency=frequency)
    out = columns(samples)
    np.testing.assert_allclose(out.u1 - out.u2, expected[:, 0], rtol=1e-9)
    np.testing.assert_allclose(out.y1, expected[:, 1], rtol=1e-9)
    np.testing.assert_allclose(out.y2, expected[:, 2], rtol=1e-9)
    np.testing.assert_allclose(out.mesh_force, expected[:, 3], rtol=1e-9)
    if boundary == "torque":
        # Nothing turns both gears the same way.
        common = out.u1 * model.masses[0] + out.u2 * model.masses[1]
        assert np.ptp(common) < 1e-14


def test_runs_of_consecutive_stretches_are_one_run() -> None:
    model = make_model(rich_rig("speed"))
    step, steps = 1e-5, 3600
    force = 3500 + 300 * np.sin(2 * pi * np.arange(2 * steps) / (2 * steps))
    whole = tables(model, Motion(3.0, 2 * steps, step, 0.25))
    state = np.array([2e-5, -3e-5, 2e-5, 0.0, 4e-5, 0, 0, 0, 0, 0])
    how = {"step": step, "substeps": 3, "mesh_frequency": 3.0 / (steps * step)}
    end, out = integrate(model, whole, force, state, **how)
    middle, first = integrate(model, tables(model, Motion(1.0, 2 * steps // 3, step, 0.25)), force, state, **how)
    table = tables(model, Motion(2.0, 4 * steps // 3, step, 1.25))
    again, second = integrate(model, table, force, middle, first_entry=2 * steps // 3, **how)
    np.testing.assert_allclose(np.concatenate([first, second]), out, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(again, end, rtol=1e-7, atol=1e-12)


def test_tables_that_do_not_fit_and_overflow_are_refused() -> None:
    model = make_model(make_rig())
    table = tables(model, Motion(1.0, 100, 1e-5))
    with pytest.raises(LumpedError, match="do not hold whole samples"):
        integrate(model, table, np.zeros(10), np.zeros(10), step=1e-5, substeps=3, mesh_frequency=2e3)
    with pytest.raises(LumpedError, match=r"shape \(6,\), not \(10,\)"):
        integrate(model, table, np.zeros(10), np.zeros(6), step=1e-5, substeps=5, mesh_frequency=2e3)
    coarse = tables(model, Motion(1.0, 20000, 1.0))
    with pytest.raises(LumpedError, match="overflowed"):
        integrate(model, coarse, np.full(10, 3e3), np.zeros(10), step=1.0, substeps=5, mesh_frequency=1e-4)


def test_teeth_that_hardly_differ_move_as_those_that_do_not() -> None:
    """Run-out and the centres' motion turn the mesh across the ends of its cycle, where friction turns round."""
    sound = {"friction": Friction(coefficient=0.06, transition_speed=5e-3), "load": Load(boundary="torque")}
    motions = []
    for errors in ((), (1e-13, *np.zeros(19))):
        rig = make_rig(driver={"pitch_error": errors, "runout": 8e-6}, driven={"runout": 5e-6}, **sound)
        model = make_model(rig)
        first = tables(model, Motion(cycles=1.0, entries=2, step=1.0))
        state = model.equilibrium(1e3, instants(model, first, 1))
        _, out = run(
            model, lambda t: 1e3 + 400 * np.sin(2 * pi * 300 * t), state, mesh_frequency=100.0, cycles=5.0, steps=20000
        )
        motions.append(np.stack([*out[:COORDINATES], out.mesh_force], axis=1))
    alike, apart = motions
    assert np.all(np.abs(apart - alike).max(axis=0) <= 1e-7 * np.ptp(alike, axis=0) + 1e-12)

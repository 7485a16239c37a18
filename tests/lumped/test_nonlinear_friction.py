"""Friction of the non-linear lumped model: against closed forms of the steady rotation, and under vibration that slides
faster than it."""

from __future__ import annotations

from dataclasses import replace
from math import asin, cos, pi, sin, tan

import numpy as np
import pytest
from numpy.typing import NDArray
from shared.effect_rig import FORCE, GEARS, MASSES, along_line_of_action, make_model, make_rig, run, steady_dte
from shared.hat_mesh import ALPHA, BASE_PITCH, PITCH_ROLL, RADII, hat, hat_law

from gearbench.lumped.nonlinear.coordinates import COORDINATES, Coordinates
from gearbench.lumped.nonlinear.model import NonLinear
from gearbench.lumped.nonlinear.pressing import alike
from gearbench.lumped.nonlinear.step import columns, integrate
from gearbench.lumped.nonlinear.tables import Motion, tables
from gearbench.rig import Friction, Load

Array = NDArray[np.float64]

SPEEDS_PER_HERTZ = 2 * pi * (1 / 20 + 1 / 30)  # of both shafts [rad/s] per mesh frequency [Hz]


@pytest.mark.parametrize("boundary", ["speed", "torque"])
def test_friction_takes_what_its_sliding_dissipates(boundary: str) -> None:
    mu, v0, frequency = 0.08, 20e-3, 50.0
    rig = make_rig(friction=Friction(coefficient=mu, transition_speed=v0), load=Load(boundary=boundary))
    model = make_model(rig, hat_law(swing=0.0, bend=0.0))
    state = model.equilibrium(FORCE, alike(0.0))
    _, out = run(model, lambda t: np.full(t.shape, FORCE), state, mesh_frequency=frequency, cycles=60.0, steps=60000)
    speeds = 2 * pi * frequency / 20, 2 * pi * frequency / 30
    power = speeds[0] * FORCE * RADII[0] - speeds[1] * RADII[1] * out.load_force[-30000:].mean()
    # Normal force times mu times sliding speed of both pairs, over one cycle; the gears hardly vibrate.
    phase = (np.arange(4000) + 0.5) / 4000
    loss = np.zeros_like(phase)
    for number in (0, 1):
        speed = (phase - number) * BASE_PITCH * sum(speeds)
        loss += hat(phase - number) * mu * speed * np.tanh(speed / v0)
    normal = out.mesh_force[-30000:].reshape(-1, 1000).mean(axis=0)
    force = np.interp(phase, np.arange(1000) / 1000, normal, period=1.0)
    assert power == pytest.approx(float((force * loss).mean()), rel=1e-3)
    assert power > 0


def test_friction_makes_the_normal_force_jump_at_the_pitch_point() -> None:
    # With moments about the driver: T1 = N (rb1 + mu s rho1), s = -1 before and +1 after the pitch point.
    mu = 0.06
    _, still = steady_dte(make_rig())
    phase, dte = steady_dte(make_rig(friction=Friction(coefficient=mu, transition_speed=4e-4)), frequency=10.0)
    # The flanks stick for a while behind the pitch point: that long does the steady sliding take to overtake the jump.
    before, after = (dte[np.argmin(np.abs(phase - at))] for at in (30.0 - 0.1, 30.0 + 0.1))
    lever = PITCH_ROLL[0] / RADII[0]

    def share_of_sliding(away: float) -> float:
        # One pair at `away`, the other one nearly a cycle off on the other side.
        first = float(hat(away)) * np.sign(away) * (PITCH_ROLL[0] + away * BASE_PITCH)
        other = away - np.sign(away)
        return float((first + hat(other) * np.sign(other) * (PITCH_ROLL[0] + other * BASE_PITCH)) / RADII[0])

    for found, away in ((before, -0.1), (after, 0.1)):
        assert found == pytest.approx(FORCE / 3e8 / (1 + mu * share_of_sliding(away)), rel=2e-3)
    assert before - after == pytest.approx(2 * mu * lever * (1 - 2 * 0.1) * FORCE / 3e8, rel=0.05)
    assert np.ptp(still) < 1e-3 * (before - after)
    assert lever == pytest.approx(tan(ALPHA), rel=1e-3)


def kick(model: NonLinear, state: Array, frequency: float, phase: float) -> tuple[Array, float]:
    """Accelerations of u1, y1, y2, u2 and mesh force at an instant, by a step too short for anything to move."""
    step = 1e-9
    table = tables(model, Motion(cycles=frequency * step, entries=2, step=step, first_phase=phase))
    end, out = integrate(model, table, np.full(2, FORCE), state, step=step, substeps=1, mesh_frequency=frequency)
    rate = Coordinates(*(end - state)[COORDINATES:])
    return np.array([rate.u1, rate.y1, rate.y2, rate.u2]) / step, float(columns(out).mesh_force[0])


@pytest.mark.parametrize("direction", ["tangential", "line-of-action"])
def test_friction_of_every_pair_acts_against_its_own_sliding_velocity(direction: str) -> None:
    mu, v0, frequency, phase = 0.1, 50e-3, 5.0, 7.25  # a quarter of a cycle behind the pitch point
    sound, rubs = make_rig(load=Load(boundary="speed")), Friction(coefficient=mu, transition_speed=v0)
    if direction == "line-of-action":
        sound = along_line_of_action(sound)
    slide = sin(ALPHA) if direction == "tangential" else 0.0
    for rates in np.random.default_rng(3).normal(0, 0.05, (8, 4)) * [1, 1, 1, 0]:
        state = np.r_[3e-5, -1e-5, 1e-5, 0.0, 0.0, rates, 0.0]
        without, force = kick(make_model(sound), state, frequency, phase)
        found, same = kick(make_model(sound.model_copy(update={"friction": rubs})), state, frequency, phase)
        assert same == force > 0
        expected, power = np.zeros(3), 0.0
        # The driver's centre lies 20 um behind: seen from the line of centres the driven gear is ahead.
        ahead = 2e-5 * cos(ALPHA) * RADII[1] / sum(RADII) if direction == "tangential" else 0.0
        turned = phase + ahead / BASE_PITCH
        for number in (7, 8):
            roll1 = PITCH_ROLL[0] + (turned - number) * BASE_PITCH
            roll2 = PITCH_ROLL[1] - (turned - number) * BASE_PITCH
            turning = 2 * pi * frequency / 20 + rates[0] / RADII[0], 2 * pi * frequency / 30
            velocity = roll1 * turning[0] - roll2 * turning[1] + (rates[1] - rates[2]) * slide
            rub = mu * force * float(hat(turned - number)) * np.tanh(velocity / v0)
            expected += rub * np.array([-roll1 / RADII[0], -slide, slide])
            power += rub * velocity
        masses = np.array([GEARS[0] / RADII[0] ** 2, *MASSES])
        np.testing.assert_allclose((found - without)[:3] * masses, expected, atol=1e-5 * mu * force)
        assert power > 0


def reaction(model: NonLinear, swing: float, frequency: float, line: float) -> tuple[Array, Array]:
    """Mesh phase over a cycle and, there, friction on the driven rotation per normal force, under an excitation."""
    time, out = run(
        model,
        lambda t: FORCE + swing * np.sin(2 * pi * line * t),
        model.equilibrium(FORCE, alike(0.0)),
        mesh_frequency=frequency,
        cycles=4.0,
        steps=max(4 * 4000, round(8e5 / frequency)),
    )
    last = slice(-(len(time) // 4), None)
    assert out.mesh_force[last].min() > 0
    return time[last] * frequency % 1.0, out.load_force[last] / out.mesh_force[last] - 1


@pytest.mark.parametrize(
    ("frequency", "swing", "alike"), [(50.0, 0.0, True), (5000.0, 800.0, True), (50.0, 800.0, False)]
)
def test_small_vibration_or_high_speed_leaves_the_direction_of_the_steady_rotation(
    frequency: float, swing: float, alike: bool
) -> None:
    friction = Friction(coefficient=0.05, transition_speed=20e-3)
    law = hat_law(swing=0.0, bend=0.0)
    model = make_model(make_rig(friction=friction, load=Load(boundary="speed")), law)
    phase, found = reaction(model, swing, frequency, 1900.0)
    steady = 0.05 * law.friction(phase, 20e-3 / (SPEEDS_PER_HERTZ * frequency))[2] / RADII[1]
    departure = np.abs(found - steady).mean() / np.abs(steady).mean()
    assert (departure < 0.03) == alike, departure
    assert alike or departure > 0.1


@pytest.mark.parametrize("away", [0.3, 0.5])
def test_vibration_turns_dry_friction_into_a_smaller_mean_force(away: float) -> None:
    # One pair carries all, supports are along the line of action: the driver swings about v = away BASE_PITCH times
    # both speeds at V sin(wt), and the mean sign of v + V sin(wt) over a swing is (2/pi) asin(v/V).
    mu, frequency, line = 0.01, 5.0, 4000.0
    rig = make_rig(friction=Friction(coefficient=mu, transition_speed=5e-4), load=Load(boundary="speed"))
    law = hat_law(swing=0.0, bend=0.0)
    alone = law.force[..., None] * (law.offsets == 0)
    model = make_model(along_line_of_action(rig), replace(law, parts=alone))
    steps, swings = 400, 40
    step = 1 / line / steps
    motion = Motion(cycles=frequency * swings / line, entries=2 * swings * steps, step=step, first_phase=away)
    force = FORCE + 700 * np.sin(2 * pi * np.arange(2 * steps) / (2 * steps))
    state = model.equilibrium(FORCE, alike(away))
    _, out = integrate(model, tables(model, motion), force, state, step=step, substeps=1, mesh_frequency=frequency)
    last = columns(out[swings // 2 * steps :])
    assert last.mesh_force.min() > 0
    middle = away + 0.75 * motion.cycles
    lever = mu * (PITCH_ROLL[1] - middle * BASE_PITCH) / RADII[1]
    drift = middle * BASE_PITCH * SPEEDS_PER_HERTZ * frequency
    swing = (PITCH_ROLL[0] + middle * BASE_PITCH) / RADII[0] * float(np.ptp(np.gradient(last.u1, step))) / 2
    mean = float((last.load_force / last.mesh_force - 1).mean()) / lever
    assert drift < 0.7 * swing
    assert mean == pytest.approx(2 / pi * asin(drift / swing), rel=0.03)
    assert mean < 0.6  # 1 without vibration


def test_friction_that_turns_round_fast_asks_for_shorter_steps() -> None:
    slow, fast = (
        make_model(make_rig(friction=Friction(coefficient=0.1, transition_speed=v0), load=Load(boundary="torque")))
        for v0 in (5e-2, 1e-5)
    )
    assert slow.fastest_rate(FORCE) == make_model(make_rig(load=Load(boundary="torque"))).fastest_rate(FORCE)
    # A damper mu N / v0 along the flank, on both rotations and both centres.
    yielding = tan(ALPHA) ** 2 * (RADII[0] ** 2 / GEARS[0] + RADII[1] ** 2 / GEARS[1])
    yielding += sin(ALPHA) ** 2 * (1 / MASSES[0] + 1 / MASSES[1])
    damper = 0.1 * float(hat_law().force.max()) / 1e-5
    assert fast.friction_rate() == pytest.approx(damper * yielding, rel=1e-6)
    assert fast.fastest_rate(FORCE) > 0.1 * fast.friction_rate()

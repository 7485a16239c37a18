"""The jump of a sweep by a second formulation: the equations of docs/physics.md, "Non-linear lumped model", anew for
one spring that parts, with the stiffness over mesh phase that statics find."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from shared.rectangular import ONE_SPRING, SUPPORT

from gearbench.bench.record.attributes import bodies_of
from gearbench.bench.statics import static
from gearbench.bench.sweep import sweep
from gearbench.cases import case_path
from gearbench.geometry import pair
from gearbench.kernels.compiled import compiled
from gearbench.rig import read_case

Array = NDArray[np.float64]

DAMPER, RATIO = 1e3, 0.008
SETTINGS = (*ONE_SPRING, f"rig.support.damping_n_s_per_m={DAMPER}", f"rig.damping.mesh_ratio={RATIO}")
STEPS = 400  # a mesh period
WAIT, LOOK = 600, 64  # mesh periods


@compiled
def rates(s: Array, phase: float, k: Array, force: float, mass: float, own: float, out: Array) -> None:
    """Rates of approach, both centres, and their speeds, two equal gears."""
    at = (phase % 1.0) * len(k)
    i = int(at)
    stiffness = k[i] + (at - i) * (k[(i + 1) % len(k)] - k[i])
    delta, speed = s[0] + s[2] - s[4], s[1] + s[3] - s[5]
    push = 0.0
    if delta > 0.0:
        push = max(0.0, stiffness * delta + 2 * RATIO * np.sqrt(stiffness * mass) * speed)
    out[0], out[1] = s[1], (force - push) / mass
    out[2], out[3] = s[3], (-push - SUPPORT * s[2] - DAMPER * s[3]) / own
    out[4], out[5] = s[5], (push - SUPPORT * s[4] - DAMPER * s[5]) / own


@compiled
def dte_of(s: Array, frequency: float, cycles: int, k: Array, force: float, mass: float, own: float) -> Array:
    """DTE over so many mesh periods by classical Runge-Kutta steps; s becomes the state at their end."""
    h = 1.0 / (frequency * STEPS)
    one, two, three, four, found = np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(cycles * STEPS)
    for i in range(len(found)):
        at = i / STEPS
        rates(s, at, k, force, mass, own, one)
        rates(s + 0.5 * h * one, at + 0.5 / STEPS, k, force, mass, own, two)
        rates(s + 0.5 * h * two, at + 0.5 / STEPS, k, force, mass, own, three)
        rates(s + h * three, at + 1.0 / STEPS, k, force, mass, own, four)
        s += h / 6 * (one + 2 * two + 2 * three + four)
        found[i] = s[0] + s[2] - s[4]
    return found


@pytest.mark.validation
def test_both_ways_through_a_resonance_are_those_of_a_second_formulation() -> None:
    """Every answer within 0.2 %, in the range of two answers too: there the DTE downwards is up to 3.4 times that
    upwards, and the teeth part."""
    case = read_case(case_path("rig_62"), SETTINGS)
    meshing = pair(case.rig)
    (body, _), base = bodies_of(case.rig, meshing), meshing.driver.base_radius
    force, mass = case.experiment.torque_mean / base, 0.5 * body.inertia / base**2
    k = force / static(case, torque=[force * base], positions=1024)["transmission_error"].values[0]
    speeds = np.sqrt(3.1e8 / mass) / 62 * np.linspace(0.86, 1.08, 12)
    found, expected = sweep(case, list(speeds))["dte_rms"].values, np.empty((2, len(speeds)))
    for row, order in enumerate((range(len(speeds)), reversed(range(len(speeds))))):
        state = np.array([force / k.mean() + 2 * force / SUPPORT, 0, -force / SUPPORT, 0, force / SUPPORT, 0])
        for number in order:
            frequency = speeds[number] * 62 / (2 * np.pi)
            dte_of(state, frequency, WAIT, k, force, mass, body.mass)
            expected[row, number] = dte_of(state, frequency, LOOK, k, force, mass, body.mass).std()
    assert found == pytest.approx(expected, rel=2e-3)
    assert (found[1] / found[0]).max() > 3.0

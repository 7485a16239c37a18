"""What friction takes from the driver over a mesh cycle: its moment does not vanish in the mean.

Before the pitch point friction helps to turn the driver, behind it hinders, with longer arms the later: so the sum of
the teeth's normal forces is smaller in the mean than T1/rb1.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.fem.motion.machine import make_machine
from gearbench.fem.motion.scheme import make_scheme
from gearbench.fem.motion.start import initial_state
from gearbench.fem.motion.transient import advance, columns
from gearbench.geometry.tooth.body import body
from gearbench.rig import Damping, Friction, Support, Supports

Array = NDArray[np.float64]
TORQUE, MU = 60.0, 0.06
FREQUENCY = 2.0  # of the mesh [Hz]: slow enough to be at rest
STEPS = 4096  # a mesh cycle


class Cycle(NamedTuple):
    """One mesh cycle: mesh phases (n,), forces (3, n) [N] of the pair behind the pitch point, nearest to it and before
    it, torque on the driven gear (n,) [N m]."""

    phase: Array
    force: Array
    driven: Array


def slow_cycle(elastic: Any, mu: float) -> Cycle:
    """The reduced model under a constant driver torque, half a cycle after its start on."""
    support = Support(stiffness=1e10, damping=1e5)
    rig = elastic.rig.model_copy(
        update={
            "support": Supports(driver=support, driven=support),
            "damping": Damping(material_ratio=0.1),
            "friction": Friction(coefficient=mu, transition_speed=1e-8),
        }
    )
    shapes, gears = (elastic.pair.driver, elastic.pair.driven), (rig.driver, rig.driven)
    bodies = tuple(body(s, g, rig.material.density) for s, g in zip(shapes, gears, strict=True))
    machine = make_machine(rig, elastic.pair, elastic.law, elastic.gears, bodies, FREQUENCY, TORQUE)
    step, settle = 1.0 / (FREQUENCY * STEPS), STEPS // 8
    count = settle + STEPS
    start = initial_state(machine, TORQUE, -0.5 / FREQUENCY - settle * step)
    _, samples, ran = advance(machine, make_scheme(step, 0.6), start, np.full(count, TORQUE), 1)
    assert ran.failed == -1
    out = columns(samples[settle:])
    phase = -0.5 + (1 + np.arange(STEPS)) / STEPS
    return Cycle(phase, np.array([out.leaving, out.middle, out.entering]), out.torque_driven)


def places(phase: Array) -> Array:
    """How many base pitches the pairs (3, n) are behind the pitch point, as `Cycle.force` orders them."""
    nearest = phase - np.floor(phase + 0.5)
    return np.array([nearest + 1.0, nearest, nearest - 1.0])


def plainly_touching(pair: Any, place: Array, force: Array) -> Array:
    """Whether (n,) no pair that carries touches near the pitch point or beyond the line of action's active part."""
    rho = pair.driver.base_radius * np.tan(pair.working_pressure_angle) + place * pair.base_pitch
    low, high = pair.active_driver
    inside = (rho > low + 0.02 * pair.base_pitch) & (rho < high - 0.02 * pair.base_pitch) & (np.abs(place) > 0.05)
    return np.all(inside | (force == 0.0), axis=0)


def arms(pair: Any, place: Array) -> tuple[Array, Array]:
    """Arms (3, n) [m] of friction about the centres of driver and driven gear: the involutes' radii of curvature."""
    slope, along = np.tan(pair.working_pressure_angle), place * pair.base_pitch
    return pair.driver.base_radius * slope + along, pair.driven.base_radius * slope - along


def test_both_gears_are_in_balance_with_the_moments_of_friction(unequal: Any) -> None:
    """T1 = sum of F (rb1 + mu s rho1) and T2 = sum of F (rb2 + mu s rho2), s = -1 before the pitch point, 1 behind:
    with one pair and with two, everywhere but at tip edges and where friction has just turned round."""
    pair, cycle = unequal.pair, slow_cycle(unequal, MU)
    place = places(cycle.phase)
    plain = plainly_touching(pair, place, cycle.force)
    bases = pair.driver.base_radius, pair.driven.base_radius
    pairs = (cycle.force > 0.0).sum(axis=0)
    assert all((plain & (pairs == number)).sum() > 0.2 * STEPS for number in (1, 2))
    torques = np.full(STEPS, TORQUE), cycle.driven
    for base, arm, torque, within in zip(bases, arms(pair, place), torques, (3e-4, 2e-5), strict=True):
        found = (cycle.force * (base + MU * np.sign(place) * arm)).sum(axis=0) / torque
        assert np.abs(found - 1.0)[plain].max() < within
        assert np.abs((cycle.force * base).sum(axis=0) / torque - 1.0)[plain].mean() > 0.005  # not without friction


def test_teeth_carry_less_in_the_mean_than_the_torque_says(unequal: Any) -> None:
    """By the mean moment of friction over a mesh cycle, which is that of rigid teeth with the shares that they have
    without friction, and about that of equal shares (0.51 % here)."""
    pair, cycle, free = unequal.pair, slow_cycle(unequal, MU), slow_cycle(unequal, 0.0)
    place, base = places(cycle.phase), pair.driver.base_radius
    plain = plainly_touching(pair, place, cycle.force) & plainly_touching(pair, place, free.force)
    lever = MU * np.sign(place) * arms(pair, place)[0] / base

    def less(share: Array) -> Array:
        return np.asarray(1.0 / (1.0 + (share * lever).sum(axis=0)) - 1.0)

    lacking = cycle.force.sum(axis=0) * base / TORQUE - 1.0
    expected = less(free.force / free.force.sum(axis=0))
    assert lacking[plain].mean() == pytest.approx(expected[plain].mean(), rel=1e-3)
    rho = arms(pair, place)[0]
    on = (rho > pair.active_driver[0]) & (rho < pair.active_driver[1])
    whole = (cycle.force.sum(axis=0) / free.force.sum(axis=0) - 1.0).mean()
    assert whole == pytest.approx(less(on / on.sum(axis=0)).mean(), rel=0.1) and whole < -0.004

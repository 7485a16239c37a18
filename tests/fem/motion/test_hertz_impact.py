"""Two discs strike: the gears' own contact law and stepping, of bodies that yield nowhere but where they touch.

A kernel of nothing leaves of each gear what Hertz knows of a cylinder: the involute's radius of curvature and the
half-plane. Force and approach of a line contact are (Johnson 1985, eqs. 4.43 and 5.57 with the unit length as datum)

    delta = C F (ln(2/b) + 1/2),  b^2 = 2 C F R,  C = 2/(pi E* L),  1/R = 1/R1 + 1/R2

and the work up to F is C F^2 (ln(2/b)/2 + 1/8). With it the largest force of an impact is the root of one equation, and
the contact lasts for a quadrature; as a second formulation stands the impact's own differential equation.
"""

from __future__ import annotations

from dataclasses import replace
from math import log, sqrt
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from gearbench.fem.contact.curve import Curves, tabulate
from gearbench.fem.contact.kernel import POINTS, Kernel
from gearbench.fem.contact.kinematics import Tooth
from gearbench.fem.contact.law import MEETING
from gearbench.fem.contact.line import line_contact
from gearbench.fem.motion.machine import Machine, make_machine
from gearbench.fem.motion.scheme import make_scheme
from gearbench.fem.motion.start import State
from gearbench.fem.motion.transient import take_step
from gearbench.geometry.tooth.body import body
from gearbench.rig import Damping, Load, Support, Supports

Array = NDArray[np.float64]
GAP = 1e-7  # [m]
STEPS = 500


class Hertz(NamedTuple):
    """A line contact: C [m/N], relative radius of curvature R [m]."""

    c: float
    radius: float

    def half(self, force: float) -> float:
        return sqrt(2 * self.c * force * self.radius)

    def approach(self, force: float) -> float:
        return self.c * force * (log(2 / self.half(force)) + 0.5) if force > 0 else 0.0

    def work(self, force: float) -> float:
        return self.c * force**2 * (0.5 * log(2 / self.half(force)) + 0.125) if force > 0 else 0.0

    def force(self, approach: float) -> float:
        return float(brentq(lambda f: self.approach(f) - approach, 0.0, 1e6)) if approach > 0 else 0.0

    def peak(self, mass: float, speed: float) -> float:
        """Largest force of an impact of that mass [kg] and speed [m/s]."""
        return float(brentq(lambda f: self.work(f) - 0.5 * mass * speed**2, 1e-9, 1e6))

    def duration(self, mass: float, speed: float) -> float:
        """2 int d delta / sqrt(v^2 - 2 W/m), with F = F_max (1 - s^2) so that nothing is singular."""
        most = self.peak(mass, speed)

        def rate(s: float) -> float:
            force = most * (1 - s * s)
            left = speed**2 - 2 * self.work(force) / mass
            return self.c * log(2 / self.half(force)) * 2 * most * s / sqrt(left)

        return 2 * float(quad(rate, 1e-6, 1 - 1e-12, limit=200)[0])


def unyielding(tooth: Tooth, sense: int) -> Kernel:
    """A kernel of nothing, with a mode that no flank moves: what is left is the half-plane."""
    # Laid out as those of gears, or the loops would be compiled for these arrays too.
    table, modes = np.zeros((1, POINTS, POINTS)), np.zeros((1, 20, POINTS))
    coupling = np.zeros((0, 0, 2, 2, 0, 0))
    return Kernel(table, table, tooth.s_end, tooth.s_tip, 6.0, 0, 0.02, modes, modes, coupling, sense)


@pytest.fixture(scope="module")
def discs(twins: Any) -> Any:
    """Law of the twins without their bodies, and the contact at the pitch point."""
    law, a = twins.law, twins.pair.centre_distance
    k1, k2 = unyielding(law.driver, -1), unyielding(law.driven, 1)
    one = tabulate(law.driver, law.driven, k1, k2, law.half_plane, a, law.reach1)
    two = tabulate(law.driven, law.driver, k2, k1, law.half_plane, a, law.reach2)
    curves = Curves(one, two, law.curves.end1, law.curves.end2)
    radius = twins.pair.line_of_action / 4  # both flanks' radii are half of that line at the pitch point
    steel = twins.rig.material  # plane stress: 1/E* = 2/E of two such discs
    compliance = 4 / (np.pi * steel.youngs_modulus * twins.rig.driver.face_width)
    return SimpleNamespace(law=law._replace(k1=k1, k2=k2, curves=curves), hertz=Hertz(compliance, radius))


def build(twins: Any, law: Any, load: str, inertias: tuple[float, float]) -> Machine:
    held = Supports(driver=Support(), driven=Support(), direction="tangential")
    changes = {"support": held, "load": Load(boundary=load), "damping": Damping(material_ratio=0.0)}
    rig = twins.rig.model_copy(update=changes)
    gear = SimpleNamespace(teeth=20, omega=np.array([1e6]), mode_hub=np.zeros((1, 3)))
    shape = body(twins.pair.driver, rig.driver, rig.material.density)
    bodies = tuple(replace(shape, inertia=inertia) for inertia in inertias)
    gears: Any = (gear, gear)
    return make_machine(rig, twins.pair, law, gears, (bodies[0], bodies[1]), 0.0)


def strike(machine: Machine, speed: float, step: float, steps: int) -> list[State]:
    """From GAP before the flanks touch, the driver coming at that speed [m/s] along the line of action."""
    d, v, still = (np.zeros(len(machine.mass)) for _ in range(3))
    d[machine.at.driver], v[machine.at.driver] = -GAP / machine.law.driver.rb, speed / machine.law.driver.rb
    none = np.zeros(0)
    state = State(0.0, d, v, still, still, np.zeros(0, MEETING), none, none, none, none, lately=0.0, torque=0.0)
    states = [state]
    for _ in range(steps):
        found = take_step(machine, make_scheme(step, 1.0), states[-1], 0.0)
        assert found.converged
        states.append(found.state)
    return states


LONG = pytest.mark.validation


@pytest.mark.parametrize(
    ("speed", "load"),
    [
        (6e-2, "torque"),
        pytest.param(6e-2, "speed", marks=LONG),
        pytest.param(2e-3, "torque", marks=LONG),
        pytest.param(2e-3, "speed", marks=LONG),
    ],
)
def test_impact_of_two_discs(twins: Any, discs: Any, load: str, speed: float) -> None:
    """Largest force and half-width within 0.2 %, contact time within 0.5 %, restitution 1 within 0.1 %, and momentum;
    against a held disc and a free one."""
    hertz, rb, inertias = discs.hertz, discs.law.driver.rb, (2e-3, 5e-3)
    machine = build(twins, discs.law, load, inertias)
    masses = [inertia / rb**2 for inertia in inertias]
    mass = masses[0] if load == "speed" else masses[0] * masses[1] / sum(masses)
    most, lasts = hertz.peak(mass, speed), hertz.duration(mass, speed)
    step = (1.1 * lasts + GAP / speed) / STEPS
    states = strike(machine, speed, step, STEPS)

    force = np.array([state.force.sum() for state in states])
    assert force.max() == pytest.approx(most, rel=2e-3)
    touching = np.flatnonzero(force > 0)
    assert len(touching) * step == pytest.approx(lasts, rel=5e-3)
    assert force[-1] == 0.0 and np.all(np.diff(touching) == 1)

    rates = [state.v for state in states]
    first = rates[-1][0] * rb
    second = rates[-1][machine.at.driven] * rb if load == "torque" else 0.0
    assert first - second == pytest.approx(-speed, rel=1e-3)
    if load == "torque":
        assert masses[0] * first + masses[1] * second == pytest.approx(masses[0] * speed, rel=1e-9)

    pressed = line_contact(
        machine.law.driver, machine.law.driven, machine.law.k1, machine.law.k2, hertz.c, machine.law.centre,
        twins.pair.line_of_action / 2, float(force.max()),
    )  # fmt: skip
    middle, wide = 0.5 * (pressed.edges[1:] + pressed.edges[:-1]), np.diff(pressed.edges)
    centre = pressed.force @ middle / pressed.force.sum()
    spread = (pressed.force @ (middle - centre) ** 2 + pressed.force @ wide**2 / 12) / pressed.force.sum()
    assert 2 * sqrt(spread) == pytest.approx(hertz.half(most), rel=5e-3)

    def equation(_: float, y: Array) -> list[float]:
        return [y[1], -hertz.force(y[0]) / mass]

    times = np.array([state.t for state in states]) - GAP / speed
    during = times[(times > 0) & (times < lasts)]
    solved = solve_ivp(equation, (0.0, lasts), [0.0, speed], t_eval=during, rtol=1e-8, atol=1e-16)
    expected = np.array([hertz.force(one) for one in solved.y[0]])
    assert np.abs(force[(times > 0) & (times < lasts)] - expected).max() < 5e-3 * most


def test_closed_form_and_equation_of_the_impact_agree() -> None:
    """The references of this file against one another: the time at which the discs part, and the largest force."""
    hertz, mass, speed = Hertz(3e-10, 5e-3), 2.5, 2e-2

    def parted(_: float, y: Array) -> float:
        return float(y[0])

    parted.terminal, parted.direction = True, -1  # type: ignore[attr-defined]
    solved = solve_ivp(
        lambda _, y: [y[1], -hertz.force(y[0]) / mass], (0.0, 1e-2), [1e-15, speed],
        events=parted, rtol=1e-9, atol=1e-16, max_step=1e-6,
    )  # fmt: skip
    assert solved.t[-1] == pytest.approx(hertz.duration(mass, speed), rel=1e-4)
    assert hertz.force(solved.y[0].max()) == pytest.approx(hertz.peak(mass, speed), rel=1e-4)

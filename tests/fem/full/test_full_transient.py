"""The unreduced rig in time: equilibrium, quasi-static limit, energy, momentum, order, the reduced rig, an impact."""

from __future__ import annotations

from collections.abc import Callable
from math import cos
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.fem.contact.static import StaticCycle, static_cycle
from gearbench.fem.full.contact import meet
from gearbench.fem.full.energy import Ledger, flank_energy, ledger
from gearbench.fem.full.machine import Machine, angles
from gearbench.fem.full.record import Samples, advance, columns
from gearbench.fem.full.start import initial_state
from gearbench.fem.full.transient import State, make_integrator, take_step
from gearbench.fem.motion import start as reduced_start
from gearbench.fem.motion import transient as reduced
from gearbench.fem.motion.machine import make_machine as reduced_machine
from gearbench.fem.motion.scheme import make_scheme
from gearbench.geometry.tooth.body import body

Array = NDArray[np.float64]
TORQUE = 100.0


def march(machine: Machine, torque: Array, step: float, radius: float, state: State | None = None) -> list[State]:
    """Every state on the way, the first included."""
    integrator = make_integrator(machine, make_scheme(step, radius))
    states = [initial_state(machine, TORQUE) if state is None else state]
    for value in torque:
        found = take_step(integrator, states[-1], float(value))
        assert found.converged
        states.append(found.state)
    return states


def test_equilibrium_is_kept(build: Callable[..., Machine]) -> None:
    machine = build(damping=1e4, beta=1e-5)
    states = march(machine, np.full(5, TORQUE), 2e-5, 0.9)
    first, last = states[0].d, states[-1].d
    for one, two in zip(first, last, strict=True):
        assert np.abs(two - one).max() < 1e-9 * np.abs(one).max()


def test_slow_motion_is_the_static_solution(twins: Any, build: Callable[..., Machine]) -> None:
    """Through single and double contact and tip edges, on a mesh of its own: the law's static TE within 0.1 %."""
    frequency, steps = 5.0, 128
    machine = build(frequency, stiffness=1e12, damping=1e6)
    integrator = make_integrator(machine, make_scheme(1 / (frequency * steps), 0.0))
    run = advance(integrator, initial_state(machine, TORQUE), np.full(steps, TORQUE))
    assert not run.lost and not run.off
    out = columns(run.samples)
    along = cos(twins.pair.working_pressure_angle)
    dte = machine.law.driver.rb * out.angle_driver - machine.law.driven.rb * out.angle_driven
    dte = dte + along * (out.y_driver - out.y_driven)
    phases = (np.arange(steps) + 1) / steps
    rest = static_cycle(machine.law, phases, torque=[TORQUE])
    assert np.abs(dte[3:] / rest.transmission_error[0][3:] - 1).max() < 1e-3
    assert set(out.loaded.astype(int)) == {1, 2}
    _teeth_carry_the_torque(machine, out, phases, rest)


def _teeth_carry_the_torque(machine: Machine, out: Samples, phases: Array, rest: StaticCycle) -> None:
    """The columns of tooth forces: their sum holds the hub's torque, each is the static share of its tooth, and the
    pair that enters becomes the middle one, then the one that leaves."""
    law, settled = machine.law, slice(3, None)
    forces = np.stack([out.leaving, out.middle, out.entering], axis=1)
    on_line = (forces > 0.0).sum(axis=1) == 1
    held = forces.sum(axis=1) * law.driven.rb
    # The twins' base radii are the same. A tip edge has another lever about its own gear only: the driven gear's
    # enters, the driver's leaves.
    off = np.minimum(np.abs(held / TORQUE - 1), np.abs(held / out.torque_driven - 1))
    assert off[settled].max() < 1e-3
    assert held[on_line][3:] == pytest.approx(out.torque_driven[on_line][3:], rel=1e-4)
    shares = np.sort(forces / forces.sum(axis=1)[:, None], axis=1)[settled, ::-1]
    truth = np.sort(rest.load_share[0], axis=1)[settled, ::-1]
    width = min(truth.shape[1], 3)
    assert shares[:, :width] == pytest.approx(truth[:, :width], abs=5e-3)
    # Phase 0: a tooth at the pitch point; up to 0.5 the next one enters, from there on the last one leaves.
    early, late = (phases > 0.05) & (phases < 0.48), phases > 0.52
    assert not out.leaving[early].any() and not out.entering[late & (phases < 0.95)].any() and not out.back.any()
    assert out.entering[(phases > 0.4) & early].min() > 0.0 and out.leaving[late & (phases < 0.6)].min() > 0.0


def ledgers(machine: Machine, steps: int, radius: float, duration: float = 4e-4) -> tuple[list[State], list[Ledger]]:
    at = np.arange(1, steps + 1) / steps
    states = march(machine, TORQUE * (1 + 0.2 * np.sin(np.pi * at) ** 2), duration / steps, radius)
    integrator = make_integrator(machine, make_scheme(duration / steps, radius))
    books = [ledger(integrator, states[i], states[i + 1]) for i in range(steps)]
    return states, books


@pytest.mark.parametrize("radius", [pytest.param(1.0, marks=pytest.mark.validation), 0.6])
def test_energy_is_accounted_for_at_every_step(build: Callable[..., Machine], radius: float) -> None:
    """The identity holds to rounding only if the step has solved its equations: hubs, gears, contact and damping."""
    machine = build(300.0, beta=2e-6, damping=3e3, boundary="torque")
    _, books = ledgers(machine, 40, radius)
    size = max(abs(value) for book in books for value in book)
    assert max(abs(book.error) for book in books) < 1e-9 * size
    total = Ledger(*np.sum(books, axis=0))
    assert total.material > 0 and total.supports > 0
    assert abs(total.frame) < 1e-3 * total.work


@pytest.mark.validation
def test_numerical_loss_falls_with_the_square_of_the_step(build: Callable[..., Machine]) -> None:
    lost = []
    for steps in (40, 80, 160):
        books = ledgers(build(), steps, 0.8)[1]
        lost.append(np.abs(np.cumsum([book.numerical for book in books])).max())
    assert lost[0] / lost[1] > 3.0 and lost[1] / lost[2] > 3.0


def test_flanks_store_what_they_take(build: Callable[..., Machine]) -> None:
    """Undamped flanks give back what they take: their work is the change of a function of the state."""
    states, books = ledgers(build(), 40, 1.0)
    taken = np.cumsum([book.flanks for book in books])
    stored = np.array([flank_energy(build(), state) for state in states])
    # What is left, 3e-5, is the change of the curves along the flank: its force is left out.
    assert np.abs(taken - (stored[1:] - stored[0])).max() < 1e-4 * np.ptp(stored)


@pytest.mark.validation
def test_order_of_the_step_is_two(build: Callable[..., Machine]) -> None:
    """Steps h, h/2, h/4 against h/16: the driver's rotation under a torque that swells, one pair in contact."""
    machine, duration = build(5.0, beta=1e-6, damping=2e3, stiffness=5e7, inertia=2e-3), 1.6e-3

    def end(steps: int) -> float:
        at = np.arange(1, steps + 1) / steps
        torque = TORQUE * (1 + 0.2 * np.sin(np.pi * at) ** 2 * np.sin(4 * np.pi * at))
        integrator = make_integrator(machine, make_scheme(duration / steps, 0.8))
        run = advance(integrator, initial_state(machine, TORQUE), torque)
        return float(run.state.d.hub[0])

    fine = end(512)
    errors = [abs(end(steps) - fine) for steps in (32, 64, 128)]
    assert errors[0] / errors[1] > 3.3 and errors[1] / errors[2] > 3.3


@pytest.mark.validation
def test_reduced_model_moves_alike(twins: Any, build: Callable[..., Machine]) -> None:
    """The same rig with four modes a gear and a residual: another formulation of the same motion."""
    frequency, rate, steps = 40.0, 65536.0, 300
    machine = build(frequency, beta=1e-5, damping=2e4, stiffness=2e7)
    rig = twins.rig.model_copy(
        update={
            "support": twins.rig.support.model_copy(
                update={
                    side: getattr(twins.rig.support, side).model_copy(update={"stiffness": 2e7, "damping": 2e4})
                    for side in ("driver", "driven")
                }
            ),
            "damping": twins.rig.damping.model_copy(update={"material_ratio": 1e-5 * np.pi * 1250.0}),
        }
    )
    bodies = tuple(body(s, rig.driver, rig.material.density) for s in (twins.pair.driver, twins.pair.driven))
    other = reduced_machine(rig, twins.pair, twins.law, twins.gears, bodies, frequency)
    scheme = make_scheme(1 / rate, 0.9)
    t = np.arange(1, steps + 1) / rate
    torque = TORQUE * (1 + 0.2 * np.sin(2 * np.pi * 1500.0 * t) + 0.1 * np.sin(2 * np.pi * 2900.0 * t))
    run = advance(make_integrator(machine, scheme), initial_state(machine, TORQUE), torque)
    _, samples, ran = reduced.advance(other, scheme, reduced_start.initial_state(other, TORQUE), torque, 1)
    assert ran.failed < 0 and not run.lost
    along = cos(twins.pair.working_pressure_angle)

    def dte(out: Any) -> Array:
        turned = machine.law.driver.rb * out.angle_driver - machine.law.driven.rb * out.angle_driven
        found: Array = turned + along * (out.y_driver - out.y_driven)
        return found - found.mean()

    one, two = dte(columns(run.samples)), dte(reduced.columns(samples))
    assert np.std(one - two) < 0.01 * np.std(one)


def test_impact_through_the_backlash(twins: Any, build: Callable[..., Machine]) -> None:
    """A heavy driver strikes the held gear and rebounds: duration of contact by the energy integral.

    t = 2 int_0^max d delta / sqrt(v^2 - 2 W(delta)/m), W being the work of the static force F(delta), which closes in
    a quadrature (Johnson 1985, sect. 11.4, for any law of contact). The gears' own vibration takes a little.
    """
    machine = build(0.0, stiffness=1e12, damping=1e7, inertia=0.5)
    law, speed, m = machine.law, 2e-3, 0.5 / machine.law.driver.rb**2
    deltas = 2e-5 * np.linspace(1e-4, 1.0, 60)
    force = static_cycle(law, np.zeros(1), dte=deltas.tolist()).torque_driver[:, 0] / law.driver.rb
    work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(deltas))])
    deepest = float(np.interp(0.5 * m * speed**2, work, deltas))
    angle = (np.arange(400) + 0.5) * np.pi / 2 / 400
    at = deepest * np.sin(angle)
    left = speed**2 - 2 * np.interp(at, deltas, work) / m
    duration = 2 * float(np.sum(deepest * np.cos(angle) / np.sqrt(left)) * np.pi / 2 / 400)

    rest = initial_state(machine, 1e-3)
    gap = 2e-7
    hub = np.array([-gap / law.driver.rb, 0.0, 0.0])
    met = meet(machine, angles(machine, hub, 0.0), np.zeros(2))
    zero = rest.a
    none = np.zeros(len(met.pairs))
    start = State(
        0.0,
        rest.d._replace(hub=hub, driver=zero.driver, driven=zero.driven),
        rest.v._replace(hub=np.array([speed / law.driver.rb, 0.0, 0.0])),
        zero,
        np.zeros(3),
        np.zeros(3),
        (0 * rest.push[0], 0 * rest.push[1]),
        met.pairs,
        none,
        none.copy(),
        none.copy(),
    )
    steps = 160
    step = 1.3 * duration / steps
    states = march(machine, np.zeros(steps), step, 0.9, start)
    touching = [state.t for state in states if np.any(state.force > 0.0)]
    assert touching[-1] - touching[0] == pytest.approx(duration, rel=0.02)
    assert states[-1].v.hub[0] * law.driver.rb == pytest.approx(-speed, rel=0.02)
    assert not np.any(states[-1].force > 0.0)
    # What the driver's hub has lost of its momentum is what the flanks have pressed on it.
    lost = machine.mass[0] * (states[0].v.hub[0] - states[-1].v.hub[0]) / law.driver.rb
    pressed = sum(float(state.force.sum()) for state in states) * step
    assert pressed == pytest.approx(lost, rel=0.01)

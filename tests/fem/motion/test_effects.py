"""What a real rig has beside ideal gears, in the reduced model: its energy balance, its statics, its neutral values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.fem.contact.coupling import coupling
from gearbench.fem.contact.curve import lone_approach
from gearbench.fem.contact.law import contact_in
from gearbench.fem.motion.hubs import hubs_at_rest, hubs_of
from gearbench.fem.motion.imposed import stiffness_factor
from gearbench.fem.motion.machine import (
    Machine,
    angles,
    contact_rows,
    damping_matrix,
    make_machine,
    mass_matrix,
    modal_flexibility,
    stiffness_matrix,
)
from gearbench.fem.motion.scheme import make_scheme
from gearbench.fem.motion.start import State, initial_state
from gearbench.fem.motion.transient import Stepped, advance, columns, take_step
from gearbench.geometry.tooth.body import body
from gearbench.rig import (
    Across,
    Coupling,
    Damping,
    Drive,
    Friction,
    Housing,
    Load,
    MeshCorrection,
    OutputShaft,
    Rig,
    Ripple,
    Rocking,
    Support,
    Supports,
)

Array = NDArray[np.float64]
TORQUE = 100.0
STIFF = 2e8
ACROSS = Across(stiffness=1e8, damping=2e3, coupling=3e7)
EFFECTS: dict[str, dict[str, Any]] = {
    "plain": {},
    "friction": {"friction": Friction(coefficient=0.1, transition_speed=2e-3)},
    "supports": {"one": {"exponent": 0.5, "damping": 1e3}, "two": {"exponent": -0.3}},
    "across": {"one": {"across": ACROSS}, "two": {"across": Across(stiffness=2e8)}},
    "one across": {"one": {"across": ACROSS}},
    "coupling": {"drive": Drive(coupling=Coupling(inertia=2e-3, stiffness=1e5, damping=5.0))},
    "ripple": {"drive": Drive(ripple=Ripple(orders=(20, 60), amplitude=(9.0, 5.0), phase=(0.3, 1.0)))},
    "shaft": {"load": Load(coupling=OutputShaft(stiffness=1e5, damping=5.0))},
    "housing": {"housing": Housing(mass=3.0, stiffness=1e8, damping=1e3), "one": {"damping": 2e3}},
    "rocking": {"housing": Housing(mass=3.0, stiffness=1e8, rocking=Rocking(mass=2.0, stiffness=2e8, damping=1e3))},
    "scale": {"mesh": MeshCorrection(stiffness_scale=0.8)},
    "bodies": {"mesh": MeshCorrection(stiffness_scale=1.2, shared_compliance=4e-10)},
    "ends": {"mesh": MeshCorrection(end_compliance=-8e-10)},
    "tilt": {"mesh": MeshCorrection(tilt_compliance=6e-10)},
    "free": {
        "load": Load(boundary="torque", coupling=OutputShaft(inertia=3e-3, stiffness=1e5, damping=5.0)),
        "drive": Drive(coupling=Coupling(inertia=2e-3, stiffness=1e5, damping=5.0)),
        "friction": Friction(coefficient=0.1, transition_speed=2e-3),
    },
    "held": {"load": Load(boundary="torque"), "drive": Drive(boundary="speed")},
}


def rig_of(elastic: Any, effect: dict[str, Any], beta: float = 0.0) -> Rig:
    given = dict(effect)
    one, two = (Support(**{"stiffness": STIFF, **given.pop(name, {})}) for name in ("one", "two"))
    changes = {"support": Supports(driver=one, driven=two), "damping": Damping(material_ratio=beta * np.pi * 1250.0)}
    return elastic.rig.model_copy(update={**changes, **given})


def build(
    elastic: Any, effect: dict[str, Any], frequency: float = 0.0, beta: float = 0.0, mean: float = TORQUE
) -> Machine:
    rig = rig_of(elastic, effect, beta)
    shapes, gears = (elastic.pair.driver, elastic.pair.driven), (rig.driver, rig.driven)
    bodies = tuple(body(s, g, rig.material.density) for s, g in zip(shapes, gears, strict=True))
    return make_machine(rig, elastic.pair, elastic.law, elastic.gears, bodies, frequency, mean)


def run(
    machine: Machine, step: float, steps: int, torque: float, look: Callable[[State, Stepped, State], None]
) -> State:
    """Step by step with spectral radius 1, each looked at."""
    scheme, state = make_scheme(step, 1.0), initial_state(machine, TORQUE)
    for _ in range(steps):
        new = take_step(machine, scheme, state, torque)
        assert new.converged
        look(state, new, new.state)
        state = new.state
    return state


def contact_energy(machine: Machine, state: State) -> float:
    """Elastic energy of the flanks' residual flexibility: the integral of F du along the way from zero force."""
    x, w = np.polynomial.legendre.leggauss(10)
    soft = 1.0 / stiffness_factor(machine.correction, 0.0, 0.0)
    cross = coupling(machine.law, state.pairs) * soft
    cross -= modal_flexibility(machine, contact_rows(machine, state.pairs))
    total = 0.5 * float(state.force @ cross @ state.force)
    for p, force in enumerate(state.force):
        if force > 0:
            k = contact_in(state.pairs, p)
            area = sum(
                lone_approach(machine.law.curves, k, soft * force * ((a + 1) / 2) ** 2)[0] * b * force * (a + 1) / 2
                for a, b in zip(x, w, strict=True)
            )
            total += force * lone_approach(machine.law.curves, k, soft * force)[0] - area
    return total


def stored(machine: Machine, stiffness: Array, state: State) -> float:
    """Kinetic and elastic energy; `stiffness`: that of the machine without its contacts."""
    springs, hubs = machine.springs, machine.hubs
    s = springs.rows @ state.d[:hubs]
    # Integral of k s |s/r|^e.
    bent = springs.stiffness * np.abs(s) ** (2 + springs.exponent) / springs.reference**springs.exponent
    mass = mass_matrix(machine, *angles(machine, state.d, state.t))
    elastic = 0.5 * state.d @ stiffness @ state.d + float((bent / (2 + springs.exponent)).sum())
    return float(0.5 * state.v @ mass @ state.v + elastic + contact_energy(machine, state))


def rubbing(machine: Machine, state: State) -> float:
    """Power [W] that friction takes, from contact points and the gears' motion as plain kinematics."""
    at, law, total = machine.at, machine.law, 0.0
    turned = {"one": state.v[at.driver] + machine.speed1, "two": machine.speed2}
    turned["two"] += state.v[at.driven] if at.driven >= 0 else 0.0
    y = state.d[at.y2] - state.d[at.y1]
    for pair, force in zip(state.pairs, state.force, strict=True):
        if force <= 0:
            continue
        n = np.array([pair["nx"], pair["ny"]])
        t = np.array([-n[1], n[0]])
        # From the driver's centre to the contact: lever across the normal, arm along it.
        point = pair["lever1"] * np.array([n[1], -n[0]]) + pair["xi1"] * n
        other = point - np.array([law.centre, y])
        one = turned["one"] * np.array([-point[1], point[0]])
        two = -turned["two"] * np.array([-other[1], other[0]])
        one[1] += state.v[at.y1]
        two[1] += state.v[at.y2]
        v = float((one - two) @ t)
        total += machine.rubbing.coefficient * force * np.tanh(v * machine.rubbing.steepness) * v
    return total


def moved(machine: Machine, old: State, state: State) -> float:
    """Energy [J] that springs of pairs lose as they move along the path of contact, pressed as far, to where they are
    softer: no lever of a pair has the force that this would need."""
    law, total = machine.law, 0.0
    for before, after, force in zip(old.pairs, state.pairs, state.force, strict=True):
        one, two = ((pair["xi1"] - law.middle) / law.half for pair in (before, after))
        total += 0.5 * force**2 * (law.ends * (two**2 - one**2) + law.tilt * (two - one))
    return total


def work(machine: Machine, old: State, step: Stepped, torque: float) -> float:
    """Work [J] of the torques in a step: the trapezium's."""
    new, total = step.state, 0.0
    if machine.driven_at >= 0:
        turn = new.d[machine.driven_at] - old.d[machine.driven_at]
        ripple = [
            machine.ripple.torque @ np.cos(machine.ripple.order * angles(machine, s.d, s.t)[0] + machine.ripple.phase)
            for s in (old, new)
        ]
        total += (torque + 0.5 * sum(ripple)) * turn
    if machine.loaded_at >= 0:
        total -= step.torque_driven * (new.d[machine.loaded_at] - old.d[machine.loaded_at])
    return total


@pytest.mark.parametrize("effect", sorted(EFFECTS))
def test_no_energy_appears_or_is_lost(twins: Any, effect: str) -> None:
    """Gears at rest, a fifth more torque than they stand under: work = stored + damped + rubbed at every step, to
    second order in the step; supports, shafts and friction take theirs, the scheme nothing."""
    torque, errors = 1.2 * TORQUE, []
    machine = build(twins, EFFECTS[effect], mean=torque)
    stiffness, damping = stiffness_matrix(machine), damping_matrix(machine)
    for steps in (50, 100):
        step = 4e-4 / steps
        balance, sizes, held = [0.0], [0.0], [stored(machine, stiffness, initial_state(machine, TORQUE))]

        def look(old: State, new: Stepped, state: State, balance=balance, sizes=sizes, held=held, h=step) -> None:
            mean = 0.5 * (old.v + state.v)
            lost = h * float(mean @ damping @ mean)
            lost += 0.5 * h * (rubbing(machine, old) + rubbing(machine, state)) if machine.rubbing.coefficient else 0.0
            lost += moved(machine, old, state)
            done = work(machine, old, new, torque)
            held.append(stored(machine, stiffness, state))
            balance.append(balance[-1] + done - lost - (held[-1] - held[-2]))
            sizes.append(sizes[-1] + done)

        run(machine, step, steps, torque, look)
        errors.append(np.abs(balance).max() / np.abs(sizes).max())
    assert errors[1] < 2e-3
    assert errors[1] < 0.45 * errors[0] or errors[1] < 5e-5


@pytest.mark.parametrize("effect", sorted(EFFECTS))
def test_every_rig_starts_at_rest(twins: Any, effect: str) -> None:
    """Without friction and ripple the static start stays where it is."""
    calm = {name: value for name, value in EFFECTS[effect].items() if name != "friction"}
    if effect == "ripple":
        pytest.skip("ripple moves the gears")
    machine = build(twins, calm, beta=1e-6)
    start = initial_state(machine, TORQUE)
    moved: list[float] = []
    run(machine, 1e-6, 20, TORQUE, lambda old, new, s: moved.append(float(np.abs(s.d - start.d).max())))
    assert max(moved) < 1e-6 * np.abs(start.d[: machine.hubs]).max()


def test_neutral_values_change_nothing(twins: Any) -> None:
    """Bit for bit: no friction, exponent 0, a factor of 1, an excess of 0, a ripple of 0."""
    none = {
        "friction": Friction(coefficient=0.0, transition_speed=1e-3),
        "one": {"exponent": 0.0, "reference_deflection": 3e-6},
        "mesh": MeshCorrection(stiffness_cos=(0.0,), stiffness_sin=(0.0,), error_cos=(0.0,), error_sin=(0.0,)),
        "drive": Drive(ripple=Ripple(orders=(3,), amplitude=(0.0,), phase=(1.0,))),
    }
    found = []
    for effect in ({}, none):
        machine = build(twins, effect, 200.0, 1e-6)
        torque = TORQUE * (1 + 0.3 * np.sin(np.arange(400) / 7))
        found.append(advance(machine, make_scheme(5e-6, 0.9), initial_state(machine, TORQUE), torque, 4)[1])
    np.testing.assert_array_equal(found[0], found[1])


def test_supports_at_rest_solve_their_own_equations(twins: Any) -> None:
    """Non-linear, across and on a housing: forces of springs as the case file defines them against what pushes."""
    rig = rig_of(twins, {**EFFECTS["housing"], "one": {"exponent": 0.5, "across": ACROSS}, "two": {"exponent": 1.5}})
    bodies = tuple(
        body(s, g, rig.material.density)
        for s, g in zip((twins.pair.driver, twins.pair.driven), (rig.driver, rig.driven), strict=True)
    )
    hubs = hubs_of(rig, bodies)
    at, push = hubs.unknowns, np.zeros(len(hubs.mass))
    push[[at.y1, at.y2, at.x1, at.housing]] = -4000.0, 5000.0, -1500.0, 70.0
    d = hubs_at_rest(hubs.stiffness, hubs.springs, at, hubs.held, push)
    y1, y2, x1, h = d[at.y1] - d[at.housing], d[at.y2] - d[at.housing], d[at.x1], d[at.housing]
    one = STIFF * y1 * abs(y1 / 10e-6) ** 0.5 + ACROSS.coupling * x1
    two = STIFF * y2 * abs(y2 / 10e-6) ** 1.5
    assert one == pytest.approx(-4000.0, rel=1e-9) and two == pytest.approx(5000.0, rel=1e-9)
    assert ACROSS.stiffness * x1 + ACROSS.coupling * y1 == pytest.approx(-1500.0, rel=1e-9)
    assert 1e8 * h - one - two == pytest.approx(70.0, rel=1e-6)
    assert d[at.x2] == 0.0


def test_a_spinning_rotor_keeps_its_support_frequency(twins: Any) -> None:
    """6000 rpm, flanks apart: the driver on its support vibrates at the frequency of its mass, the material from bore
    to tooth outline, and stiffness.

    Hub motions that were kept in the turning frame without its inertia forces would be off by Omega^2.
    """
    machine = build(twins, {"one": {"stiffness": 6e6}}, 2000.0)
    start = initial_state(machine, TORQUE)
    apart = start.d.copy()
    apart[0] = -20e-6 / twins.law.driver.rb
    apart[machine.at.y1] = apart[machine.at.y2] = 0.0
    apart[machine.hubs :] = 0.0
    v = np.zeros(len(apart))
    v[machine.at.y1] = 1e-3
    zero = np.zeros(len(apart))
    state = start._replace(
        d=apart, v=v, load=zero, pairs=start.pairs[:0], force=start.force[:0], before=start.before[:0],
        residual=start.residual[:0], older=start.older[:0],
    )  # fmt: skip
    step, steps = 4e-6, 6000
    _, samples, ran = advance(machine, make_scheme(step, 1.0), state, np.zeros(steps), 1)
    out = columns(samples)
    assert ran.failed == -1 and out.loaded.max() == 0
    y = out.y_driver
    up = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
    crossing = up + y[up] / (y[up] - y[up + 1])
    found = (len(crossing) - 1) / (crossing[-1] - crossing[0]) / step
    mass = body(twins.pair.driver, twins.rig.driver, twins.rig.material.density).mass
    # The modes' share moves with the hub as long as their frequencies are far above.
    assert found == pytest.approx(np.sqrt(6e6 / mass) / (2 * np.pi), rel=2e-3)


def test_friction_that_turns_round_at_once_is_coulombs(twins: Any) -> None:
    """Sliding that changes sign within nanometres a second, from rest on and through the pitch point, in steps of any
    length: forces of statics, T1 = F (rb1 + mu s rho1) and k y1 = -F (cos a + mu s sin a), s = -1 before, 1 behind."""
    mu, frequency, step, alpha = 0.3, 20.0, 2e-5, twins.pair.working_pressure_angle
    damped = {"one": {"damping": 2e4}, "two": {"damping": 2e4}}
    machine = build(twins, {"friction": Friction(coefficient=mu, transition_speed=1e-8), **damped}, frequency, 1e-5)
    start = initial_state(machine, TORQUE, -0.15 / frequency)
    torque = np.full(round(0.3 / frequency / step), TORQUE)
    _, samples, ran = advance(machine, make_scheme(step, 0.6), start, torque, 1)
    out = columns(samples)
    assert ran.failed == -1 and out.divided.sum() == 0 and out.loaded.max() == 1
    phase = -0.15 + frequency * step * (1 + np.arange(len(torque)))
    for at, sense in ((-0.1, -1.0), (0.1, 1.0)):
        rho = machine.law.driver.rb * (np.tan(alpha) + at * machine.law.driver.pitch)
        force = TORQUE / (machine.law.driver.rb + mu * sense * rho)
        expected = -force * (np.cos(alpha) + mu * sense * np.sin(alpha)) / STIFF
        assert out.y_driver[np.abs(phase - at).argmin()] == pytest.approx(expected, rel=2e-3)


def test_steps_too_long_are_divided(twins: Any) -> None:
    """Supports that stiffen a hundredfold under steps of torque, in steps of time too long for that: some are divided,
    the grid of samples stays, and at last the rig rests where k y |y/r|^3 = F cos a."""
    reference = 1e-7
    stiffening = {"exponent": 3.0, "reference_deflection": reference, "damping": 1e4}
    machine = build(twins, {"one": stiffening, "two": stiffening}, 1.0, 1e-5)
    torque = TORQUE * np.where(np.arange(200) < 100, 1 + 0.9 * (-1.0) ** (np.arange(200) // 3), 1.0)
    start, step = initial_state(machine, TORQUE), 1e-4
    _, samples, ran = advance(machine, make_scheme(step, 0.6), start, torque, 1)
    out = columns(samples)
    assert ran.failed == -1 and ran.t == pytest.approx(0.02) and len(out.divided) == 200
    assert 0 < out.divided.sum() < 50
    force = TORQUE / machine.law.driver.rb * np.cos(twins.pair.working_pressure_angle)
    assert out.y_driven[-1] == pytest.approx(reference * (force / (STIFF * reference)) ** 0.25, rel=1e-3)

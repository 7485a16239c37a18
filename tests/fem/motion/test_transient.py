"""Time integration: energy, momentum, order, quasi-static and linear limits, equilibrium at the start."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import natural_frequencies
from gearbench.fem.contact.coupling import coupling
from gearbench.fem.contact.curve import lone_approach
from gearbench.fem.contact.law import contact_in, find_pairs
from gearbench.fem.contact.static import MARGIN, static_cycle
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
from gearbench.fem.motion.scheme import Scheme, frequency_error, make_scheme
from gearbench.fem.motion.start import State, initial_state
from gearbench.fem.motion.transient import advance, columns, take_step
from gearbench.geometry.tooth.body import body
from gearbench.rig import Damping, Load, Support, Supports

Array = NDArray[np.float64]
TORQUE = 100.0


def build(
    elastic: Any,
    mesh_frequency: float = 0.0,
    *,
    beta: float = 0.0,
    stiffness: float = 2e8,
    damping: float = 0.0,
    boundary: str = "speed",
    direction: str = "tangential",
) -> Machine:
    support = Support(stiffness=stiffness, damping=damping)
    rig = elastic.rig.model_copy(
        update={
            "support": Supports(driver=support, driven=support, direction=direction),
            "load": Load(boundary=boundary),
            "damping": Damping(material_ratio=beta * np.pi * 1250.0),
        }
    )
    shapes, gears = (elastic.pair.driver, elastic.pair.driven), (rig.driver, rig.driven)
    bodies = tuple(body(s, g, rig.material.density) for s, g in zip(shapes, gears, strict=True))
    return make_machine(rig, elastic.pair, elastic.law, elastic.gears, bodies, mesh_frequency)


def march(
    machine: Machine, scheme: Scheme, state: State, torque: float, steps: int, look: Callable[[State, float], None]
) -> State:
    """Step by step, each looked at."""
    for _ in range(steps):
        step = take_step(machine, scheme, state, torque)
        assert step.converged
        state = step.state
        look(state, step.torque_driven)
    return state


class Meeting:
    """Touching pairs of a state, found anew."""

    def __init__(self, machine: Machine, state: State) -> None:
        law, r = machine.law, machine.rotations
        theta1, theta2 = angles(machine, state.d, state.t)
        y = state.d[r + 1] - state.d[r]
        self.pairs = find_pairs(law, theta1, theta2, law.centre + machine.axis_x * y, machine.axis_y * y, MARGIN)
        self.count = len(self.pairs)
        rows = contact_rows(machine, self.pairs)
        self.contacts = [contact_in(self.pairs, p) for p in range(self.count)]
        self.cross = coupling(law, self.pairs) - modal_flexibility(machine, rows)
        self.law = law

    def approach(self, p: int, force: float) -> float:
        return float(lone_approach(self.law.curves, contact_in(self.pairs, p), force)[0])

    def energy(self, force: Array) -> float:
        """Elastic energy of the residual flexibility under forces: sum of the integrals of F du."""
        x, w = np.polynomial.legendre.leggauss(30)
        total = 0.5 * force @ self.cross @ force
        for p in range(self.count):
            if force[p] > 0:
                f = force[p] * ((x + 1) / 2) ** 2
                area = np.array([self.approach(p, v) for v in f]) @ (w * force[p] * (x + 1) / 2)
                total += force[p] * self.approach(p, force[p]) - area
        return float(total)


def energy(machine: Machine, state: State, torque: float, force: Array | None = None) -> float:
    """Kinetic, modal, support and contact energy, less the work of the constant torque."""
    met = Meeting(machine, state)
    contact = met.energy(state.force if force is None else force)
    mass = mass_matrix(machine, *angles(machine, state.d, state.t))
    elastic = 0.5 * state.d @ stiffness_matrix(machine) @ state.d
    return 0.5 * state.v @ mass @ state.v + elastic + contact - torque * state.d[0]


# Natural period of the twins on their supports: 0.2 ms.
DURATION = 4e-4


def energies(machine: Machine, steps: int) -> Array:
    scheme = make_scheme(DURATION / steps, 1.0)
    state = initial_state(machine, TORQUE)
    out = [energy(machine, state, 1.2 * TORQUE)]
    march(machine, scheme, state, 1.2 * TORQUE, steps, lambda s, _: out.append(energy(machine, s, 1.2 * TORQUE)))
    return np.array(out)


def test_energy_of_a_free_oscillation_is_kept_to_second_order(twins: Any) -> None:
    """From the equilibrium of another torque, undamped, spectral radius 1: the loss falls with the step squared."""
    machine = build(twins)
    spread = 0.2 * TORQUE * 2e-5 / twins.law.driver.rb
    errors = []
    for steps in (50, 100, 200):
        kept = energies(machine, steps)
        errors.append(np.abs(kept - kept[0]).max() / spread)
    # What is left at small steps, 1e-5, is the change of the curves along the flank: its force is left out.
    assert errors[2] < 3e-4
    assert errors[0] / errors[1] > 3.0 and errors[1] / errors[2] > 3.0


def test_damping_takes_what_the_energy_loses(twins: Any) -> None:
    """Supports and modes lose v.C v; the flanks lose what the damped force does beyond the elastic one.

    The flanks' own equation u + beta u' = R(F) holds at every step (second-order backward difference).
    """
    machine = build(twins, beta=2e-7, damping=3e3)
    steps = 400
    scheme = make_scheme(DURATION / steps, 1.0)
    start = initial_state(machine, TORQUE)
    kept, lost = [], []
    previous = {
        "force": start.force.copy(),
        "u": start.residual.copy(),
        "spare": 0.0,
        "v": start.v,
        "older": start.older[0],
    }

    def elastic(met: Meeting, u: float) -> float:
        """Force of the lone pair at rest under the overlap u."""
        low, high = 0.0, 1e5
        for _ in range(60):
            f = 0.5 * (low + high)
            low, high = (f, high) if met.approach(0, f) + met.cross[0, 0] * f < u else (low, f)
        return low

    def look(state: State, _: float) -> None:
        met = Meeting(machine, state)
        assert met.count == 1
        u = state.residual[0]
        rate = (3 * u - 4 * state.older[0] + previous["older"]) / (2 * scheme.step)
        static = met.approach(0, state.force[0]) + met.cross[0, 0] * state.force[0]
        assert u + machine.beta * rate == pytest.approx(static, rel=1e-5)
        rest = elastic(met, u)
        kept.append(energy(machine, state, 1.2 * TORQUE, np.array([rest])))
        spare = state.force[0] - rest
        loss = 0.5 * (spare + previous["spare"]) * (state.residual[0] - previous["u"][0])
        v = 0.5 * (state.v + previous["v"])
        loss += scheme.step * v @ damping_matrix(machine) @ v
        lost.append(loss)
        previous.update(spare=spare, u=state.residual, v=state.v, older=state.older[0])

    march(machine, scheme, start, 1.2 * TORQUE, steps, look)
    first = energy(machine, start, 1.2 * TORQUE)
    gone = first - np.array(kept)
    total = np.cumsum(lost)
    assert np.all(np.array(lost) > -1e-9 * total[-1])
    assert gone[-1] > 0
    assert np.abs(gone - total).max() < 1e-2 * total[-1]


@pytest.mark.parametrize("boundary", ["speed", "torque"])
@pytest.mark.parametrize("direction", ["tangential", "line-of-action"])
def test_the_start_is_an_equilibrium(twins: Any, boundary: str, direction: str) -> None:
    machine = build(twins, beta=1e-5, damping=1e3, boundary=boundary, direction=direction)
    start = initial_state(machine, TORQUE)
    seen: list[State] = []
    march(machine, make_scheme(1e-6, 0.9), start, TORQUE, 50, lambda s, _: seen.append(s))
    for state in seen:
        assert np.abs(state.a[0]) * machine.mass[0] < 1e-6 * TORQUE
        np.testing.assert_allclose(state.d, start.d, rtol=1e-6, atol=1e-9 * np.abs(start.d).max())
        np.testing.assert_allclose(state.force, start.force, rtol=1e-6)


@pytest.mark.parametrize("boundary", ["speed", "torque"])
def test_action_is_reaction_at_every_step(unequal: Any, boundary: str) -> None:
    """Generalised forces of the step against the pairs' forces, and moments about the driver's centre."""
    machine = build(unequal, 500.0, beta=1e-5, damping=1e3, boundary=boundary)
    r = machine.rotations
    scheme = make_scheme(2e-6, 0.9)
    state = initial_state(machine, TORQUE)
    pairs = set()

    def look(state: State, moment: float) -> None:
        met = Meeting(machine, state)
        push = state.load.copy()
        push[0] -= TORQUE
        if r == 2:
            # The load takes up what levers off the line of action leave of the ratio of base circles.
            assert moment == pytest.approx(TORQUE * 1.5, rel=2e-2)
            push[1] += moment
        assert push[r] == pytest.approx(-push[r + 1], rel=1e-12)
        assert np.all(state.force >= 0.0)
        y = state.d[r + 1] - state.d[r]
        dx, dy = unequal.law.centre + machine.axis_x * y, machine.axis_y * y
        arms = sum(f * (dx * k.ny - dy * k.nx) for f, k in zip(state.force, met.contacts, strict=False) if f > 0)
        pairs.add(int(np.sum(state.force > 0)))
        # The hub of the driven gear turns with the modes that shake it: their inertia is not the contact's.
        hub = machine.hub2[2] @ state.a[r + 2 + machine.hub1.shape[1] :]
        driven = push[1] if r == 2 else moment - hub
        # The pairs are found where free motion would lead, the state a little behind: 1e-5 of the lever.
        assert driven - push[0] == pytest.approx(arms, rel=1e-4)

    march(machine, scheme, state, TORQUE, 1200, look)
    assert {1, 2} <= pairs


def test_angular_momentum_is_kept_where_both_gears_turn_freely(twins: Any) -> None:
    """Equal base radii and opposite torques on the line of action: J1 w1 + J2 w2, with the modes' share, rests."""
    machine = build(twins, beta=1e-5, boundary="torque")
    start = initial_state(machine, TORQUE)
    mass = mass_matrix(machine, *angles(machine, start.d, start.t))
    sums, sizes = [], []

    def look(state: State, _: float) -> None:
        momentum = mass @ state.v
        sums.append(momentum[0] + momentum[1])
        sizes.append(abs(momentum[0]))

    march(machine, make_scheme(1e-6, 0.9), start, 1.3 * TORQUE, 300, look)
    assert max(sizes) > 1e-5
    assert np.abs(sums).max() < 1e-9 * max(sizes)


def dte_after(machine: Machine, steps: int, torque: Callable[[Array], Array], duration: float) -> float:
    scheme = make_scheme(duration / steps, 0.9)
    t = duration / steps * np.arange(1, steps + 1)
    state, _, run = advance(machine, scheme, initial_state(machine, TORQUE), torque(t), steps)
    assert run.failed == -1
    return float(state.d[0])


def test_the_integration_is_of_second_order(twins: Any) -> None:
    """A single pair around the pitch point, gears turning, a smooth torque: halving the step quarters the error."""
    machine = build(twins, 100.0, beta=2e-6, damping=1e3)

    def torque(t: Array) -> Array:
        return TORQUE * (1 + 0.3 * np.sin(2 * np.pi * 2000 * t) ** 3)

    found = [dte_after(machine, n, torque, 6e-4) for n in (300, 600, 1200, 2400, 4800)]
    differences = np.abs(np.diff(found))
    orders = np.log2(differences[:-1] / differences[1:])
    assert np.all(orders > 1.8)
    assert np.all(orders < 2.2)


@pytest.mark.parametrize("boundary", ["speed", "torque"])
def test_slow_running_is_static(unequal: Any, boundary: str) -> None:
    """Stiff supports, 2 teeth a second, damped: the static transmission error to 0.1 %, handovers included."""
    machine = build(unequal, 2.0, beta=2e-5, stiffness=1e11, damping=2e5, boundary=boundary)
    step = 0.25 / 8192
    scheme = make_scheme(step, 0.6)
    law = unequal.law
    _, samples, run = advance(machine, scheme, initial_state(machine, TORQUE), np.full(4 * 4096, TORQUE), 128)
    assert run.failed == -1
    alpha = unequal.pair.working_pressure_angle
    # Where both gears are free, the driven one's angle tells the phase.
    seen = columns(samples)
    dte = law.driver.rb * seen.angle_driver - law.driven.rb * seen.angle_driven
    dte += np.cos(alpha) * (seen.y_driver - seen.y_driven)
    phases = seen.angle_driven / law.driven.pitch
    static = static_cycle(law, phases, torque=[TORQUE]).transmission_error[0]
    np.testing.assert_allclose(dte, static, rtol=1e-3)
    if boundary == "speed":
        assert np.ptp(static) > 0.2 * static.max()


def test_small_oscillations_have_the_linear_systems_frequencies(twins: Any) -> None:
    """Spectrum of a free oscillation about equilibrium against the eigenvalues of the linearised rig."""
    machine = build(twins)
    expected = natural_frequencies(machine, TORQUE, 0.0)
    expected = expected[expected < 2e4]
    assert len(expected) >= 2
    step, steps = 2.5e-6, 8192
    scheme = make_scheme(step, 1.0)
    start = initial_state(machine, TORQUE)
    angle = np.zeros(steps)
    count = iter(range(steps))
    march(machine, scheme, start, TORQUE * (1 + 1e-4), steps, lambda s, _: angle.__setitem__(next(count), s.d[0]))
    window = np.hanning(steps)
    spectrum = np.abs(np.fft.rfft((angle - angle.mean()) * window, 8 * steps))
    frequency = np.fft.rfftfreq(8 * steps, step)
    peaks = np.nonzero((spectrum[1:-1] > spectrum[:-2]) & (spectrum[1:-1] >= spectrum[2:]))[0] + 1
    peaks = peaks[np.argsort(-spectrum[peaks])]
    for number in range(2):
        found = frequency[peaks[number]]
        nearest = expected[np.argmin(np.abs(expected - found))]
        assert found == pytest.approx(nearest, rel=2e-3)


def oscillate(frequency: float, scheme: Scheme, steps: int) -> Array:
    """Displacement of an undamped unit oscillator, stepped by Chung and Hulbert's formulas as they stand."""
    w2 = (2 * np.pi * frequency) ** 2
    h, am, af, gamma, beta = scheme
    d, v, a = 1.0, 0.0, -w2
    out = []
    for _ in range(steps):
        # (1 - am) a' + am a + w2 ((1 - af) d' + af d) = 0 with d' = d + h v + h^2 ((1/2 - beta) a + beta a').
        ahead = d + h * v + h * h * (0.5 - beta) * a
        new = -(am * a + w2 * ((1 - af) * ahead + af * d)) / (1 - am + w2 * (1 - af) * beta * h * h)
        d, v, a = ahead + h * h * beta * new, v + h * ((1 - gamma) * a + gamma * new), new
        out.append(d)
    return np.array(out)


@pytest.mark.parametrize("radius", [1.0, 0.9, 0.5])
def test_frequency_error_is_that_of_a_stepped_oscillator(radius: float) -> None:
    scheme = make_scheme(1e-3, radius)
    frequency = 30.0
    x = oscillate(frequency, scheme, 4000)
    # Crossings by linear interpolation; a window of whole periods averages their errors out.
    up = np.nonzero((x[:-1] < 0) & (x[1:] >= 0))[0]
    up = up[: max(2, int(np.sum(np.abs(x[up]) + np.abs(x[up + 1]) > 1e-6)))]
    crossing = up + x[up] / (x[up] - x[up + 1])
    found = (len(crossing) - 1) / (crossing[-1] - crossing[0]) / scheme.step
    assert frequency_error(frequency, scheme) == pytest.approx(abs(found / frequency - 1), rel=2e-2)


@pytest.mark.parametrize("radius", [1.0, 0.9, 0.5, 0.0])
def test_the_spectral_radius_is_reached_at_high_frequency(radius: float) -> None:
    x = oscillate(1e9, make_scheme(1e-3, radius), 601)
    if radius == 0.0:
        assert np.abs(x[-1]) < 1e-12
    else:
        # A multiple root: radius^n, times a power of n.
        rate = (np.abs(x[600]) / np.abs(x[300])) ** (1 / 300)
        assert rate == pytest.approx(radius, rel=1e-2)


def test_pairs_that_part_and_meet_again(twins: Any) -> None:
    """The torque falls to almost nothing and rises: contact opens, flies through the backlash and settles."""
    machine = build(twins, beta=1e-5, stiffness=2e7, damping=2e4)
    steps = 8000
    t = np.linspace(0, 0.02, steps)
    torque = np.where((t > 0.001) & (t < 0.003), -0.5 * TORQUE, TORQUE)
    state, samples, run = advance(machine, make_scheme(t[1], 0.8), initial_state(machine, TORQUE), torque, 1)
    assert run.failed == -1
    assert columns(samples).loaded.min() == 0
    start = initial_state(machine, TORQUE)
    np.testing.assert_allclose(state.d[:3], start.d[:3], rtol=1e-3)
    assert state.force[state.pairs["side"] == 0].sum() > 0

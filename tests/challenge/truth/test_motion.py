"""Equations of motion of the truth rig against closed forms and balances."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from shared.ends_of_contact import last_on_line
from shared.truth_plants import drawn_plant, short_case, undamped

from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.truth.motion import derivative, integrate
from gearbench.challenge.truth.plant import (
    DEGREES,
    DRIVEN,
    DRIVER,
    LOAD,
    MODE_1,
    OUTPUTS,
    ROTOR,
    STATES,
    TWIST,
    X_DRIVEN,
    X_DRIVER,
    Y_DRIVEN,
    Y_DRIVER,
    Array,
    Coupling,
    Gears,
    Inertias,
    Plant,
    Seen,
    Tone,
)
from gearbench.fem.contact.kinematics import pair_contact, teeth_of
from gearbench.geometry import Pair, pair

FORCE, DTE = OUTPUTS.index("force"), OUTPUTS.index("dte")
HUGE = 1e12


def touching(plant: Plant, x: float, y: float) -> tuple[float, float]:
    """How far [m] a motion of the driver's geometric centre against the driven gear's closes flanks that do not turn,
    and the angle [rad] of the tangent to both base circles from the line across that of the centres at rest."""
    both = plant.base_driver + plant.base_driven
    apart = complex(both / plant.cosine - x, -y)
    pressure = np.arccos(both / abs(apart))
    tangent = pressure - np.angle(apart)
    # The strings of both base circles are wound off by as much as the tangent turns.
    wound = both * (tangent - np.arctan2(plant.sine, plant.cosine))
    return float(wound + both * plant.sine / plant.cosine - abs(apart) * np.sin(pressure)), float(tangent)


def energy(plant: Plant, state: Array, torque: float) -> float:
    """Kinetic and potential energy [J], the constant torques' included; backlash and all springs, no dampers."""
    q, v = state[:DEGREES], state[DEGREES:TWIST]
    kinetic = 0.5 * inertias(plant) @ v**2
    stretch = q[X_DRIVER:MODE_1] - q[MODE_1:] @ plant.mode_shape
    p = plant.support_exponent
    potential = np.sum(plant.support * np.abs(stretch) ** (p + 2) / plant.support_reference**p / (p + 2))
    potential += 0.5 * (plant.mode_stiffness @ q[MODE_1:] ** 2 + plant.coupling.stiffness * state[TWIST] ** 2)
    potential += 0.5 * (plant.shaft.stiffness * (q[DRIVEN] - q[LOAD]) ** 2 + plant.governor.stiffness * q[LOAD] ** 2)
    potential += plant.load_torque * q[LOAD] - torque * q[ROTOR]
    # Geometric centres, driver at 0 and driven gear at the centre distance, which drops out.
    one, two = plant.eccentricity_angle.driver + q[DRIVER], plant.eccentricity_angle.driven - q[DRIVEN]
    x = q[X_DRIVER] + plant.eccentricity.driver * np.cos(one) - q[X_DRIVEN] - plant.eccentricity.driven * np.cos(two)
    y = q[Y_DRIVER] + plant.eccentricity.driver * np.sin(one) - q[Y_DRIVEN] - plant.eccentricity.driven * np.sin(two)
    twist = plant.base_driver * q[DRIVER] - plant.base_driven * q[DRIVEN]
    working = twist + touching(plant, x, y)[0]
    back = -twist + touching(plant, x, -y)[0] - plant.teeth.backlash
    teeth = plant.teeth
    e = teeth.exponent
    for closed in (working, back):
        deflection = max(closed, 0.0)
        potential += 4e8 * deflection ** (e + 2) / teeth.reference**e / (e + 2)
    return float(kinetic + potential)


def inertias(plant: Plant) -> Array:
    """Inertia of each coordinate."""
    return np.concatenate((plant.inertia, np.repeat(plant.mass, 2), plant.mode_mass))


def off_centre(plant: Plant) -> Plant:
    """Centres far off their axes, across the line of action at rest, where they do not move the flanks."""
    alpha = np.arctan2(plant.sine, plant.cosine)
    return plant._replace(eccentricity=Gears(60e-6, 90e-6), eccentricity_angle=Gears(-alpha, -alpha))


def lively_state(plant: Plant) -> Array:
    """Gears apart in the middle of their backlash, both turning towards each other."""
    state = np.zeros(STATES)
    rng = np.random.default_rng(4)
    state[DRIVER] = -0.4 * plant.teeth.backlash / plant.base_driver
    state[X_DRIVER:DEGREES] = 3e-6 * rng.standard_normal(6)
    state[DEGREES : DEGREES + X_DRIVER] = [-4.0, 6.0, -2.0, 0.1]
    state[DEGREES + X_DRIVER : TWIST] = 0.03 * rng.standard_normal(6)
    state[TWIST] = state[ROTOR] - state[DRIVER]
    return state


def test_energy_is_kept_in_contact() -> None:
    plant = off_centre(undamped(drawn_plant()))
    state, torque = lively_state(plant), 30.0
    state[DRIVER] = 60e-6 / plant.base_driver  # deep in contact, turning slowly
    state[ROTOR] = state[DRIVER] + state[TWIST]
    state[DEGREES : DEGREES + X_DRIVER] *= 0.02
    start = energy(plant, state, torque)
    for _ in range(10):
        state, seen = integrate(plant, np.full(2, torque), state, step=5e-7, first=0, outputs=16, stride=1)
        assert seen[:, FORCE].min() > 0.0
        assert abs(energy(plant, state, torque) - start) < 1e-8 * abs(start)


def test_energy_is_kept_through_impacts_on_both_flanks() -> None:
    plant = off_centre(undamped(drawn_plant()))
    plant = plant._replace(teeth=plant.teeth._replace(backlash=10e-6))
    state, torque, step = lively_state(plant), 30.0, 5e-7
    start = energy(plant, state, torque)
    swing = 0.5 * np.array(plant.inertia) @ state[DEGREES : DEGREES + X_DRIVER] ** 2
    both = []
    for _ in range(40):
        state, seen = integrate(plant, np.full(2, torque), state, step=step, first=0, outputs=500, stride=1)
        # Contacts that begin within a step cost the method its order.
        assert abs(energy(plant, state, torque) - start) < 1e-3 * swing
        both.append((seen[:, FORCE].max(), seen[:, DTE].min()))
    highest, lowest = np.max([a for a, _ in both]), np.min([b for _, b in both])
    assert highest > 1000.0 and lowest < -1.5 * plant.teeth.backlash


@pytest.mark.parametrize("which", ["friction", "mesh", "supports", "coupling", "shaft", "housing", "governor"])
def test_each_damper_takes_energy(which: str) -> None:
    plant = undamped(drawn_plant())
    teeth = plant.teeth
    changed = {
        "friction": {"teeth": teeth._replace(friction=0.05)},
        "mesh": {"teeth": teeth._replace(damping=5e-6, damping_load=0.0, damping_onset=0.0)},
        "supports": {"support_damping": np.full(4, 3e3)},
        "coupling": {"coupling": plant.coupling._replace(damping=0.5)},
        "shaft": {"shaft": plant.shaft._replace(damping=50.0)},
        "housing": {"mode_damping": np.full(2, 1e4)},
        "governor": {"governor": plant.governor._replace(damping=500.0)},
    }[which]
    damped = plant._replace(**changed)
    state, torque = lively_state(plant), 30.0
    before = energy(plant, state, torque)
    for _ in range(30):
        state, _ = integrate(damped, np.full(2, torque), state, step=5e-7, first=0, outputs=400, stride=1)
        after = energy(plant, state, torque)
        assert after < before + 2e-5
        before = after
    assert before < energy(plant, lively_state(plant), torque) - 1e-3


def oscillator(damping: float = 0.0) -> tuple[Plant, float]:
    """The driver alone on the mesh, all else immovable; and its undamped angular frequency."""
    plant = undamped(drawn_plant())
    teeth = plant.teeth._replace(exponent=0.0, damping=damping, damping_load=0.0, damping_onset=0.0)
    driver = plant.inertia.driver
    alone = plant._replace(
        teeth=teeth,
        inertia=Inertias(HUGE, driver, HUGE, HUGE),
        mass=Gears(HUGE, HUGE),
        coupling=Coupling(0.0, 0.0, 0.0, 1.0),
        eccentricity=Gears(0.0, 0.0),
    )
    return alone, plant.base_driver * np.sqrt(4e8 / driver)


def oscillator_error(damping: float, steps: int) -> float:
    """Largest error of the dte [m] over a period and a half of the oscillator, kept in contact by its offset."""
    plant, omega = oscillator(damping)
    span = 1.5 * 2 * np.pi / omega
    start, mean = 12e-6, 10e-6  # both in contact: a constant torque would hold `mean`
    decay = 0.5 * damping * omega**2
    damped = np.sqrt(omega**2 - decay**2)
    state = np.zeros(STATES)
    state[DRIVER] = start / plant.base_driver
    # The torque acts through the coupling's elastic twist, which nothing changes.
    soft = plant._replace(coupling=Coupling(1e-6, 0.0, 0.0, 1.0))
    state[TWIST] = 4e8 * mean * plant.base_driver / 1e-6
    _, seen = integrate(soft, np.zeros(2), state, step=span / steps, first=0, outputs=steps, stride=1)
    t = np.arange(steps) * span / steps
    shape = np.cos(damped * t) + decay / damped * np.sin(damped * t)
    exact = mean + (start - mean) * np.exp(-decay * t) * shape
    return float(np.abs(seen[:, DTE] - exact).max())


@pytest.mark.parametrize("damping", [0.0, 8e-6])
def test_one_pair_and_everything_else_rigid_is_an_oscillator_integrated_with_order_four(damping: float) -> None:
    coarse, fine = oscillator_error(damping, 60), oscillator_error(damping, 120)
    assert fine < 2e-9 and coarse / fine == pytest.approx(16.0, rel=0.25)


def test_static_equilibrium() -> None:
    plant = drawn_plant()
    plant = undamped(plant)._replace(sensor_on_housing=1.0, eccentricity=Gears(0.0, 0.0), load_torque=150.0)
    torque = 150.0 * plant.base_driver / plant.base_driven
    force = torque / plant.base_driver
    p = plant.support_exponent
    centres, across = np.zeros(4), 0.0
    for _ in range(20):  # the centres' motion turns the force, by 1e-3
        across, angle = touching(plant, centres[0] - centres[2], centres[1] - centres[3])
        pull = force * np.array([-np.sin(angle), -np.cos(angle), np.sin(angle), np.cos(angle)])
        stretch = np.sign(pull) * (np.abs(pull) * plant.support_reference**p / plant.support) ** (1 / (1 + p))
        modes = plant.mode_shape @ pull / plant.mode_stiffness
        centres = stretch + modes @ plant.mode_shape
    teeth = plant.teeth
    deflection = (force * teeth.reference**teeth.exponent / 4e8) ** (1 / (1 + teeth.exponent))
    state = np.zeros(STATES)
    state[X_DRIVER:MODE_1], state[MODE_1:DEGREES] = centres, modes
    state[DRIVEN] = 150.0 / plant.shaft.stiffness
    state[DRIVER] = (deflection - across + plant.base_driven * state[DRIVEN]) / plant.base_driver
    state[TWIST] = torque / plant.coupling.stiffness
    state[ROTOR] = state[DRIVER] + state[TWIST]
    rate, seen = derivative(plant, 0.0, torque, state)
    masses = inertias(plant)
    scale = np.concatenate((np.full(4, torque), np.full(6, force)))
    assert np.abs(rate[DEGREES:TWIST] * masses / scale).max() < 1e-9
    y_driver, y_driven = stretch[Y_DRIVER - X_DRIVER], stretch[Y_DRIVEN - X_DRIVER]
    wanted = Seen(state[DRIVER], state[DRIVEN], y_driver, y_driven, 150.0, force, deflection)
    assert seen == pytest.approx(wanted, rel=1e-9)


def sliding_velocity(plant: Plant, state: Array, roll: float, alpha: float, distance: complex) -> float:
    """Speed of the driver's flank over the driven one, across the line of action at an angle alpha, from both rigid
    motions; distance [m]: of the centres."""
    tangent = np.array([-np.cos(alpha), np.sin(alpha)])
    base = plant.base_driver * np.array([np.cos(alpha), -np.sin(alpha)])
    contact = base + roll * np.array([np.sin(alpha), np.cos(alpha)])
    v = state[DEGREES:]
    spin1, spin2 = plant.speed_driver + v[DRIVER], -(plant.speed_driven + v[DRIVEN])
    from_driven = contact - np.array([distance.real, distance.imag])
    one = np.array([v[X_DRIVER], v[Y_DRIVER]]) + spin1 * np.array([-contact[1], contact[0]])
    two = np.array([v[X_DRIVEN], v[Y_DRIVEN]]) + spin2 * np.array([-from_driven[1], from_driven[0]])
    return float(tangent @ (one - two))


@pytest.mark.parametrize("turn", [-0.3, 0.2])
def test_friction_takes_force_times_sliding_velocity(turn: float) -> None:
    plant = undamped(drawn_plant())
    sound = plant._replace(speed_driver=100.0, speed_driven=100.0 * plant.base_driver / plant.base_driven)
    rubbing = sound._replace(teeth=sound.teeth._replace(friction=0.1, friction_shape=0, friction_speed=1e-6))
    state = lively_state(plant)
    angle = turn * 2 * np.pi / 20
    state[DRIVER], state[DRIVEN] = angle, (plant.base_driver * angle - 20e-6) / plant.base_driven
    (with_it, seen), (without, _) = derivative(rubbing, 0.0, 0.0, state), derivative(sound, 0.0, 0.0, state)
    masses = inertias(plant)
    forces = masses * (with_it - without)[DEGREES:TWIST]
    velocity = state[DEGREES:TWIST] + np.array([0, 100.0, sound.speed_driven, *[0.0] * 7])
    # Where the line of action has turned against the driver's rotation, the contact lies further on.
    one, two = plant.eccentricity_angle.driver + state[DRIVER], plant.eccentricity_angle.driven - state[DRIVEN]
    off = plant.eccentricity.driver * np.exp(1j * one) - plant.eccentricity.driven * np.exp(1j * two)
    off += complex(state[X_DRIVER] - state[X_DRIVEN], state[Y_DRIVER] - state[Y_DRIVEN])
    alpha = touching(plant, off.real, off.imag)[1]
    rolled = plant.base_driver * (alpha - np.arctan2(plant.sine, plant.cosine))
    roll = plant.roll_pitch + turn * plant.base_pitch + rolled
    slide = sliding_velocity(sound, state, roll, alpha, (plant.base_driver + plant.base_driven) / plant.cosine - off)
    assert seen.force > 1000.0
    assert forces @ velocity == pytest.approx(-0.1 * seen.force * abs(slide), rel=1e-6)
    assert np.sign(slide) == np.sign(turn)


def test_torques_on_the_rotor() -> None:
    plant = undamped(drawn_plant())
    size, phase = 2.0, 0.7
    ripple = np.zeros((4, 2))
    ripple[2] = [size * np.cos(phase), -size * np.sin(phase)]
    driven = plant._replace(ripple=ripple, tone=Tone(0.5, 300.0, 0.2), speed_driver=11.0)
    state = lively_state(plant)
    state[ROTOR] = 0.31
    rate, _ = derivative(driven, 0.05, 7.0, state)
    passed = plant.coupling.stiffness * state[TWIST]
    angle = 11.0 * 0.05 + 0.31
    torque = 7.0 + size * np.cos(18 * angle + phase) + 0.5 * np.cos(300.0 * 0.05 + 0.2)
    assert rate[DEGREES + ROTOR] * plant.inertia.rotor == pytest.approx(torque - passed, rel=1e-9)


def test_slipping_coupling_passes_no_more_than_its_limit() -> None:
    plant = undamped(drawn_plant())
    spring = plant.coupling.stiffness
    slipping = plant._replace(coupling=Coupling(spring, 0.0, 50.0, 1e-6 * spring))
    state = np.zeros(STATES)
    state[DEGREES + ROTOR] = 3.0
    twists = []
    for _ in range(50):
        state, _ = integrate(slipping, np.full(2, 60.0), state, step=1e-6, first=0, outputs=20, stride=1)
        twists.append(state[TWIST])
    assert 50.0 < spring * max(twists) < 60.0
    assert state[ROTOR] - state[DRIVER] - state[TWIST] > 1e-4


def test_crack_and_pitch_error_belong_to_their_tooth() -> None:
    plant = undamped(drawn_plant())
    teeth = plant.teeth
    broken = teeth.crack_driver.copy()
    broken[3] = 0.5
    late = teeth.error_driven.copy()
    late[23] = -4e-6
    share = np.full_like(teeth.stiffness, 0.4)
    plant = plant._replace(
        teeth=teeth._replace(crack_driver=broken, error_driven=late, share_driver=share, exponent=0.0),
        eccentricity=Gears(0.0, 0.0),
    )

    def force(pair: int) -> float:
        state = np.zeros(STATES)
        state[DRIVER] = pair * 2 * np.pi / 20
        state[DRIVEN] = (plant.base_driver * state[DRIVER] - 10e-6) / plant.base_driven
        return float(derivative(plant, 0.0, 0.0, state)[1].force)

    assert [force(pair) for pair in (0, 1, 2)] == pytest.approx([4000.0] * 3, rel=1e-6)
    assert [force(3), force(43)] == pytest.approx([4000.0 / 1.2] * 2, rel=1e-6)
    assert force(53) == pytest.approx(4e8 * 6e-6, rel=1e-6)
    assert force(23) == pytest.approx(4e8 * 6e-6 / 1.2, rel=1e-6)


def test_eccentric_centres_add_material_at_the_run_out_phase() -> None:
    plant = undamped(drawn_plant())._replace(eccentricity=Gears(5e-6, 0.0))
    for phase, turned, expected in ((0.4, 0.4, 5e-6), (0.4, 0.4 + np.pi, -5e-6), (0.4, 0.4 + np.pi / 2, 0.0)):
        alpha = np.arctan2(plant.sine, plant.cosine)
        placed = plant._replace(eccentricity_angle=Gears(np.pi / 2 - alpha - phase, 0.0))
        state = np.zeros(STATES)
        state[DRIVER] = turned
        state[DRIVEN] = plant.base_driver * turned / plant.base_driven
        # Second order: the square of the eccentricity over the length of the line of action.
        assert derivative(placed, 0.0, 0.0, state)[1].dte == pytest.approx(expected, abs=(5e-6) ** 2 / 0.01)


def displaced(rotation: float) -> tuple[Plant, Pair, Callable[[float, float], tuple[float, float]]]:
    """A plant without errors whose pairs carry on the path of contact alone, its gears far off their axes; and where
    its driven gear's geometric centre is from the driver's, at both rotations."""
    meshing = pair(short_case().rig)
    plant = undamped(drawn_plant())
    alpha, (low, high) = meshing.working_pressure_angle, meshing.path
    poles = Gears(np.pi / 2 - alpha + rotation, -np.pi / 2 - alpha - 0.7 * rotation)
    teeth = plant.teeth._replace(first=low, pitch=(high - low) / (plant.teeth.stiffness.size - 1), exponent=0.0)
    plant = plant._replace(eccentricity=Gears(30e-6, 50e-6), eccentricity_angle=poles, teeth=teeth)

    def place(turn1: float, turn2: float) -> tuple[float, float]:
        one = plant.eccentricity.driver * np.exp(1j * (poles.driver + turn1))
        two = plant.eccentricity.driven * np.exp(1j * (poles.driven - turn2))
        apart = meshing.centre_distance + two - one
        return float(apart.real), float(apart.imag)

    return plant, meshing, place


def at_rest(turn1: float, turn2: float) -> Array:
    state = np.zeros(STATES)
    state[DRIVER], state[DRIVEN] = turn1, turn2
    return state


@pytest.mark.parametrize("rotation", [0.0, 1.3, 2.9, 4.4])
def test_flanks_close_as_those_of_displaced_gears(rotation: float) -> None:
    """Truth: the gap of ideal gears whose centres are displaced."""
    plant, meshing, place = displaced(rotation)
    one, two = teeth_of(meshing)
    for phase in (-0.3, 0.1, 0.4):
        turn1, turn2 = phase * one.pitch + 4e-4, phase * two.pitch
        gap = pair_contact(one, two, 0, 0, turn1, turn2, *place(turn1, turn2)).gap
        assert derivative(plant, 0.0, 0.0, at_rest(turn1, turn2))[1].dte == pytest.approx(-gap, abs=1e-14)


@pytest.mark.parametrize("rotation", [0.0, 1.3, 2.9, 4.4])
def test_pairs_begin_and_end_at_the_tips_of_displaced_gears(rotation: float) -> None:
    plant, meshing, place = displaced(rotation)
    for low, high in ((-0.3, meshing.path[0] - 0.1), (0.3, meshing.path[1] + 0.1)):
        turn1, turn2 = last_on_line(meshing, place, low, high)
        beyond = np.copysign(1e-5, high)  # of a pitch; run-out and the displaced line of action shift ends by 1e-2
        pairs = []
        for part in (-beyond, beyond):
            # Pressed by ten nanometres, which counts pairs and moves no end.
            state = at_rest(turn1 + part * meshing.driver.pitch_angle, turn2 + part * meshing.driven.pitch_angle)
            state[DRIVER] += (1e-8 - derivative(plant, 0.0, 0.0, state)[1].dte) / plant.base_driver
            pairs.append(derivative(plant, 0.0, 0.0, state)[1].force / (4e8 * 1e-8))
        assert pairs == pytest.approx([2.0, 1.0], rel=2e-3)


def test_integration_refuses_nonsense() -> None:
    plant = drawn_plant()
    with pytest.raises(ChallengeError, match="even number"):
        integrate(plant, np.zeros(3), np.zeros(STATES), step=1e-6, first=0, outputs=1, stride=1)
    with pytest.raises(ChallengeError, match="shape"):
        integrate(plant, np.zeros(2), np.zeros(6), step=1e-6, first=0, outputs=1, stride=1)
    with pytest.raises(ChallengeError, match="too long"):
        integrate(plant, np.full(2, 100.0), np.ones(STATES), step=1e-2, first=0, outputs=400, stride=1)

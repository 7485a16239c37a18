"""A rig made ready for the reduced finite-element model: gears condensed, contact tabulated, step chosen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.plan.rotation import Rotation
from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.record.attributes import bodies_of
from gearbench.fem.contact.law import PAIRS, Law, elastic_pair
from gearbench.fem.contact.static import position, static_cycle
from gearbench.fem.contact.store import stored_law
from gearbench.fem.gear.body import CondensedGear
from gearbench.fem.gear.store import stored_gear
from gearbench.fem.motion.hubs import ABSENT, hubs_at_rest, spring_tangent
from gearbench.fem.motion.imposed import hardened, stiffness_factor
from gearbench.fem.motion.machine import (
    STEADY,
    Machine,
    contact_rows,
    damping_matrix,
    make_machine,
    mass_matrix,
    modal_flexibility,
    stiffness_matrix,
)
from gearbench.fem.motion.scheme import frequency_error, make_scheme
from gearbench.geometry import Body, Pair
from gearbench.geometry.mesh.sector import refuse_crack
from gearbench.lumped.linear.time_step import FREQUENCY_ERROR, STEPS_PER_MESH
from gearbench.rig import Case, Rig, Simulation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ElasticRig:
    """Pair, condensed gears and contact law of a rig; `bodies` hold the gears' total masses and inertias."""

    rig: Rig
    pair: Pair
    gears: tuple[CondensedGear, CondensedGear]
    bodies: tuple[Body, Body]
    law: Law


def elastic_rig(
    rig: Rig, simulation: Simulation, progress: Callable[[str], None] | None = None
) -> ElasticRig:
    """Mesh, condense and tabulate, each from disk where it has been done before. Raises GeometryError."""
    say = progress or (lambda note: None)
    for name, gear in (("rig.driver", rig.driver), ("rig.driven", rig.driven)):
        refuse_crack(gear, simulation.element, name, "simulation.element")
    meshing = elastic_pair(rig)
    bodies = bodies_of(rig, meshing)
    size, modes, element = simulation.element_size, simulation.modes, simulation.element
    say("condensing the driver")
    driver = stored_gear(rig.driver, rig.material, size, modes, element)
    say("condensing the driven gear")
    driven = stored_gear(rig.driven, rig.material, size, modes, element)
    say("solving contact lines")
    law = stored_law(rig, (driver, driven), size, modes, element)
    return ElasticRig(rig, meshing, (driver, driven), bodies, law)


def machine_for(
    elastic: ElasticRig,
    mesh_frequency: float,
    mean_torque: float = 0.0,
    duration: float = 1.0,
    rotation: Rotation | None = None,
) -> Machine:
    """Equations of motion at a mesh frequency [Hz], mean torque [N m] and duration of the record [s]; `rotation`:
    where the speed changes."""
    e, course = elastic, STEADY
    if rotation is not None:
        course = course._replace(time=rotation.time, speed=rotation.speed, angle=rotation.angle)
    return make_machine(e.rig, e.pair, e.law, e.gears, e.bodies, mesh_frequency, mean_torque, duration, course)


def natural_frequencies(machine: Machine, torque: float, phase: float) -> Array:
    """Frequencies [Hz] of the rig's oscillatory eigenvalues, linearised about static equilibrium, without friction.

    The supports' damping is part of them: it may be so strong that their motions do not oscillate.
    """
    values = eigenvalues(machine, torque, phase)
    return np.sort(np.abs(values[values.imag > 1e-6 * np.abs(values)])) / (2 * pi)


def slowest_decay(machine: Machine, torque: float, phase: float, highest: float) -> float:
    """Slowest rate [1/s] at which free vibrations below a frequency [Hz] die out, linearised likewise.

    The turning of both gears together, where nothing holds it back, is no vibration.
    """
    values = eigenvalues(machine, torque, phase)
    values = values[np.argsort(np.abs(values))]
    free = machine.driven_at != ABSENT and machine.loaded_at != ABSENT
    values = values[2:] if free else values
    return float(-values[np.abs(values) <= 2 * pi * highest].real.max(initial=-np.inf))


class Linearised(NamedTuple):
    """Equations of motion (n, n) of what moves about static equilibrium; `rows` (pairs, n): how its rigid hubs move the
    gaps of the pairs that carry, and `opened` (n,): the forces [N] and moments that opening all of them by 1 m makes.
    """

    mass: Array
    damping: Array
    stiffness: Array
    rows: Array
    opened: Array


def linearised(machine: Machine, torque: float, phase: float) -> Linearised:
    """The rig about static equilibrium under a driver torque [N m] at a mesh phase [cycles]."""
    law, hubs = machine.law, machine.hubs
    factor = stiffness_factor(machine.correction, phase, 0.0)
    factor = hardened(machine.correction, factor, torque / law.driver.rb)
    cycle = static_cycle(law, np.array([phase]), torque=[torque / factor], key="experiment.torque_mean_nm")
    dte = cycle.transmission_error[0, 0]
    theta1 = phase * law.driver.pitch + dte / law.driver.rb
    theta2 = phase * law.driven.pitch
    found = position(law, theta1, theta2, 0.0, 0.0, 0.0, 0.0, np.zeros(PAIRS))
    rows = contact_rows(machine, found.pairs)[found.active]
    # Modes are unknowns of their own here, so the pairs keep only the residual's flexibility.
    stiffer = factor * (1.0 + machine.correction.exponent)
    residual = found.flexibility[np.ix_(found.active, found.active)] / stiffer - modal_flexibility(machine, rows)
    stiffness = stiffness_matrix(machine) + rows.T @ np.linalg.solve(residual, rows)
    push = factor * found.force[found.active] @ rows[:, :hubs]
    rest = hubs_at_rest(machine.hub_stiffness, machine.springs, machine.at, machine.held, push)
    stiffness[:hubs, :hubs] += spring_tangent(machine.springs, rest)
    moving = np.ones(len(machine.mass), np.bool_)
    moving[:hubs] = ~machine.held
    keep = np.ix_(moving, moving)
    mass, damping = mass_matrix(machine, theta1, theta2)[keep], damping_matrix(machine)[keep]
    opened = (rows.T @ np.linalg.solve(residual, np.ones(len(rows))))[moving]
    rows[:, hubs:] = 0.0
    return Linearised(mass, damping, stiffness[keep], rows[:, moving], opened)


def eigenvalues(machine: Machine, torque: float, phase: float) -> NDArray[np.complex128]:
    """Eigenvalues [1/s] of the rig about static equilibrium under a driver torque [N m] at a mesh phase [cycles]."""
    about = linearised(machine, torque, phase)
    size = len(about.mass)
    system = np.block(
        [
            [np.zeros((size, size)), np.eye(size)],
            [-np.linalg.solve(about.mass, about.stiffness), -np.linalg.solve(about.mass, about.damping)],
        ]
    )
    return np.asarray(np.linalg.eigvals(system))


def beside_rest(machine: Machine, torque: float, phase: float, frequency: float) -> float:
    """How far the mesh's answer to errors of its teeth that come at a frequency [Hz] departs from that at rest, over
    that at rest: little where all vibrations that the mesh takes part in are faster."""
    about, omega = linearised(machine, torque, phase), 2 * pi * frequency
    dynamic = about.stiffness + 1j * omega * about.damping - omega**2 * about.mass
    moved = about.rows @ np.linalg.solve(dynamic, about.opened)
    # Gears that turn freely together open nothing: of all answers at rest the least one.
    still = about.rows @ np.linalg.lstsq(about.stiffness, about.opened)[0]
    return float(abs(moved.mean() / still.mean() - 1.0))


def choose_substeps(machine: Machine, case: Case, plan: Schedule) -> int:
    """Steps per sample that keep the highest mode within the identified band to the same frequency error, and the mesh
    period to as many steps, as the lumped models'.

    Raises BenchError where the case asks for fewer.
    """
    band = case.identification.band or (
        case.experiment.multisine.band
        if case.experiment.multisine
        else (0.0, case.experiment.sampling_rate / 2)
    )
    modes = np.concatenate(
        [natural_frequencies(machine, case.experiment.torque_mean, phase) for phase in (0.0, 0.25, 0.5)]
    )
    inside = modes[modes <= band[1]]
    highest = float(inside.max()) if len(inside) else band[1]
    least = ceil(STEPS_PER_MESH / (plan.shortest_mesh_period * plan.sampling_rate))

    def error(substeps: int) -> float:
        step = 1.0 / (plan.sampling_rate * substeps)
        return frequency_error(highest, make_scheme(step, case.simulation.spectral_radius))

    needed = least
    while error(needed) > FREQUENCY_ERROR:
        needed = ceil(needed * 1.1)
    asked = case.simulation.substeps
    if asked and asked < needed:
        raise BenchError(
            f"simulation.substeps = {asked} is too few: a frequency error of at most"
            f" {FREQUENCY_ERROR:.2%} at {highest:.0f} Hz and {STEPS_PER_MESH} steps a mesh period need"
            f" {needed} (0 chooses them)"
        )
    return asked or needed

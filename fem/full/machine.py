"""The unreduced rig: both hubs on their supports, both gears with all their unknowns, one contact law.

Unknowns of the hubs (h,): driver rotation beyond its nominal angle [rad]; the driven gear's likewise where its speed is
not prescribed; support motions of driver and driven gear [m], in inertial coordinates. Each gear's elastic displacement
is relative to its hub, in its own rotating frame, where mass and stiffness are constant. Coriolis and centrifugal terms
of that displacement (not of the hubs) are left out: relative to the elastic forces they are of the order (speed of
rotation / lowest natural frequency)^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.law import Law
from gearbench.fem.full.gear import FullGear
from gearbench.fem.motion.machine import STEADY, Course, Pace, pace_on
from gearbench.geometry.pair.kinematics import Pair
from gearbench.geometry.tooth.body import Body
from gearbench.rig import Rig

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Machine:
    """Equations of motion of the unreduced rig.

    gears: driver, driven gear; rotations: 1 where the driven speed is prescribed, 2 where both gears turn freely; axis
    (2,): direction of the support motion; mass, damping, stiffness (h,): of the hubs' unknowns, the gears' whole mass
    included; speeds: nominal [rad/s], up to time 0 where `course` changes them; beta [s]: stiffness-proportional
    damping; surfaces: whether the meshes' own surfaces touch, not the contact law's flanks.
    """

    law: Law
    gears: tuple[FullGear, FullGear]
    rotations: int
    axis: Array
    mass: Array
    damping: Array
    stiffness: Array
    speeds: tuple[float, float]
    beta: float
    surfaces: bool = False
    course: Course = STEADY

    @property
    def hubs(self) -> int:
        """Number of hub unknowns."""
        return self.rotations + 2

    @property
    def unknowns(self) -> int:
        """All unknowns."""
        return self.hubs + sum(gear.free for gear in self.gears)


def make_machine(
    rig: Rig,
    pair: Pair,
    law: Law,
    gears: tuple[FullGear, FullGear],
    bodies: tuple[Body, Body],
    mesh_frequency: float,
    surfaces: bool = False,
    course: Course = STEADY,
) -> Machine:
    """The model of a rig at a mesh frequency [Hz]; gears and bodies: driver first; surfaces: as in `Machine`; `course`
    changes the speed from time 0 on (its inertias are those of the rig)."""
    rotations = 1 if rig.load.boundary == "speed" else 2
    supports = rig.support.driver.holding(bodies[0].mass), rig.support.driven.holding(bodies[1].mass)
    alpha = pair.working_pressure_angle if rig.support.direction == "line-of-action" else 0.0
    still = np.zeros(rotations)
    return Machine(
        law=law,
        gears=gears,
        rotations=rotations,
        axis=np.array([sin(alpha), cos(alpha)]),
        mass=np.array([body.inertia for body in bodies[:rotations]] + [support.mass for support in supports]),
        damping=np.concatenate([still, [support.damping for support in supports]]),
        stiffness=np.concatenate([still, [support.stiffness for support in supports]]),
        speeds=(2 * pi * mesh_frequency / gears[0].teeth, 2 * pi * mesh_frequency / gears[1].teeth),
        beta=rig.damping.beta,
        surfaces=surfaces,
        course=course._replace(inertia2=_sped_up(rig, bodies, rotations == 2)),
    )


def _sped_up(rig: Rig, bodies: tuple[Body, Body], free: bool) -> float:
    """Inertia [kg m^2] that the load's torque speeds up: the driven gear's, or all that turns, seen from there."""
    ratio = rig.driven.teeth / rig.driver.teeth
    return bodies[1].inertia + (bodies[0].inertia * ratio**2 if free else 0.0)


class Angles(NamedTuple):
    """Angles of both gears [rad], each in its own nominal direction."""

    driver: float
    driven: float


def nominal(machine: Machine, t: float) -> Pace:
    """The nominal rotation at time t [s]."""
    return pace_on(machine.course, *machine.speeds, t)


def angles(machine: Machine, hub: Array, t: float) -> Angles:
    """Angles at the hub unknowns (h,) and the time t [s]."""
    at = nominal(machine, t)
    return Angles(at.angle1 + hub[0], at.angle2 + hub[1] if machine.rotations == 2 else at.angle2)


def hub_motions(machine: Machine, at: Angles) -> tuple[Array, Array]:
    """Rigid motion (h, 3) of each gear per hub unknown: along x and y of its rotating frame, and counter-clockwise."""
    law, r = machine.law, machine.rotations
    turned = at.driver + law.driver.zero, law.driven.zero - at.driven + pi
    out = np.zeros((2, machine.hubs, 3))
    for gear, chi in enumerate(turned):
        x, y = machine.axis
        out[gear, r + gear, :2] = x * cos(chi) + y * sin(chi), -x * sin(chi) + y * cos(chi)
    out[0, 0, 2] = 1.0
    if r == 2:
        out[1, 1, 2] = -1.0
    return out[0], out[1]

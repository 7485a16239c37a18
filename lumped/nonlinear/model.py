"""The non-linear lumped model: one mesh spring F(delta, phase, tooth) between two gears on supports, with the effects
that the linear model leaves out.

    M_1 u1'' = (T1 + T_r)/rb1 - f - mu f m1/rb1                    [+ S (w - u1) + D (w' - u1'), see below]
    M_2 u2'' = f + mu f m2/rb2 - T2/rb2                            (u2 = 0 where the driven speed is prescribed)
    m_1 y1'' + c_1 y1' + k_1 y1 |y1/y_ref|^e = -g f - mu f s sin(a_w)
    m_2 y2'' + c_2 y2' + k_2 y2 |y2/y_ref|^e = +g f + mu f s sin(a_w)
    delta = u1 - u2 + g (y1 - y2) + a,   f = max(0, G F(delta, phase) + 2 zeta sqrt(G dF/d delta m_e) delta')
    F = sum over pairs of F_n(delta + e_n, phase) / (1 + b_n)

Run-out makes the levers of f rb_i (1 + l_i) and turns it, and the line of action, by phi: M_1 u1'' has (1 + l_1) f, M_2
u2'' (1 + l_2) f, g is cos(a) + phi sin(a), and delta has the same factors (`tables`).

u_i = rb_i (theta_i - Omega_i t); g, signs and zeros as in `lumped.model`. a is the excess material common to all pairs:
run-out of both gears, errors over the mesh cycle. F_n is what pair n carries of the force of sound teeth at a
deflection, e_n its own excess, the pitch errors of its two teeth, and b_n what a crack adds to its compliance: (bending
part) (1/(1 - loss) - 1). G is scale and series of the mesh correction. f is zero while the flanks are apart and pulls
the other way, without friction, once the back flanks touch; on both sides damping acts only in contact and never holds
the flanks together. T_r is the torque ripple.

Friction of every pair acts against its own sliding velocity at that instant, vibration included (sin(a_w) only where
supports are tangential; Omega1, Omega2 the steady speeds, rho1 and rho2 the roll lengths):

    v = rho1 (Omega1 + u1'/rb1) - rho2 (Omega2 + u2'/rb2) + (y1' - y2') sin(a_w)
    (m1, s, m2) = sum over pairs of share tanh(v/v0) (rho1, 1, rho2)

With v of the steady rotation alone these are the levers of `MeshLaw.friction`; where vibration slides faster than
that, it turns dry friction into a smaller mean force and a damper.

A rotor beyond a coupling, w = rb1 (theta_r - Omega1 t), takes T1 + T_r where the coupling has a stiffness: M_r w'' =
(T1 + T_r)/rb1 - S (w - u1) - D (w' - u1'), and the gear only the bracket; without a stiffness its inertia turns with
the gear. m_e counts the rotor in both cases, so that a stiffer and stiffer coupling tends to the rigid one.

Where both gears turn freely T2 balances driver torque and friction at any time: T2/rb2 = T1/rb1 - mu f (m1/rb1 -
m2/rb2); the mean speed then stays, and ripple alone moves both gears together.

What else a real rig has (a shaft behind the driven gear, a housing, supports across, other boundaries) is a
`lumped.nonlinear.structure` beside these equations.

Where the speed changes, u_i and w are departures from the changing rotation: all of them that move lag behind its
acceleration A = rb1 Omega1', and what is held at its speed takes M A; where both gears turn freely, T2/rb2 is less by
what all of them take.

Mesh phase and shaft angles are those of the nominal rotation, not of the vibrating gears: vibrations of 10 um shift
the phase by a thousandth of a cycle. With a prescribed driven speed the phase is exact, as it is the driven gear's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import cos, inf, pi, sin, tan

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry import Pair, body
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.linear.model import mesh_mass_of
from gearbench.lumped.nonlinear.constants import Constants, Rubbing
from gearbench.lumped.nonlinear.coordinates import Coordinates, Further, leaning_of
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.limits import limits_of
from gearbench.lumped.nonlinear.pressing import Instants, alike, travel_under
from gearbench.lumped.nonlinear.rest import (
    Around,
    SupportSpring,
    centre_at_rest,
    displacement_directions,
    housing_at_rest,
    inverse_masses,
    mesh_direction,
    springs_and_dampers,
    support_springs,
)
from gearbench.lumped.nonlinear.structure import (
    Structure,
    driven_turns,
    has_structure,
    structure_of,
)
from gearbench.rig import Rig

Array = NDArray[np.float64]

# Of friction's decay rate, what a step resolves like a mode: Runge-Kutta then is stable up to 0.7 of the largest
# tabulated force. Beyond it, sliding turns round at every step; the force stays bounded.
RESOLVED = 0.125
# Of a mode beyond half the sampling rate, what a step resolves like one below: its frequency is then right to 1 % and
# its damping ratio to 0.01, far from where Runge-Kutta becomes unstable.
UNSEEN = 0.5

REST_PHASES = 16  # over which the place at rest is averaged


@dataclass(frozen=True, eq=False)
class NonLinear:
    """The model of one rig. base_radii [m]; masses [kg]: M_1 (the rotor included where it is rigid), M_2 (likewise),
    M_r (0: rigid or none), m_1, m_2; outer: M_l beyond an elastic shaft of the load (0: none that turns)."""

    rig: Rig
    teeth: MeshLaw
    base_radii: tuple[float, float]
    working_pressure_angle: float
    factor: float
    masses: tuple[float, float, float, float, float]
    mesh_mass: float  # m_e [kg]
    path: tuple[float, float]  # start and end of the path of contact behind the pitch point, in base pitches
    outer: float = 0.0
    nudge: float = 0.0  # damper [N s/m] between the driver and the motion that its table has for it

    @cached_property
    def law(self) -> MeshLaw:
        """That of the mesh: of its teeth, with the rig's exponent."""
        return self.teeth.hardened(self.rig.mesh.exponent, self.rig.mesh.reference_force)

    @property
    def free(self) -> bool:
        """Whether nothing holds the rotation of both gears together."""
        return self.rig.turns_freely

    @property
    def slide(self) -> float:
        """Sine of the angle from the supports' direction to the line of action: the part of the friction force that the
        supports feel, and what a motion across them contributes to the DTE."""
        return sin(self.working_pressure_angle) if self.rig.support.direction == "tangential" else 0.0

    @property
    def length_of_action(self) -> float:
        """Length [m] of the line of action between the base circles."""
        return sum(self.base_radii) * tan(self.working_pressure_angle)

    @property
    def leaning(self) -> float:
        """How far [cycles] the mesh turns back where a motion of the centres along their supports closes it by 1 m."""
        return leaning_of(self.base_radii, self.rig.support.direction == "tangential") / self.teeth.base_pitch

    def turned_on(self, places: Array) -> Array:
        """How far [cycles] the centres' motion turns the mesh on beyond its rotation, at the places (..., n) [m]."""
        return np.asarray(-self.leaning * self.factor * (places[..., 1] - places[..., 2]))

    def twisted_on(self, force: float) -> float:
        """How far [cycles] the driven gear at rest under the mesh force [N] stands beyond its steady rotation, where
        the speed of either end is held: by the twist of a shaft behind it, and what lies between the driver and it."""
        structure = self.structure
        if structure is None or not (structure.held or self.rig.drive.boundary == "speed"):
            return 0.0
        if self.rig.drive.boundary != "speed":  # the shaft's twist is the same at every phase of the mesh
            return structure.held * self._load_twist(force) / self.teeth.base_pitch
        gain = np.array([self.rig.mesh.stiffness_scale])
        phases = (alike(np.array([n / REST_PHASES]), np.zeros(1), gain) for n in range(REST_PHASES))
        rest = [Coordinates(*self.equilibrium(force, at)[: len(Coordinates._fields)]).u2 for at in phases]
        return float(np.mean(rest)) / self.teeth.base_pitch

    @property
    def structure(self) -> Structure | None:
        """What the integrator needs beyond `constants`; None for a rig without more structure."""
        return structure_of(self.rig, self.masses[3:], self.outer, self.base_radii[1])

    @property
    def limits(self) -> tuple[str, ...]:
        """What the model leaves out of this rig, in words."""
        return limits_of(self.rig)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(Coordinates._fields) + (len(Further._fields) if has_structure(self.rig) else 0)

    @property
    def elastic_shaft(self) -> bool:
        """Whether the rotor is a coordinate of its own."""
        return self.masses[2] > 0

    def like(self, other: NonLinear) -> bool:
        """Whether both models have the same coordinates, the same of which move."""
        if self.size != other.size or self.elastic_shaft != other.elastic_shaft:
            return False
        here, there = (inverse_masses(one.constants(), one.structure) > 0.0 for one in (self, other))
        return bool((here == there).all())

    @property
    def ends(self) -> tuple[float, float]:
        """What the torques of drive and load speed up beside the coordinates [kg], on the base circles: what turns
        rigidly at a prescribed speed, or, at the load where neither is prescribed, all that turns."""
        if self.free:
            return 0.0, sum(self.masses[:3]) + self.outer
        drive = self.masses[2] if self.elastic_shaft else self.masses[0]
        load, shaft = self.masses[1], self.rig.load.coupling
        if self.rig.load.twists and shaft is not None:
            load = shaft.inertia / self.base_radii[1] ** 2
        return (
            drive if self.rig.drive.boundary == "speed" else 0.0,
            load if self.rig.load.boundary == "speed" else 0.0,
        )

    @property
    def shaft(self) -> tuple[float, float]:
        """Stiffness [N/m] and damping [N s/m] of the coupling on the driver's base circle."""
        coupling, square = self.rig.drive.coupling, self.base_radii[0] ** 2
        if coupling is None or coupling.stiffness is None:
            return 0.0, 0.0
        return coupling.stiffness / square, coupling.damping / square

    def constants(self) -> Constants:
        """What the integrator needs, table apart."""
        one, two = self.rig.support.driver, self.rig.support.driven
        m1, m2, rotor, mass1, mass2 = self.masses
        held1, held2 = one.holding(mass1), two.holding(mass2)
        stiffness, damping = self.shaft
        driven = self.rig.drive.boundary == "speed"
        return Constants(
            inverse_u1=0.0 if driven and not rotor else 1.0 / m1,
            inverse_u2=1.0 / m2 if driven_turns(self.rig) else 0.0,
            inverse_w=1.0 / rotor if rotor and not driven else 0.0,
            inverse_y1=1.0 / held1.mass,
            inverse_y2=1.0 / held2.mass,
            rigid=0.0 if rotor else 1.0,
            shaft_stiffness=stiffness,
            shaft_damping=damping,
            factor=self.factor,
            slide=self.slide,
            stiffness1=held1.stiffness,
            stiffness2=held2.stiffness,
            damping1=held1.damping,
            damping2=held2.damping,
            exponent1=one.exponent,
            exponent2=two.exponent,
            reference1=one.reference_deflection,
            reference2=two.reference_deflection,
            damping_factor=2 * self.rig.damping.mesh_ratio * float(np.sqrt(self.mesh_mass)),
            damping_exponent=self.rig.damping.mesh_exponent,
            damping_pliancy=1.0 / self.rig.damping.mesh_reference_force,
            backlash=self.teeth.backlash,
            root=(len(self.teeth.approach) - 1) / float(np.sqrt(self.teeth.approach[-1])),
            mirror=self.teeth.mirror * self.teeth.phases,
            nudge=self.nudge,
            leaning=self.leaning * self.teeth.phases,
        )

    def viscosity(self, stiffness: Array | float, force: Array | float) -> Array:
        """Damping coefficient of the mesh [N s/m] at tangents [N/m] and elastic forces [N]."""
        damping = self.rig.damping
        loaded = (np.maximum(force, 0.0) / damping.mesh_reference_force) ** damping.mesh_exponent
        return np.asarray(self.constants().damping_factor * np.sqrt(stiffness) * loaded)

    def rubbing(self, mesh_frequency: float) -> Rubbing | None:
        """What the integrator needs for friction at a mesh frequency [Hz]; None without friction."""
        friction, law = self.rig.friction, self.law
        if friction.coefficient == 0.0:
            return None
        (r1, r2), (roll1, roll2) = self.base_radii, law.pitch_roll
        speeds = 2 * pi * mesh_frequency * (1 / self.rig.driver.teeth + 1 / self.rig.driven.teeth)
        return Rubbing(
            coefficient=friction.coefficient,
            steepness=1.0 / friction.transition_speed,
            drift=law.base_pitch * speeds,
            centre1=roll1 / r1,
            centre2=roll2 / r2,
            pitch1=law.base_pitch / r1,
            pitch2=law.base_pitch / r2,
            slide=self.slide,
            offset=float(law.offsets[0]),
            carried=law.carried,
        )

    def friction_rate(self) -> float:
        """Decay rate [1/s] of sliding at the pitch point where it turns round, at the largest tabulated force."""
        c, s, friction = self.constants(), self.structure, self.rig.friction
        levers = [roll / radius for roll, radius in zip(self.law.pitch_roll, self.base_radii, strict=True)]
        yielding = levers[0] ** 2 * c.inverse_u1 + levers[1] ** 2 * c.inverse_u2
        yielding += self.slide**2 * (c.inverse_y1 + c.inverse_y2)
        if s is not None:
            yielding += self.factor**2 * (s.inverse_x1 + s.inverse_x2)
        return friction.coefficient * float(self.law.force.max()) / friction.transition_speed * yielding

    def centres(self, force: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Deflections along and across [m] of both supports at rest under the mesh force [N]."""
        one, two = self.rig.support.driver, self.rig.support.driven
        along, across = self.factor * force, self.slide * force
        return centre_at_rest(one, -along, -across), centre_at_rest(two, along, across)

    def equilibrium(self, force: float, at: Instants) -> Array:
        """State (2 size,) at rest at one instant under the force T1/rb1 > 0 [N], without friction and ripple: all
        coordinates, then their rates. A housing that takes both supports along alike is where it is without load."""
        (y1, x1), (y2, x2) = self.centres(force)
        structure = self.structure
        housed = housing_at_rest(structure, self.factor * force, self.slide * force)
        y1, y2 = y1 + housed.along[0], y2 + housed.along[1]
        x1, x2 = x1 + housed.across[0], x2 + housed.across[1]
        apart = float(travel_under(self.law, at, np.array([force]))[0]) - self.factor * (y1 - y2)
        twist = force / self.shaft[0] if self.elastic_shaft else 0.0
        if structure is None:
            return np.array([*Coordinates(apart, y1, y2, 0.0, apart + twist), *(0.0 for _ in Coordinates._fields)])
        apart -= self.slide * (x1 - x2)
        out = self._load_twist(force)
        # The end whose speed is prescribed is where it would be in steady rotation.
        u2 = -twist - apart if self.rig.drive.boundary == "speed" else structure.held * out
        place = Coordinates(u2 + apart, y1, y2, u2, u2 + apart + twist), Further(u2 - out, *housed.motions, x1, x2)
        return np.array([*place[0], *place[1], *np.zeros(self.size)])

    def _load_twist(self, force: float) -> float:
        """How far [m] the load's shaft twists under the mesh force [N]."""
        structure = self.structure
        return force / structure.load_stiffness if structure is not None and self.rig.load.twists else 0.0

    @cached_property
    def support_springs(self) -> tuple[SupportSpring, SupportSpring]:
        """The supports of driver and driven gear along their direction."""
        return support_springs(self.constants(), self.structure)

    @cached_property
    def displacements(self) -> tuple[Array, Array]:
        """What each coordinate contributes to what the displacement sensors of driver and driven gear show (size,)."""
        housing = self.rig.housing
        return displacement_directions(self.structure, housing.sensor_share if housing is not None else 0.0)

    def around(self, deflections: tuple[float, float]) -> Around:
        """The rig around its mesh, with its supports as stiff as they are about these deflections [m]."""
        c, s = self.constants(), self.structure
        one, two = (float(spring.tangent(y)) for spring, y in zip(self.support_springs, deflections, strict=True))
        return Around(*springs_and_dampers(c, s, (one, two)), inverse_masses(c, s), mesh_direction(c, s))

    def linearised(self, stiffness: float, force: float, turning: float = 0.0) -> Array:
        """State matrix (2 size, 2 size) at a mesh stiffness [N/m], supports at rest under `force`, of a mesh whose
        force changes by `turning` [N/cycle] where the centres' motion turns it.

        Without friction: away from the pitch point small vibrations do not turn the steady direction of sliding.
        """
        (y1, _), (y2, _) = self.centres(force)
        springs, dampers, inverse, mesh = self.around((y1, y2))
        springs += stiffness * np.outer(mesh, mesh)
        springs += turning * np.outer(mesh, self.turned_on(np.eye(self.size)))
        dampers += self.viscosity(stiffness, force) * np.outer(mesh, mesh)
        size = self.size
        matrix = np.zeros((2 * size, 2 * size))
        matrix[:size, size:] = np.eye(size)
        matrix[size:, :size] = -inverse[:, None] * springs
        matrix[size:, size:] = -inverse[:, None] * dampers
        return matrix

    def fastest_rate(self, force: float, visible: float = inf, coarser: float = 1.0) -> float:
        """Rate [rad/s] that steps must resolve: the largest magnitude of an eigenvalue over the mesh cycle, at the
        largest tabulated deflection; or more, where friction turns round faster than a step of such a mode bears.

        Modes faster than `visible` [rad/s], which no sample shows, count with the part UNSEEN. Steps may be `coarser`
        for modes by that factor; friction bears no coarser ones.
        """
        gain = self.rig.mesh.stiffness_scale
        gain *= 1 + sum(np.hypot(self.rig.mesh.stiffness_cos, self.rig.mesh.stiffness_sin)) if self._shaped else 1.0
        gain *= 1 + max(self.rig.mesh.stiffness_drift, 0.0)
        _, tangent = self.law.evaluate(self.law.approach[-1], np.arange(self.law.phases) / self.law.phases)
        modes = np.abs(np.linalg.eigvals(self.linearised(gain * float(tangent.max()), force)))
        modes = np.where(modes > visible, UNSEEN * modes, modes)
        return max(float(modes.max()) / coarser, RESOLVED * self.friction_rate())

    @property
    def _shaped(self) -> bool:
        return bool(self.rig.mesh.stiffness_cos)

    def slowest_decay(self, force: float) -> float:
        """Smallest decay rate [1/s] of a vibration at the lowest mesh stiffness, linearised."""
        _, tangent = self.law.evaluate(0.3 * self.law.approach[-1], np.arange(self.law.phases) / self.law.phases)
        values = np.linalg.eigvals(self.linearised(self.rig.mesh.stiffness_scale * float(tangent.min()), force))
        moving = values[np.abs(values) > 1e-6 * np.abs(values).max()]
        return float((-moving.real).min())


def nonlinear_model(rig: Rig, meshing: Pair, law: MeshLaw) -> NonLinear:
    """The model of a rig whose teeth follow `law`. Raises LumpedError."""
    density = rig.material.density
    one = body(meshing.driver, rig.driver, density, "rig.driver")
    two = body(meshing.driven, rig.driven, density, "rig.driven")
    r1, r2 = meshing.driver.base_radius, meshing.driven.base_radius
    coupling = rig.drive.coupling
    rotor = coupling.inertia if coupling is not None else 0.0
    elastic = rig.drive.twists
    for name, support in (("driver", rig.support.driver), ("driven", rig.support.driven)):
        if not support.exponent > -1.0:
            raise LumpedError(f"rig.support.{name}.exponent = {support.exponent:g} must be more than -1")
    shaft = rig.load.coupling
    output = shaft.inertia if shaft is not None else 0.0
    twists = rig.load.twists
    turning = one.inertia + (0.0 if elastic else rotor), two.inertia + (0.0 if twists else output)
    return NonLinear(
        rig=rig,
        teeth=law,
        base_radii=(r1, r2),
        working_pressure_angle=meshing.working_pressure_angle,
        factor=cos(meshing.working_pressure_angle) if rig.support.direction == "tangential" else 1.0,
        masses=(turning[0] / r1**2, turning[1] / r2**2, rotor / r1**2 if elastic else 0.0, one.mass, two.mass),
        mesh_mass=mesh_mass_of(rig, (r1, r2), (one.inertia + rotor, two.inertia + output)),
        path=meshing.path,
        outer=output / r2**2 if twists and rig.load.boundary != "speed" else 0.0,
    )

"""The non-linear lumped model: one mesh spring F(delta, phase, tooth) between two gears on supports, with the effects
that the linear model leaves out.

    M_1 u1'' = (T1 + T_r)/rb1 - f - mu f m1/rb1                    [+ S (w - u1) + D (w' - u1'), see below]
    M_2 u2'' = f + mu f m2/rb2 - T2/rb2                            (u2 = 0 where the driven speed is prescribed)
    m_1 y1'' + c_1 y1' + k_1 y1 |y1/y_ref|^e = -g f - mu f s sin(a_w)
    m_2 y2'' + c_2 y2' + k_2 y2 |y2/y_ref|^e = +g f + mu f s sin(a_w)
    delta = u1 - u2 + g (y1 - y2) + a,   f = max(0, F(delta, phase) G + 2 zeta sqrt(G dF/d delta m_e) delta')

u_i = rb_i (theta_i - Omega_i t); g, signs and zeros as in `lumped.model`. a is the excess material of the pairs in
contact, weighted with their shares in the mesh stiffness: pitch errors, run-out of both gears, errors common to all
pairs. G is scale and series of the mesh correction times what a cracked tooth leaves: the tangent compliance of its
pair grows by (bending part) (1/(1 - loss) - 1). f is zero while the flanks are apart and pulls the other way, without
friction, once the back flanks touch; on both sides damping acts only in contact and never holds the flanks together.
T_r is the torque ripple.

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

Mesh phase and shaft angles are those of the steady rotation, not of the vibrating gears: vibrations of 10 um shift
the phase by a thousandth of a cycle. With a prescribed driven speed the phase is exact, as it is the driven gear's.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry import Pair, body
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.linear.model import equivalent_mass
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.rig import Rig

Array = NDArray[np.float64]

# Of friction's decay rate, what a step resolves like a mode: Runge-Kutta then is stable up to 0.7 of the largest
# tabulated force. Beyond it, sliding turns round at every step; the force stays bounded.
RESOLVED = 0.125

LIMITS = (
    "forces of unbalance, also of eccentric gears, are left out",
    "the centres move along the support direction only: friction acts on rotations and tangential supports",
    "errors act through one spring, weighted with the pairs' shares at a reference load, not pair by pair",
    "back flanks are free of friction, pitch errors and cracks",
    "mesh phase is that of the steady rotation",
)


class Coordinates(NamedTuple):
    """The coordinates [m] of a model, or their rates or accelerations."""

    u1: float
    y1: float
    y2: float
    u2: float
    w: float


COORDINATES = len(Coordinates._fields)


class Constants(NamedTuple):
    """Numbers that the integrator needs. Inverse masses [1/kg] are 0 for coordinates that do not move."""

    inverse_u1: float
    inverse_u2: float
    inverse_w: float
    inverse_y1: float
    inverse_y2: float
    rigid: float  # 1: torque acts on the gear, 0: on the rotor
    shaft_stiffness: float  # S [N/m]
    shaft_damping: float  # D [N s/m]
    factor: float  # g
    stiffness1: float  # [N/m]
    stiffness2: float
    damping1: float  # [N s/m]
    damping2: float
    exponent1: float
    exponent2: float
    reference1: float  # [m]
    reference2: float
    damping_factor: float  # 2 zeta sqrt(m_e) [kg^1/2]
    backlash: float  # [m]
    root: float  # grid steps per root of deflection [m^-1/2]
    mirror: float  # phase at which back flanks pass the pitch point, in rows of the force table


class Rubbing(NamedTuple):
    """Friction, as the integrator needs it. A pair `away` cycles behind the pitch point has the roll lengths rb_i
    (centre_i +- away pitch_i) and in the steady rotation the sliding velocity away drift."""

    coefficient: float
    steepness: float  # 1 / v0 [s/m]
    drift: float  # [m/s] per cycle
    centre1: float
    centre2: float
    pitch1: float
    pitch2: float
    slide: float  # sin(a_w), or 0 along the line of action
    offset: float  # of the first column of `share`
    share: Array  # (phases + 1, n_o)


@dataclass(frozen=True, eq=False)
class NonLinear:
    """The model of one rig. base_radii [m]; masses [kg]: M_1 (the rotor included where it is rigid), M_2, M_r (0:
    rigid or none), m_1, m_2."""

    rig: Rig
    law: MeshLaw
    base_radii: tuple[float, float]
    working_pressure_angle: float
    factor: float
    masses: tuple[float, float, float, float, float]
    mesh_mass: float  # m_e [kg]

    @property
    def free(self) -> bool:
        """Whether the driven gear turns freely."""
        return self.rig.load.boundary == "torque"

    @property
    def elastic_shaft(self) -> bool:
        """Whether the rotor is a coordinate of its own."""
        return self.masses[2] > 0

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
        stiffness, damping = self.shaft
        return Constants(
            inverse_u1=1.0 / m1,
            inverse_u2=1.0 / m2 if self.free else 0.0,
            inverse_w=1.0 / rotor if rotor else 0.0,
            inverse_y1=1.0 / mass1,
            inverse_y2=1.0 / mass2,
            rigid=0.0 if rotor else 1.0,
            shaft_stiffness=stiffness,
            shaft_damping=damping,
            factor=self.factor,
            stiffness1=one.stiffness,
            stiffness2=two.stiffness,
            damping1=one.damping,
            damping2=two.damping,
            exponent1=one.exponent,
            exponent2=two.exponent,
            reference1=one.reference_deflection,
            reference2=two.reference_deflection,
            damping_factor=2 * self.rig.damping.mesh_ratio * float(np.sqrt(self.mesh_mass)),
            backlash=self.law.backlash,
            root=(len(self.law.approach) - 1) / float(np.sqrt(self.law.approach[-1])),
            mirror=self.law.mirror * self.law.phases,
        )

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
            slide=sliding_factor(self),
            offset=float(law.offsets[0]),
            share=law.closed[0],
        )

    def friction_rate(self) -> float:
        """Decay rate [1/s] of sliding at the pitch point where it turns round, at the largest tabulated force."""
        c, friction, across = self.constants(), self.rig.friction, sliding_factor(self)
        levers = [roll / radius for roll, radius in zip(self.law.pitch_roll, self.base_radii, strict=True)]
        yielding = levers[0] ** 2 * c.inverse_u1 + levers[1] ** 2 * c.inverse_u2
        yielding += across**2 * (c.inverse_y1 + c.inverse_y2)
        return friction.coefficient * float(self.law.force.max()) / friction.transition_speed * yielding

    def support_deflection(self, force: float) -> tuple[float, float]:
        """y1, y2 [m] at rest under the mesh force [N]."""
        out = []
        across = self.factor * force
        for support, push in ((self.rig.support.driver, -across), (self.rig.support.driven, across)):
            deflection = push / support.stiffness
            if support.exponent:  # a linear support does not depend on its reference, not even in rounding
                reference = support.reference_deflection
                size = abs(deflection) / reference
                deflection = float(np.sign(push)) * reference * size ** (1 / (1 + support.exponent))
            out.append(deflection)
        return out[0], out[1]

    def equilibrium(self, force: float, excess: float, gain: float, phase: float) -> Array:
        """State (2 x COORDINATES,) at rest under the force T1/rb1 > 0 [N], without friction and ripple."""
        high = self.law.approach[-1]
        while gain * float(self.law.evaluate(high, phase)[0]) < force:
            high *= 2
        low = 0.0
        for _ in range(100):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if gain * float(self.law.evaluate(middle, phase)[0]) < force else (low, middle)
        y1, y2 = self.support_deflection(force)
        u1 = high - excess - self.factor * (y1 - y2)
        twist = force / self.shaft[0] if self.elastic_shaft else 0.0
        return np.array([*Coordinates(u1, y1, y2, 0.0, u1 + twist), *Coordinates(0.0, 0.0, 0.0, 0.0, 0.0)])

    def linearised(self, stiffness: float, force: float) -> Array:
        """State matrix (2 x COORDINATES, 2 x COORDINATES) at a mesh stiffness [N/m], supports at rest under `force`.

        Without friction: away from the pitch point small vibrations do not turn the steady direction of sliding.
        """
        c = self.constants()
        inverse = np.array([c.inverse_u1, c.inverse_y1, c.inverse_y2, c.inverse_u2, c.inverse_w])
        mesh = np.array([1.0, c.factor, -c.factor, -1.0, 0.0])
        shaft = np.array([1.0, 0.0, 0.0, 0.0, -1.0])
        springs = stiffness * np.outer(mesh, mesh) + c.shaft_stiffness * np.outer(shaft, shaft)
        dampers = c.damping_factor * np.sqrt(stiffness) * np.outer(mesh, mesh)
        dampers += c.shaft_damping * np.outer(shaft, shaft)
        supports = ((1, c.stiffness1, c.exponent1, c.reference1), (2, c.stiffness2, c.exponent2, c.reference2))
        for (row, k, exponent, reference), y in zip(supports, self.support_deflection(force), strict=True):
            springs[row, row] += k * (1 + exponent) * (abs(y) / reference) ** exponent
        dampers[1, 1] += c.damping1
        dampers[2, 2] += c.damping2
        size = COORDINATES
        matrix = np.zeros((2 * size, 2 * size))
        matrix[:size, size:] = np.eye(size)
        matrix[size:, :size] = -inverse[:, None] * springs
        matrix[size:, size:] = -inverse[:, None] * dampers
        return matrix

    def fastest_rate(self, force: float) -> float:
        """Largest magnitude [rad/s] of an eigenvalue over the mesh cycle, at the largest tabulated deflection; or more,
        where friction turns round faster than a step of such a mode bears."""
        gain = self.rig.mesh.stiffness_scale
        gain *= 1 + sum(np.hypot(self.rig.mesh.stiffness_cos, self.rig.mesh.stiffness_sin)) if self._shaped else 1.0
        _, tangent = self.law.evaluate(self.law.approach[-1], np.arange(self.law.phases) / self.law.phases)
        mode = float(np.abs(np.linalg.eigvals(self.linearised(gain * float(tangent.max()), force))).max())
        return max(mode, RESOLVED * self.friction_rate())

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
    """The model of a rig whose mesh follows `law`. Raises LumpedError."""
    density = rig.material.density
    one = body(meshing.driver, rig.driver, density, "rig.driver")
    two = body(meshing.driven, rig.driven, density, "rig.driven")
    r1, r2 = meshing.driver.base_radius, meshing.driven.base_radius
    coupling = rig.drive.coupling
    rotor = coupling.inertia if coupling is not None else 0.0
    elastic = coupling is not None and coupling.stiffness is not None
    for name, support in (("driver", rig.support.driver), ("driven", rig.support.driven)):
        if not support.exponent > -1.0:
            raise LumpedError(f"rig.support.{name}.exponent = {support.exponent:g} must be more than -1")
    turning = one.inertia + (0.0 if elastic else rotor)
    return NonLinear(
        rig=rig,
        law=law,
        base_radii=(r1, r2),
        working_pressure_angle=meshing.working_pressure_angle,
        factor=cos(meshing.working_pressure_angle) if rig.support.direction == "tangential" else 1.0,
        masses=(turning / r1**2, two.inertia / r2**2, rotor / r1**2 if elastic else 0.0, one.mass, two.mass),
        mesh_mass=equivalent_mass((r1, r2), (one.inertia + rotor, two.inertia), rig.load.boundary),
    )


def sliding_factor(model: NonLinear) -> float:
    """Part of the friction force that the supports feel: sin(a_w), or 0 along the line of action."""
    return sin(model.working_pressure_angle) if model.rig.support.direction == "tangential" else 0.0

"""The nominal rig as the diagnosis sees it: constants of its equations of motion and how well they are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import cos, lcm, pi, sin, sqrt, tan

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.refusals.load_range import largest_torque
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.geometry import Body, Pair, body, pair
from gearbench.lumped.linear.model import equivalent_mass
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.rig import Case, Rig, Support

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Relative standard deviations of what a case states without one.
DEFAULT_SD = {
    "support_stiffness": 0.1,
    "support_damping": 0.3,
    "mass": 0.03,
    "inertia": 0.02,
    "mesh_scale": 0.06,
    "mesh_ratio": 0.4,
}

# Of the largest torque: vibration presses the flanks further, and teeth with errors further than that; behind the end
# of its table the force of a pair that is about to touch there is anyone's guess. What has to be reached at least.
LOAD_MARGIN, LEAST_MARGIN = 2.5, 1.3


@dataclass(frozen=True)
class NominalModel:
    """Constants of the nominal rig, SI. Pairs are (driver, driven); `sd_*` are relative standard deviations."""

    teeth: tuple[int, int]
    base_radius: tuple[float, float]
    support_factor: float  # g: cos(working pressure angle), or 1 along the line of action
    cross_factor: float  # part of the friction force along the support: sin(working pressure angle), or 0
    transverse_factor: float  # part of a radial motion along the line of action, sin(working pressure angle)
    mass: tuple[float, float]
    inertia: tuple[float, float]  # of the gears alone [kg m^2]
    rotor: float  # inertia beyond the drive's coupling [kg m^2]
    compliance: float  # of the coupling [rad/(N m)]; 0: rigid
    coupling_damping: float  # [N m s/rad]
    stiffness: tuple[float, float]
    damping: tuple[float, float]
    exponent: tuple[float, float]
    reference: tuple[float, float]  # deflection at which secant and stated support stiffness agree [m]
    mesh_mass: float
    mesh_ratio: float
    scale: float
    hardening: float  # exponent of the mesh force
    reference_force: float  # [N] at which an exponent leaves the mesh force as it is
    error_cos: tuple[float, ...]  # excess material of all pairs by mesh orders [m]
    error_sin: tuple[float, ...]
    friction: float
    transition: float  # sliding speed at which friction has changed its direction [m/s]
    law: MeshLaw
    sound: MeshLaw  # of teeth without what `law` knows of their flanks
    path: tuple[float, float]  # of contact, behind the pitch point [base pitches]
    line: float  # length of the line of action between the base circles [m]
    sd_stiffness: tuple[float, float]
    sd_damping: tuple[float, float]
    sd_mass: tuple[float, float]
    sd_inertia: tuple[float, float]
    sd_rotor: float
    sd_compliance: float
    sd_scale: float
    sd_mesh_ratio: float
    noise: tuple[float, float, float]  # rms per sample of angle [rad], displacement [m], torque [N m]
    torque_mean: float  # typical, on the driver [N m]

    @property
    def hunting(self) -> int:
        """Teeth that pass until the same two meet again."""
        return lcm(*self.teeth)

    @cached_property
    def hardened(self) -> MeshLaw:
        """The law of the mesh force with the nominal exponent."""
        return self.law.hardened(self.hardening, self.reference_force)

    @property
    def mesh_stiffness(self) -> float:
        """Mean stiffness [N/m] of the mesh at the largest load of its table."""
        law = self.hardened
        _, tangent = law.evaluate(law.approach[-1], np.arange(law.phases) / law.phases)
        return self.scale * float(tangent.mean())

    def coupling_compliance(self, omega: Array) -> Complex:
        """Compliance [rad/(N m)] of the drive's coupling by frequency [rad/s]; zero where it is rigid."""
        return np.asarray(self.compliance / (1 + 1j * omega * self.coupling_damping * self.compliance))

    @property
    def deflection(self) -> float:
        """Of the mesh under the mean torque [m]: what lengths count as large by."""
        return abs(self.torque_mean) / self.base_radius[0] / self.mesh_stiffness

    def pitch_speed(self, mesh_frequency: float) -> float:
        """Speed [m/s] of the base circles at a mesh frequency [Hz]."""
        return 2 * pi * mesh_frequency / self.teeth[0] * self.base_radius[0]

    @property
    def resonance(self) -> float:
        """Of the turning parts on the mesh [Hz]: what frequencies count as high by."""
        return sqrt(self.mesh_stiffness / self.mesh_mass) / (2 * pi)


def nominal_model(nominal: Case, load: float, mean: float) -> NominalModel:
    """The model of a nominal case whose mesh force law must reach `load` [N m] on the driver.

    `mean` [N m] is a typical mean torque: a support that the case takes for linear is judged about its deflection
    there.
    """
    # Solving it compiles loops on import, which not every user of this module wants.
    from gearbench.bench.nonlinear.law_table import teeth_law, with_flanks

    rig = nominal.rig
    sound = teeth_law(rig, nominal.simulation, load)
    meshing = pair(rig)
    bodies = _bodies(rig, meshing)
    supports = (rig.support.driver, rig.support.driven)
    held = [support.holding(one.mass) for support, one in zip(supports, bodies, strict=True)]
    coupling = rig.drive.coupling
    rotor = coupling.inertia if coupling else 0.0
    stiff = coupling.stiffness if coupling else None
    tangential = rig.support.direction == "tangential"
    radii = (meshing.driver.base_radius, meshing.driven.base_radius)
    alpha = meshing.working_pressure_angle
    inertias = (bodies[0].inertia, bodies[1].inertia)
    known = _Known(nominal)
    return NominalModel(
        teeth=(rig.driver.teeth, rig.driven.teeth),
        base_radius=radii,
        support_factor=cos(alpha) if tangential else 1.0,
        cross_factor=sin(alpha) if tangential else 0.0,
        transverse_factor=sin(alpha) if tangential else tan(alpha),
        mass=(bodies[0].mass, bodies[1].mass),
        inertia=inertias,
        rotor=rotor,
        compliance=1.0 / stiff if stiff else 0.0,
        coupling_damping=coupling.damping if coupling and stiff else 0.0,
        stiffness=(held[0].stiffness, held[1].stiffness),
        damping=(supports[0].damping, supports[1].damping),
        exponent=(supports[0].exponent, supports[1].exponent),
        reference=_references(supports, mean / radii[0] * (cos(alpha) if tangential else 1.0)),
        mesh_mass=equivalent_mass(radii, (inertias[0] + rotor, inertias[1]), rig.load.boundary),
        mesh_ratio=rig.damping.mesh_ratio,
        scale=rig.mesh.stiffness_scale,
        hardening=rig.mesh.exponent,
        reference_force=rig.mesh.reference_force if rig.mesh.exponent else abs(mean) / radii[0],
        error_cos=rig.mesh.error_cos,
        error_sin=rig.mesh.error_sin,
        friction=rig.friction.coefficient,
        transition=rig.friction.transition_speed,
        law=with_flanks(sound, rig, nominal.simulation),
        sound=sound,
        path=meshing.path,
        line=meshing.line_of_action,
        sd_stiffness=known.both("rig.support.{}.stiffness", [one.stiffness for one in held], "support_stiffness"),
        sd_damping=known.both("rig.support.{}.damping", [s.damping for s in supports], "support_damping"),
        sd_mass=known.both("rig.{}.mass", [b.mass for b in bodies], "mass"),
        sd_inertia=known.both("rig.{}.inertia", list(inertias), "inertia"),
        sd_rotor=known.one("rig.drive.coupling.inertia", rotor, "inertia"),
        sd_compliance=known.one("rig.drive.coupling.stiffness", stiff or 0.0, "support_stiffness"),
        sd_scale=known.one("rig.mesh.stiffness_scale", rig.mesh.stiffness_scale, "mesh_scale"),
        sd_mesh_ratio=known.one("rig.damping.mesh_ratio", rig.damping.mesh_ratio, "mesh_ratio"),
        noise=(rig.sensors.noise_angle, rig.sensors.noise_displacement, rig.sensors.noise_torque),
        torque_mean=mean,
    )


def _bodies(rig: Rig, meshing: Pair) -> tuple[Body, Body]:
    """Mass and inertia of driver and driven gear."""
    one = body(meshing.driver, rig.driver, rig.material.density, "rig.driver")
    return one, body(meshing.driven, rig.driven, rig.material.density, "rig.driven")


def table_load(rig: Rig, measurements: Sequence[Measurement]) -> float:
    """Driver torque [N m] that the table of the mesh force must reach for these measurements of a rig: as far as its
    flanks can carry."""
    most = max(float(np.abs(measured.mean("torque_driver")).max()) for measured in measurements)
    return max(LEAST_MARGIN * most, min(LOAD_MARGIN * most, largest_torque(pair(rig))))


def model_for(nominal: Case, measurements: Sequence[Measurement]) -> NominalModel:
    """The model of a nominal case that these measurements are of."""
    mean = float(np.mean([measured.mean("torque_driver").mean() for measured in measurements]))
    return nominal_model(nominal, table_load(nominal.rig, measurements), mean)


def resonance_of(nominal: Case, measurements: Sequence[Measurement]) -> float:
    """Resonance [Hz] of the turning parts on the mesh, of a nominal case that these measurements are of."""
    return model_for(nominal, measurements).resonance


def _references(supports: tuple[Support, Support], force: float) -> tuple[float, float]:
    """Deflections [m] at which the secant stiffness is the stated one; under `force` [N] if the case says linear."""
    first, second = (s.reference_deflection if s.exponent else force / s.holding(1.0).stiffness for s in supports)
    return first, second


@dataclass(frozen=True)
class _Known:
    """Relative standard deviations of a case's numbers: its own, else the documented defaults."""

    case: Case

    def one(self, path: str, value: float, default: str) -> float:
        stated = self.case.uncertainty.get(path)
        if stated is None or value == 0.0:
            return DEFAULT_SD[default]
        return stated / abs(value)

    def both(self, path: str, values: list[float], default: str) -> tuple[float, float]:
        first, second = (
            self.one(path.format(side), value, default)
            for side, value in zip(("driver", "driven"), values, strict=True)
        )
        return first, second

"""The three-degree-of-freedom lumped model: torsion x of both gears and support motions y1, y2.

    m_e x''              + F_m = F
    m_1 y1'' + c_1 y1' + k_1 y1 = -g F_m
    m_2 y2'' + c_2 y2' + k_2 y2 = +g F_m
    F_m = k(phase) (dte - e) + c(phase) (dte' - e'),   dte = x + g (y1 - y2),   c = 2 zeta sqrt(k m_e)

x = rb1 theta1 - rb2 theta2 [m]; g = cos(working pressure angle) for tangential supports, 1 along the line
of action; e is the static transmission error, zero unless given. The mesh stays in contact, so the model
is linear and periodic in the mesh phase. Signs and zeros: docs/physics.md,
"Axes, signs, zeros". State: (x, y1, y2, x', y1', y2').
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry import Pair, body
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.stiffness.mesh_stiffness import MeshStiffness, mesh_stiffness
from gearbench.rig import Rig, Simulation

Array = NDArray[np.float64]

STATES = 6


class Parameters(NamedTuple):
    """Numbers of the equations of motion; 1: driver, 2: driven gear."""

    mesh_mass: float  # m_e [kg]
    support_factor: float  # g
    mass1: float  # [kg]
    mass2: float
    stiffness1: float  # of the supports [N/m]
    stiffness2: float
    damping1: float  # [N s/m]
    damping2: float


@dataclass(frozen=True)
class Lumped:
    """Constants and laws of the model. Pairs are (driver, driven)."""

    mesh_mass: float  # m_e [kg]
    support_factor: float  # g
    masses: tuple[float, float]  # [kg]
    support_stiffness: tuple[float, float]  # [N/m]
    support_damping: tuple[float, float]  # [N s/m]
    damping_ratio: float  # zeta of the mesh
    stiffness: MeshStiffness
    error: tuple[complex, ...] = ()  # e = Re sum_n error[n-1] exp(2 pi j n phase) [m]

    @property
    def parameters(self) -> Parameters:
        """The constants that the integrator needs."""
        pairs = (self.masses, self.support_stiffness, self.support_damping)
        return Parameters(self.mesh_mass, self.support_factor, *(value for pair in pairs for value in pair))

    @property
    def input_vector(self) -> Array:
        """B (6,): state derivative per generalised force F [N]."""
        return np.array([0.0, 0.0, 0.0, 1.0 / self.mesh_mass, 0.0, 0.0])

    @property
    def output_vector(self) -> Array:
        """C (6,): dte = C state."""
        return np.array([1.0, self.support_factor, -self.support_factor, 0.0, 0.0, 0.0])

    def mesh_damping(self, stiffness: ArrayLike) -> Array:
        """c [N s/m] that belongs to the mesh stiffness k [N/m]: 2 zeta sqrt(k m_e)."""
        return 2 * self.damping_ratio * np.sqrt(np.asarray(stiffness, dtype=float) * self.mesh_mass)

    def state_matrix(self, stiffness: ArrayLike) -> Array:
        """A (..., 6, 6) of state' = A state + B F for mesh stiffnesses k (...) [N/m]."""
        k = np.asarray(stiffness, dtype=float)[..., None, None]
        mesh = self.output_vector[:3]
        pattern = np.outer(mesh, mesh)
        inverse = np.diag(1 / np.array([self.mesh_mass, *self.masses]))
        springs = np.diag([0.0, *self.support_stiffness]) + k * pattern
        dampers = np.diag([0.0, *self.support_damping]) + self.mesh_damping(k) * pattern
        matrix = np.zeros((*k.shape[:-2], STATES, STATES))
        matrix[..., :3, 3:] = np.eye(3)
        matrix[..., 3:, :3] = -inverse @ springs
        matrix[..., 3:, 3:] = -inverse @ dampers
        return matrix

    def transmission_error(self, phase: ArrayLike) -> tuple[Array, Array]:
        """Static transmission error e [m] and its derivative de/d phase [m per cycle] at `phase` [cycles]."""
        phase = np.asarray(phase, dtype=float)
        value, slope = np.zeros(phase.shape), np.zeros(phase.shape)
        for order, amplitude in enumerate(self.error, start=1):
            term = amplitude * np.exp(2j * np.pi * order * phase)
            value += term.real
            slope += (2j * np.pi * order * term).real
        return value, slope

    def equilibrium(self, force: float, phase: float = 0.0) -> Array:
        """State (6,) at rest under the constant generalised force [N] with the mesh held at `phase`."""
        g = self.support_factor
        y1 = -g * force / self.support_stiffness[0]
        y2 = g * force / self.support_stiffness[1]
        error, _ = self.transmission_error(phase)
        x = force / float(self.stiffness.at(phase)) + float(error) - g * (y1 - y2)
        return np.array([x, y1, y2, 0.0, 0.0, 0.0])

    def _frozen_eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues (3, 6) [1/s] of the frozen system where the mesh is softest, at its median, and stiffest."""
        k = self.stiffness.at(np.arange(256) / 256)
        extremes = np.array([k.min(), np.median(k), k.max()])
        return np.asarray(np.linalg.eigvals(self.state_matrix(extremes)), dtype=complex)

    def fastest_rate(self) -> float:
        """Largest magnitude [rad/s] of an eigenvalue of the frozen system over the mesh cycle."""
        return float(np.abs(self._frozen_eigenvalues()).max())

    def slowest_decay(self) -> float:
        """Slowest rate [1/s] at which free vibrations of the frozen system die out over the mesh cycle."""
        return float(-self._frozen_eigenvalues().real.max())


def periodic_matrices(model: Lumped, phases: int, first: float = 0.0) -> tuple[Array, Array, Array]:
    """A (phases, 6, 6), B (6,), C (6,) of state' = A state + B F, dte = C state, on the phases `first`,
    `first` + 1/phases, ... [cycles]

    Switches of k narrower than two grid intervals are widened to that, so that their instants are kept.
    The static transmission error is not part of it: it adds a response of its own and leaves the transfer
    from F to dte unchanged.
    """
    k = model.stiffness.at(first + np.arange(phases) / phases, finest=2.0 / phases)
    return model.state_matrix(k), model.input_vector, model.output_vector


def equivalent_mass(
    base_radii: tuple[float, float], inertias: tuple[float, float], driven_boundary: str
) -> float:
    """m_e [kg]: J1/rb1^2 with the driven speed prescribed, J1 J2/(J1 rb2^2 + J2 rb1^2) with both free."""
    (r1, r2), (j1, j2) = base_radii, inertias
    if driven_boundary == "speed":
        return j1 / r1**2
    return j1 * j2 / (j1 * r2**2 + j2 * r1**2)


def mesh_mass_of(rig: Rig, base_radii: tuple[float, float], inertias: tuple[float, float]) -> float:
    """m_e [kg] of both sides' whole inertias [kg m^2]; a side whose speed is prescribed counts as infinitely heavy."""
    if rig.drive.boundary == "speed":
        return inertias[1] / base_radii[1] ** 2
    return equivalent_mass(base_radii, inertias, rig.load.boundary)


def lumped_model(
    rig: Rig,
    meshing: Pair,
    simulation: Simulation,
    *,
    stiffness: MeshStiffness | None = None,
    error: Sequence[complex] = (),
) -> Lumped:
    """The lumped model of a rig.

    `stiffness` replaces the law that the case asks for (a table from finite elements, say). `error` holds
    the complex amplitudes [m] of the static transmission error at mesh orders 1, 2, ... (neutral: none).
    Raises LumpedError.
    """
    amplitudes = tuple(complex(value) for value in error)
    if not np.isfinite(np.array(amplitudes)).all():
        raise LumpedError("the amplitudes of the static transmission error must be finite")
    density = rig.material.density
    bodies = (
        body(meshing.driver, rig.driver, density, "rig.driver"),
        body(meshing.driven, rig.driven, density, "rig.driven"),
    )
    radii = (meshing.driver.base_radius, meshing.driven.base_radius)
    inertias = (bodies[0].inertia, bodies[1].inertia)
    tangential = rig.support.direction == "tangential"
    one, two = rig.support.driver.holding(bodies[0].mass), rig.support.driven.holding(bodies[1].mass)
    return Lumped(
        mesh_mass=equivalent_mass(radii, inertias, rig.load.boundary),
        support_factor=cos(meshing.working_pressure_angle) if tangential else 1.0,
        masses=(one.mass, two.mass),
        support_stiffness=(one.stiffness, two.stiffness),
        support_damping=(one.damping, two.damping),
        damping_ratio=rig.damping.mesh_ratio,
        stiffness=stiffness if stiffness is not None else mesh_stiffness(rig, meshing, simulation),
        error=amplitudes,
    )

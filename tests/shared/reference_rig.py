"""The reference system on which identification is scored, and its response by time integration.

A lumped gear pair: torsion x along the line of action (1.0 kg), both gear centres y1, y2 (2.0 and 2.6 kg on
3.2e8 and 4.5e8 N/m, 3 % damping), supports along the line of action, tooth mesh at 2 Hz:

    m x'' = F - Fm,  m1 y1'' + c1 y1' + k1 y1 = -Fm,  m2 y2'' + c2 y2' + k2 y2 = +Fm,
    Fm = k(t) dte + c(t) dte',  dte = x + y1 - y2,  c = 2 zeta sqrt(k m).

k(phase): 0.6e8 N/m with one pair and 1.2e8 N/m with two (contact ratio 1.6: double over 0 <= phase < 0.6),
in each zone a parabola that falls by 6 % from the zone's middle to its ends, zones joined by raised cosines
2 % of the period wide. The frozen first mode then runs from 1013 to 1231 Hz.

The response is integrated by three-stage Gauss-Legendre collocation (order 6; Hairer, Norsett and Wanner),
so that nothing of the frequency-domain code takes part in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from gearbench.identification.excitation.multisine import MultisineSignal, random_phase_multisine
from gearbench.identification.truth.periodic import Floats, PeriodicSystem
from gearbench.records.record import make_record

DIRECTION = np.array([1.0, 1.0, -1.0])  # dte = DIRECTION @ (x, y1, y2)
ANGLES = np.array([1.0, 0.0, 0.0])  # what angles alone show of it
DECAY = 20.0  # the initial state has decayed by exp(-DECAY) when the record begins


@dataclass(frozen=True)
class ReferenceRig:
    """Parameters of the reference system, SI; the defaults are the reference."""

    mass: float = 1.0
    centre_mass: tuple[float, float] = (2.0, 2.6)
    support_stiffness: tuple[float, float] = (3.2e8, 4.5e8)
    support_ratio: float = 0.03
    stiffness_single: float = 0.6e8
    stiffness_double: float = 1.2e8
    contact_ratio: float = 1.6
    parabola: float = 0.06
    edge: float = 0.02
    mesh_ratio: float = 0.05
    mesh_frequency: float = 2.0

    def stiffness(self, phase: ArrayLike) -> Floats:
        """Mesh stiffness k [N/m] at the phases [cycles]; two pairs carry from phase 0 to contact_ratio - 1."""
        double = self.contact_ratio - 1.0
        point = np.asarray(phase, dtype=float) % 1.0
        # Signed distance from the middle of the double zone, in [-0.5, 0.5).
        offset = (point - double / 2 + 0.5) % 1.0 - 0.5
        inside = double / 2 - np.abs(offset)  # > 0 inside the double zone
        share = np.clip(inside / self.edge + 0.5, 0.0, 1.0)
        blend = 0.5 - 0.5 * np.cos(np.pi * share)
        to_single = 0.5 - np.abs(offset)  # distance from the middle of the single zone
        high = self.stiffness_double * (1 - self.parabola * (2 * offset / double) ** 2)
        low = self.stiffness_single * (1 - self.parabola * (2 * to_single / (1 - double)) ** 2)
        return blend * high + (1 - blend) * low

    def matrices(self, phase: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """A (P, 6, 6), B (6,), C (6,) of the states (x, y1, y2, x', y1', y2'); input F [N], output dte [m]."""
        k = np.atleast_1d(self.stiffness(phase))
        c = 2 * self.mesh_ratio * np.sqrt(k * self.mass)
        mass = np.array([self.mass, *self.centre_mass])
        ground_k = np.array([0.0, *self.support_stiffness])
        ground_c = 2 * self.support_ratio * np.sqrt(ground_k * mass)
        pattern = np.outer(DIRECTION, DIRECTION)
        a = np.zeros((k.size, 6, 6))
        a[:, :3, 3:] = np.eye(3)
        a[:, 3:, :3] = -(k[:, None, None] * pattern + np.diag(ground_k)) / mass[:, None]
        a[:, 3:, 3:] = -(c[:, None, None] * pattern + np.diag(ground_c)) / mass[:, None]
        b = np.zeros(6)
        b[3] = 1.0 / self.mass
        return a, b, np.concatenate([DIRECTION, np.zeros(3)])

    def system(self, phases: int = 2048, output: Floats = DIRECTION) -> PeriodicSystem:
        """The periodic system sampled on `phases` phases; trigonometric in between; `output` (3,) of (x, y1, y2)."""
        a, b, _ = self.matrices(np.arange(phases) / phases)
        c = np.concatenate([output, np.zeros(3)])
        return PeriodicSystem(1.0 / self.mesh_frequency, a, b, c, interpolation="trigonometric")


def reference_record(
    rig: ReferenceRig,
    *,
    realisations: int,
    duration: float,
    sampling_rate: float = 8192.0,
    band: tuple[float, float] = (1.0, 3000.0),
    amplitude: float = 500.0,
    mean: float = 2000.0,
    noise: float = 0.0,
    start_phase: float = 0.0,
    substeps: int = 4,
    seed: int = 0,
    output: Floats = DIRECTION,
) -> xr.Dataset:
    """A record with `dte`, `force` and `mesh_phase` of the reference rig in steady state, one excitation period each.

    `duration` [s] must be a whole number of mesh periods; `amplitude` [N] is the peak of the multisine,
    `mean` [N] the mean force, `noise` the standard deviation of white noise on dte relative to the standard
    deviation of its multisine-induced part, `start_phase` the mesh phase [cycles] of the first sample. The
    record starts after the initial state has decayed by exp(-DECAY). With `output` = ANGLES the dte is that of the
    angles, and marked so.
    """
    samples = round(duration * sampling_rate)
    rng = np.random.default_rng(seed)
    signals = [
        random_phase_multisine(samples, sampling_rate, band, amplitude=amplitude, rng=rng) for _ in range(realisations)
    ]
    dte = integrate(rig, signals, mean=mean, start_phase=start_phase, substeps=substeps, output=output)
    force = np.stack([signal.sample(samples) for signal in signals]) + mean
    if noise:
        induced = dte - dte.mean(axis=0) if realisations > 1 else dte - dte.mean()
        dte = dte + noise * induced.std() * rng.standard_normal(dte.shape)
    time = np.arange(samples) / sampling_rate
    phase = np.broadcast_to(start_phase + rig.mesh_frequency * time, dte.shape)
    attributes = {
        "sampling_rate": sampling_rate,
        "samples_per_period": samples,
        "periods": 1,
        "mesh_period": 1.0 / rig.mesh_frequency,
        "mesh_phase_origin": "geometry",
        "settling_residual": float(np.exp(-DECAY)),
    }
    record = make_record({"dte": dte, "force": force, "mesh_phase": np.array(phase)}, attributes)
    record.dte.attrs["angle_only"] = int(output is ANGLES)
    return record


def integrate(
    rig: ReferenceRig,
    signals: list[MultisineSignal],
    *,
    mean: float = 0.0,
    start_phase: float = 0.0,
    substeps: int = 4,
    output: Floats = DIRECTION,
) -> Floats:
    """Steady-state dte (realisations, samples) [m] of one period of the multisine forces plus `mean` [N].

    `substeps` integration steps a sample. The mesh period must be a whole number of samples and the
    signals' period a whole number of mesh periods (ValueError otherwise).
    """
    first = signals[0]
    steps = first.samples * substeps
    step = first.period / steps
    cycle = round(1.0 / (rig.mesh_frequency * step))
    if abs(cycle * step * rig.mesh_frequency - 1.0) > 1e-9 or steps % cycle:
        raise ValueError(
            f"{first.samples} samples at {first.sampling_rate:g} Hz are not a whole number of mesh periods of"
            f" {1.0 / rig.mesh_frequency:g} s, each a whole number of samples"
        )
    transition, weights = _gauss_steps(rig, start_phase, cycle, step)
    slowest = -np.linalg.eigvals(rig.matrices(np.linspace(0, 1, 50))[0]).real.max()
    settling = cycle * int(np.ceil(DECAY / (slowest * cycle * step)))
    forces = _stage_forces(signals, steps, mean)
    state = np.zeros((6, len(signals)))
    dte = np.empty((len(signals), first.samples))
    for index in range(-settling, steps):
        if index >= 0 and index % substeps == 0:
            dte[:, index // substeps] = output @ state[:3]
        state = transition[index % cycle] @ state + weights[index % cycle] @ forces[index % steps]
    return dte


# Nodes and matrix of the three-stage Gauss method.
_ROOT = np.sqrt(15.0)
GAUSS_NODES = np.array([0.5 - _ROOT / 10, 0.5, 0.5 + _ROOT / 10])
GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
GAUSS_MATRIX = np.array(
    [
        [5 / 36, 2 / 9 - _ROOT / 15, 5 / 36 - _ROOT / 30],
        [5 / 36 + _ROOT / 24, 2 / 9, 5 / 36 - _ROOT / 24],
        [5 / 36 + _ROOT / 30, 2 / 9 + _ROOT / 15, 5 / 36],
    ]
)


def _gauss_steps(rig: ReferenceRig, start_phase: float, cycle: int, step: float) -> tuple[Floats, Floats]:
    """x_next = transition[i] x + weights[i] (F at the three stages), for each step i of a mesh period."""
    phase = start_phase + (np.arange(cycle)[:, None] + GAUSS_NODES) / cycle
    a, b, _ = rig.matrices(phase.ravel())
    a = a.reshape(cycle, 3, 6, 6)
    # Stage slopes K_i = A_i (x + h sum_j a_ij K_j) + b F_i as one linear system of 18 unknowns.
    system = np.einsum("ij,pixy->pixjy", -step * GAUSS_MATRIX, a).reshape(cycle, 18, 18) + np.eye(18)
    right = np.concatenate(
        [a.reshape(cycle, 18, 6), np.broadcast_to(np.kron(np.eye(3), b[:, None]), (cycle, 18, 3))], axis=2
    )
    slopes = np.linalg.solve(system, right)
    increment = step * np.einsum("i,pixc->pxc", GAUSS_WEIGHTS, slopes.reshape(cycle, 3, 6, 9))
    return increment[:, :, :6] + np.eye(6), increment[:, :, 6:]


def _stage_forces(signals: list[MultisineSignal], steps: int, mean: float) -> Floats:
    """Forces (steps, 3, realisations) [N] at the Gauss nodes of each step."""
    forces = np.empty((steps, 3, len(signals)))
    for column, signal in enumerate(signals):
        for stage, node in enumerate(GAUSS_NODES):
            forces[:, stage, column] = signal.sample(steps, shift=node / steps)
    return forces + mean

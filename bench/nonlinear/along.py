"""The tangent of a rig's steady motion: spring and damper of the mesh along it, and how it answers small forces."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.nonlinear.replay import Steady, resampled
from gearbench.lumped.nonlinear.coordinates import COORDINATES
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.pressing import Pressed, of_pairs, pressed
from gearbench.lumped.nonlinear.rest import inverse_masses, mesh_direction, springs_and_dampers
from gearbench.lumped.nonlinear.step import columns
from gearbench.lumped.nonlinear.tables import instants
from gearbench.lumped.nonlinear.tangent import Tangent, departures

Array = NDArray[np.float64]

MOST = 5  # steps per sample that suffice: the frequency of a mode at 0.3 of the sampling rate is then right to 2e-4
STABLE = 1.8  # largest rate of a mode times the step: Runge-Kutta bears 2.8
# Of its first size, that free vibrations keep when the first sample is taken: a mean is far larger than the lines.
TRANSIENT = 1e-9
AT_ONCE = 48  # departures carried together: their states stay in the fastest memory


class Moving(NamedTuple):
    """A coordinate's motion on the half-step grid (entries,): place [m], rate [m/s], acceleration [m/s^2]."""

    place: Array
    rate: Array
    acceleration: Array


@dataclass(frozen=True)
class Along:
    """A steady motion on the half-step grid (entries,) of one repetition: mesh phase [cycles], elastic force of the
    mesh [N], what each pair has of it on the working flanks, force and tangent (entries, n_o), rate of the deflection
    [m/s], the law of its force, the force that the teeth would have without an exponent over the one where that changes
    nothing, and of the coordinates u1, y1, y2, u2 their motion.
    `drive` is the coordinate that the driver's torque acts on; `early` steps let free vibrations die out.
    """

    phase: Array
    elastic: Array
    pairs: Pressed
    rate: Array
    law: MeshLaw
    level: Array
    tangent: Tangent
    substeps: int
    early: int
    factor: float
    drive: int
    coordinates: tuple[Moving, ...]

    def answers(self, forces: Array, on: int | None = None) -> dict[str, Array]:
        """Changes (columns, samples) of the channels under forces (entries, columns) [N] added in the mesh, or on a
        coordinate: dte [m], rb times angles [m], y [m], and the mesh force [N]."""
        found: list[tuple[Array, Array]] = []
        for start in range(0, forces.shape[1], AT_ONCE):
            chunk = forces[:, start : start + AT_ONCE]
            found.append(departures(self.tangent, chunk, on, self.substeps, self.early))
        places = np.concatenate([one for one, _ in found], axis=2)
        mesh = np.concatenate([two for _, two in found], axis=1)
        u1, y1, y2, u2 = (np.ascontiguousarray(places[:, number, :].T) for number in range(4))
        dte = u1 - u2 + self.factor * (y1 - y2)
        return {"dte": dte, "angle_driver": u1, "angle_driven": u2, "y_driver": y1, "y_driven": y2, "mesh": mesh.T}

    def rate_of(self, excess: Array) -> Array:
        """Time derivative (entries, columns) of periodic signals on the grid."""
        return np.asarray((np.roll(excess, -1, axis=0) - np.roll(excess, 1, axis=0)) / self.tangent.step)

    def of_excess(self, excess: Array) -> Array:
        """Force (entries, columns) [N] that more material (entries, columns) [m] adds in the mesh."""
        k, c = self.tangent.stiffness[:, None], self.tangent.damping[:, None]
        return np.asarray(k * excess + c * self.rate_of(excess))


def along(steady: Steady) -> Along:
    """The tangent of a steady motion."""
    setup, model = steady.setup, steady.setup.model
    samples, outputs = len(steady.outputs), steady.outputs
    c, s = model.constants(), model.structure
    mesh = mesh_direction(c, s)
    substeps = _substeps(steady)
    entries = 2 * substeps * samples
    step = 1.0 / (setup.sampling_rate * substeps)
    out = columns(outputs)
    travel = np.asarray(mesh[0] * out.u1 + mesh[1] * out.y1 + mesh[2] * out.y2 + mesh[3] * out.u2)
    if s is not None:
        travel = travel + s.slide * (out.x1 - out.x2)
    spectrum = np.fft.rfft(travel)
    rate = np.fft.irfft(2j * np.pi * np.fft.rfftfreq(samples, 1 / setup.sampling_rate) * spectrum, samples)
    table = replace(setup, substeps=substeps, table=None).table_for(0, samples)
    at = instants(model, table, table.position[:entries] / model.law.phases, entries)
    fine = resampled(travel, entries)
    force, slope = pressed(model.law, at, fine)
    level = (np.abs(force / at.gain) / model.rig.mesh.reference_force) ** (1.0 / (1.0 + model.rig.mesh.exponent))
    slope = np.maximum(slope, 0.0)
    damping = c.damping_factor * np.sqrt(slope)
    tangents = tuple(
        stiffness * (1 + exponent) * (max(abs(float(y.mean())), 1e-9) / reference) ** exponent
        for stiffness, exponent, reference, y in (
            (c.stiffness1, c.exponent1, c.reference1, out.y1),
            (c.stiffness2, c.exponent2, c.reference2, out.y2),
        )
    )
    springs, dampers = springs_and_dampers(c, s, (tangents[0], tangents[1]))
    drive = 0 if c.rigid else COORDINATES - 1
    omega = 2j * np.pi * np.fft.rfftfreq(samples, 1 / setup.sampling_rate)
    decay = max(model.slowest_decay(float(steady.drive.fine.mean())), 1e-9)
    early = min(ceil(log(1 / TRANSIENT) / decay / step), samples * substeps)
    first = setup.phase_at(0)
    cycles: Array = first + np.arange(entries, dtype=np.float64) * (setup.cycles_per_sample / (2 * substeps))
    tangent = Tangent(springs, dampers, inverse_masses(c, s), mesh, slope, damping, step)

    def moving(signal: Array) -> Moving:
        lines = np.fft.rfft(signal)
        rates = (np.fft.irfft(omega**order * lines, samples) for order in (1, 2))
        return Moving(resampled(signal, entries), *(resampled(one, entries) for one in rates))

    coordinates = tuple(moving(signal) for signal in (out.u1, out.y1, out.y2, out.u2))
    return Along(
        phase=cycles,
        elastic=force,
        pairs=of_pairs(model.law, at, fine),
        rate=resampled(rate, entries) + table.excess_rate[:entries],
        law=model.law,
        level=level,
        tangent=tangent,
        substeps=substeps,
        early=early,
        factor=model.factor,
        drive=drive,
        coordinates=coordinates,
    )


def _substeps(steady: Steady) -> int:
    """Steps per sample: those of the motion, up to `MOST`, or as many as keep every mode stable at the mesh's largest
    tangent."""
    model, setup = steady.setup.model, steady.setup
    law, mesh = model.law, model.rig.mesh
    _, tangent = law.evaluate(law.approach[-1], np.arange(law.phases) / law.phases)
    stiffest = 1.5 * mesh.stiffness_scale * float(tangent.max())
    force = float(steady.drive.fine.mean())
    fastest = float(np.abs(np.linalg.eigvals(model.linearised(stiffest, force))).max())
    return max(min(setup.substeps, MOST), ceil(fastest / (STABLE * setup.sampling_rate)))

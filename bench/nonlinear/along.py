"""The tangent of a rig's steady motion: spring and damper of the mesh along it, and how it answers small forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, log
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import rfft

from gearbench.bench.nonlinear.fine import averaged, integrated, interpolated, placed
from gearbench.bench.nonlinear.pushing import Pushing, pushing, stepped
from gearbench.bench.nonlinear.replay import Steady
from gearbench.bench.record.sensors import resampled, shown_by
from gearbench.lumped.nonlinear.coordinates import IN_MESH, LOAD, U1, U2, Acting, W
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.model import NonLinear
from gearbench.lumped.nonlinear.pressing import Pressed
from gearbench.lumped.nonlinear.reading import over_pairs
from gearbench.lumped.nonlinear.rest import inverse_masses, springs_and_dampers
from gearbench.lumped.nonlinear.tangent import AT_ONCE, OVER_STEP, Tangent, departures

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Lines = NDArray[np.complex64]

MOST = 3  # steps per sample that suffice: the frequency of a mode at 0.2 of the sampling rate is then right to 3e-4
STABLE = 1.8  # largest rate of a mode times the step: Runge-Kutta bears 2.8
# Of its first size, that free vibrations keep when the first sample is taken: a mean is far larger than the lines.
TRANSIENT = 1e-9
IMPACTS = 4  # instants for each half step, over which flanks that part and meet are averaged


@dataclass(frozen=True, eq=False)
class Along:
    """A steady motion of `model` on the half-step grid (entries,) of one repetition: mesh phase [cycles], elastic force
    of the mesh [N], negative on the back flanks, what each pair has of it on the working ones, force and tangent
    (entries, n_o), rate of the deflection [m/s], the logarithm of the force that the teeth's own law has over the one
    where an exponent changes nothing, the stiffness [N/m] by which more compliance that the pairs share takes from the
    force, what it grows by per excess by the form of each pair's flanks (entries, n_o) [N/m] and per compliance that
    the pair has less by itself [N2/m], and how many times as stiff they are for damping that grows with the force.
    `places` (samples, n) of all coordinates [m], sampled at `sampling_rate`, and `turned` (samples,) what all that
    turns moves by besides, as the nominal rotation departs from a steady one. `early` steps let free vibrations die
    out. Samples of forces are those of `instants`, or hold no more than half the sampling rate. `led` (entries,):
    velocity [m/s] that the driver is nudged towards, if it is. `ahead` (entries,): by how much the mesh is turned on
    beyond that phase, as shafts twist and gears vibrate [cycles].
    """

    model: NonLinear
    phase: Array
    elastic: Array
    pairs: Pressed
    rate: Array
    level: Array
    sharing: Array
    form: Array
    own: Array
    stiffer: Array
    tangent: Tangent
    substeps: int
    early: int
    places: Array
    turned: Array
    sampling_rate: float
    instants: bool
    led: Array
    ahead: Array

    @property
    def law(self) -> MeshLaw:
        """That of the force in the mesh."""
        return self.model.law

    @property
    def drive(self) -> int:
        """The coordinate that the driver's torque acts on."""
        return W if self.model.elastic_shaft else U1

    def answers(self, acting: Acting) -> dict[str, Lines]:
        """Half-spectra (columns, K), as of numpy's `rfft`, of what the channels change by, as the rig's sensors show
        it, by departures under forces: dte [m], rb times angles [m], y [m], and the load's torque over the driven
        gear's base radius [N]."""
        weights = AT_ONCE if self.instants else OVER_STEP
        places, pushes = departures(self.tangent, acting, self.substeps, self.early, weights)
        whole = [U1, U2, *([LOAD] if self.model.rig.load.twists else [])]
        lines = {one: _spectrum(places[:, one, :].T) for one in whole}
        moved = {"angle_driver": lines[U1], "angle_driven": lines[U2]}
        for name, row in zip(("y_driver", "y_driven"), self.model.displacements, strict=True):
            seen = np.sum([np.float32(row[one]) * places[:, one, :] for one in np.flatnonzero(row)], axis=0)
            moved[name] = _spectrum(seen.T)
        moved["torque_driven"] = self._borne(pushes, lines, acting)
        sensors, frequency = self.model.rig.sensors, self._omega / (2 * np.pi)
        response = {name: shown_by(sensors, name, frequency).astype(np.complex64) for name in moved}
        shown: dict[str, Lines] = {name: change * response[name] for name, change in moved.items()}
        y = shown["y_driver"] - shown["y_driven"]
        shown["dte"] = shown["angle_driver"] - shown["angle_driven"] + np.float32(self.model.factor) * y
        return shown

    def _borne(self, pushes: NDArray[np.float32], lines: Mapping[int, Lines], acting: Acting) -> Lines:
        """Half-spectra (columns, K) of the force [N] that the load bears at its base circle, from those of the
        coordinates and forces in the mesh (steps, columns)."""
        if self.model.rig.load.twists:
            shaft = self.model.structure
            assert shaft is not None  # who twists has one
            stiffness = shaft.load_stiffness + 1j * self._omega * shaft.load_damping
            reaction = stiffness.astype(np.complex64) * (lines[U2] - lines[LOAD])
        else:
            borne = -(self.tangent.mesh[U2] + self.tangent.rubbed[::2, U2]).astype(pushes.dtype)
            reaction = self._shown((pushes * borne[:, None]).T) / self._smeared
        # What pushes at an end that is held is borne there.
        held = (acting.on == LOAD) | ((acting.on == U2) & (self.tangent.inverse[U2] == 0.0))
        if held.any():
            np.add.at(reaction, acting.of[held], self._shown(acting.values[::2, held].T))
        return reaction

    def _shown(self, stepped: NDArray[np.floating[Any]]) -> Lines:
        """Half-spectra (columns, K) of forces (columns, steps) as the record's sensor has them."""
        if self.instants:
            return _spectrum(stepped[:, :: self.substeps])
        return _spectrum(stepped)[:, : len(self._omega)] / np.float32(self.substeps)

    @cached_property
    def _smeared(self) -> Complex:
        """What the mean over each step has of a force (K,) at its beginning: impacts fall between two of these."""
        if self.instants:
            return np.ones(len(self._omega), dtype=complex)
        step = self._omega / (2 * np.pi) * self.tangent.step
        return np.asarray(np.sinc(step) * np.exp(1j * np.pi * step))

    @cached_property
    def _omega(self) -> Array:
        """Circular frequencies [rad/s] of the lines of one repetition."""
        return np.asarray(2 * np.pi * np.fft.rfftfreq(len(self.places), 1 / self.sampling_rate))

    @cached_property
    def _lines(self) -> Complex:
        """Half-spectra (n, K) of all coordinates [m], of what turns with the nominal rotation: springs between two such
        see none of that, masses all."""
        moved = self.places.copy()
        turning = [one for one in (U1, U2, W, LOAD) if one < self.model.size]
        moved[:, turning] += self.turned[:, None]
        return np.fft.rfft(moved, axis=0).T

    def turned_into(self, other: NonLinear) -> dict[int, Array]:
        """Forces (entries,) [N] by coordinate, or in the mesh, that do in first order what turning into `other` does, a
        model like this one that differs by little around its mesh."""
        moved: dict[int, Array] = {}
        here, there = _linear(self.model), _linear(replace(other, nudge=self.model.nudge))
        springs, dampers, masses = (two - one for one, two in zip(here, there, strict=True))
        for number in np.flatnonzero(springs.any(axis=1) | dampers.any(axis=1) | (masses != 0.0)):
            to = np.flatnonzero((springs[number] != 0.0) | (dampers[number] != 0.0))
            lines = springs[number, to] @ self._lines[to] + 1j * self._omega * (dampers[number, to] @ self._lines[to])
            lines -= self._omega**2 * masses[number] * self._lines[number]
            moved[int(number)] = np.fft.irfft(lines, len(self.places))
        for one, two in zip(self.model.support_springs, other.support_springs, strict=True):
            if one != two:
                before, after = one.force(self.places), two.force(self.places)
                for number in np.flatnonzero([any(parts) for parts in zip(one.along, two.along, strict=True)]):
                    change = two.along[number] * after - one.along[number] * before
                    moved[int(number)] = moved.get(int(number), np.zeros(len(change))) + change
        forces = {number: self.resampled(-force) for number, force in moved.items()}
        factor, changed = (one.constants().damping_factor for one in (self.model, other))
        if factor != changed:
            forces[IN_MESH] = (changed / factor - 1.0) * self.tangent.damping * self.rate
        return forces

    def fine(self, coordinate: int) -> Array:
        """A coordinate [m] on the half-step grid (entries,)."""
        return self.resampled(self.places[:, coordinate])

    def resampled(self, values: Array) -> Array:
        """What is known at the samples (samples,), on the half-step grid (entries,)."""
        return resampled(values, len(self.phase))

    def rate_of(self, excess: Array) -> Array:
        """Time derivative (entries, columns) of periodic signals on the grid."""
        return np.asarray((np.roll(excess, -1, axis=0) - np.roll(excess, 1, axis=0)) / self.tangent.step)

    @cached_property
    def pair_stiffness(self) -> Array:
        """Force (entries, n_o) [N/m] that each pair adds in the mesh per unit of its own excess."""
        return self.pairs.tangent * self.stiffer[:, None]

    @cached_property
    def form_stiffness(self) -> Array:
        """The same (entries, n_o) [N/m] per excess by the form of its flanks."""
        return self.form * self.stiffer[:, None]

    def of_own_compliance(self, compliance: Array) -> Array:
        """Force (entries,) [N] in the mesh of pairs that each yield by (entries, n_o) [m/N] more by themselves."""
        return -over_pairs(self.own * compliance) * self.stiffer

    def of_excess(self, excess: Array) -> Array:
        """Force (entries, columns) [N] that more material (entries, columns) [m] on all working flanks adds in the
        mesh: none while the back flanks touch."""
        added = self.tangent.stiffness[:, None] * excess + self.tangent.damping[:, None] * self.rate_of(excess)
        return np.where(self.elastic[:, None] < 0.0, 0.0, added)

    def of_back_excess(self, excess: Array) -> Array:
        """The same of more material on all back flanks."""
        return np.where(self.elastic[:, None] < 0.0, -self.tangent.stiffness[:, None] * excess, 0.0)


def _spectrum(signal: NDArray[np.floating[Any]]) -> Lines:
    """Half-spectra (columns, K) of signals (columns, samples)."""
    return np.asarray(rfft(np.ascontiguousarray(signal, dtype=np.float32), axis=1))


def along(steady: Steady) -> Along:
    """The tangent of a steady motion."""
    setup, model = steady.setup, steady.setup.model
    samples = len(steady.outputs)
    places = placed(model.size, steady.outputs)
    around = model.around(_mean_deflections(model, places))
    substeps, finer = _substeps(steady)
    entries = 2 * substeps * samples
    step = 1.0 / (setup.sampling_rate * substeps)
    times = IMPACTS if setup.apart(steady.outputs).any() else 1
    motion = (integrated if times > 1 else interpolated)(steady, around.mesh, times * entries)
    found = Pushing(*(averaged(one, times) for one in pushing(steady, motion, substeps * times)))
    decay = max(model.slowest_decay(float(steady.drive.fine.mean())), 1e-9)
    grid = stepped(steady, substeps)
    return Along(
        model=model,
        phase=grid.phases(0, entries),
        elastic=found.elastic,
        pairs=Pressed(found.pair_force, found.pair_tangent),
        rate=found.rate,
        level=found.level,
        sharing=found.sharing,
        form=found.form,
        own=found.own,
        stiffer=found.stiffer,
        tangent=Tangent(
            *around,
            found.stiffness,
            found.damping,
            step,
            *_bearings(model, places, entries),
            model.turned_on(np.eye(model.size)),
            found.turning,
            found.rubbed,
            finer,
        ),
        substeps=substeps,
        early=min(ceil(log(1 / TRANSIENT) / decay / step), samples * substeps),
        places=places,
        turned=setup.departures(samples) * model.law.base_pitch,
        sampling_rate=setup.sampling_rate,
        instants=steady.given.instants,
        led=grid.led(0, entries),
        ahead=found.ahead,
    )


def _linear(model: NonLinear) -> tuple[Array, Array, Array]:
    """Springs [N/m] and dampers [N s/m] (n, n) of a rig but for its mesh and its supports' springs, and masses [kg]
    (n,); none on a coordinate that does not move, unless it is the load's or a driven gear's, which bears a
    reaction."""
    constants, structure = model.constants(), model.structure
    springs, dampers = springs_and_dampers(constants, structure, (0.0, 0.0))
    inverse = inverse_masses(constants, structure)
    still = inverse == 0.0
    masses = np.divide(1.0, inverse, out=np.zeros_like(inverse), where=~still)
    if still[U2]:
        masses[U2] = model.masses[1]
    still[LOAD:][:1] = False
    springs[still], dampers[still] = 0.0, 0.0
    return springs, dampers, masses


def _bearings(model: NonLinear, places: Array, entries: int) -> tuple[Array, Array]:
    """What coordinates contribute to the deflection of supports whose stiffness depends on it (b, n), and how much
    stiffer than about their mean they are (entries, b) [N/m] at the places (samples, n)."""
    varying = [one for one in model.support_springs if one.exponent]
    if not varying:
        return np.empty((0, places.shape[1])), np.empty((entries, 0))
    stiffer = []
    for one in varying:
        deflection = one.deflection(places)
        stiffer.append(one.tangent(resampled(deflection, entries)) - one.tangent(deflection.mean()))
    return np.array([one.along for one in varying]), np.stack(stiffer, axis=1)


def _mean_deflections(model: NonLinear, places: Array) -> tuple[float, float]:
    """Those [m] of both supports along their direction, at the places (samples, n)."""
    one, two = (float(spring.deflection(places).mean()) for spring in model.support_springs)
    return one, two


def _substeps(steady: Steady) -> tuple[int, int]:
    """Steps per sample of all that varies along the motion, its own up to `MOST` or a few more, and into how many each
    is parted, for every mode to be stable at the mesh's largest tangent."""
    model, setup = steady.setup.model, steady.setup
    law, mesh = model.law, model.rig.mesh
    _, tangent = law.evaluate(law.approach[-1], np.arange(law.phases) / law.phases)
    stiffest = 1.5 * mesh.stiffness_scale * float(tangent.max())
    force = float(steady.drive.fine.mean())
    fastest = float(np.abs(np.linalg.eigvals(model.linearised(stiffest, force))).max())
    least, needed = min(setup.substeps, MOST), fastest / (STABLE * setup.sampling_rate)
    choices = ((substeps, max(ceil(needed / substeps), 1)) for substeps in range(least, 2 * least))
    # A step costs about as much as what varies over it.
    return min(choices, key=lambda one: one[0] * (1 + one[1]))

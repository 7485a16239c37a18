"""Torque on the driver: the mean plus one realisation of the multisine, on any grid of one period."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.plan.schedule import PHASE_DRIFT
from gearbench.identification.excitation.comb import CombError, check_residue, hunting_teeth, ranked_residues
from gearbench.identification.excitation.multisine import COSET_LEAST, MultisineSignal, random_phase_multisine
from gearbench.rig import Experiment, Rig

Array = NDArray[np.float64]

MOST_SAMPLES = 2**24  # in one excitation period


@dataclass(frozen=True)
class Torque:
    """Periodic driver torque [N m]: `mean` plus `signal` (none: constant)."""

    mean: float
    signal: MultisineSignal | None = None

    def samples_of(self, period: int) -> int:
        """Samples after which it repeats, of an excitation period of so many: a constant repeats after each."""
        return 1 if self.signal is None else period

    def sample(self, points: int) -> Array:
        """Exact values (points,) [N m] at equidistant instants of one excitation period, from its start."""
        if self.signal is None:
            return np.full(points, self.mean)
        return self.mean + self.signal.sample(points)


@dataclass(frozen=True)
class Comb:
    """A residue comb on a pair of gears: `modulus` lines to the mesh frequency, one residue a realisation."""

    modulus: int
    residues: tuple[int, ...]

    def residue(self, number: int) -> int:
        """Residue of realisation `number`."""
        return self.residues[number % len(self.residues)]


def comb_for(experiment: Experiment, rig: Rig) -> Comb | None:
    """The comb of an experiment; None where its grid is another.

    The modulus is the number of teeth that mesh in one excitation period, m lcm(z1, z2): with m > 1 the
    lines lie m times closer and the shafts' orders fall on every m-th. A given residue holds for all
    realisations; without one, realisation i takes the i-th best residue (and starts again after the last
    that keeps the classes apart), so that several realisations fill the gaps between the lines: a mode whose
    half-power bandwidth is less than four mesh frequencies needs that. Raises BenchError unless the
    excitation period holds whole hunting periods.
    """
    wanted = experiment.multisine
    if wanted is None or wanted.grid != "comb":
        return None
    teeth = rig.driver.teeth, rig.driven.teeth
    modulus = _teeth_in_period(experiment, rig)
    try:
        if wanted.residue is None:
            best = ranked_residues(modulus, *teeth)[: experiment.realisations]
            return Comb(modulus, tuple(int(residue) for residue in best))
        check_residue(modulus, wanted.residue)
    except CombError as error:
        raise BenchError(f"experiment.multisine: {error}") from error
    return Comb(modulus, (wanted.residue,))


def _teeth_in_period(experiment: Experiment, rig: Rig) -> int:
    """Teeth that mesh in one excitation period, whole hunting periods. Raises BenchError."""
    frequency = experiment.mesh_frequency_for(rig.driver.teeth)
    rate = experiment.sampling_rate
    meshed = frequency * experiment.samples_per_period / rate
    teeth = hunting_teeth(rig.driver.teeth, rig.driven.teeth)
    whole = round(meshed / teeth) * teeth
    if whole and abs(meshed - whole) <= PHASE_DRIFT:
        return whole
    both = f"{rig.driver.teeth} and {rig.driven.teeth}"
    needed = teeth * rate / frequency
    if needed > MOST_SAMPLES:
        choice = f"more than {MOST_SAMPLES} samples"
    elif abs(needed - round(needed)) <= PHASE_DRIFT * rate / frequency:
        choice = f"set samples_per_period = {round(needed)} or a multiple"
    else:
        near = ceil(needed)
        choice = f"set samples_per_period = {near} and mesh_frequency_hz = {teeth * rate / near:.17g}"
    raise BenchError(
        f'grid = "comb" needs an excitation period of whole hunting periods, {teeth} teeth (lcm of {both}) or'
        f" {teeth / frequency:.6g} s at {frequency:g} Hz, but samples_per_period = {experiment.samples_per_period}"
        f" lasts {experiment.samples_per_period / rate:.6g} s: {choice}; where that is too long to measure, take teeth"
        ' of smaller lcm, or grid "full" or "odd" over whole turns of one shaft, which leaves the other untold'
    )


def coset_modulus(experiment: Experiment, rig: Rig) -> int:
    """Lines to the mesh frequency of a coset: mesh periods in one excitation period; 0 where the grid is another.

    Raises BenchError unless they are an even number of at least COSET_LEAST.
    """
    if experiment.multisine is None or experiment.multisine.grid != "coset":
        return 0
    frequency, rate = experiment.mesh_frequency_for(rig.driver.teeth), experiment.sampling_rate
    meshed = frequency * experiment.samples_per_period / rate
    whole = 2 * round(meshed / 2)
    if whole >= COSET_LEAST and abs(meshed - whole) <= PHASE_DRIFT:
        return whole
    wanted = max(whole, COSET_LEAST)
    near = round(wanted * rate / frequency)
    speed = "" if abs(wanted * rate / frequency - near) < PHASE_DRIFT else " and mesh_frequency_hz = "
    speed += f"{wanted * rate / near:.17g}" if speed else ""
    raise BenchError(
        f'grid = "coset" needs an excitation period of an even number of mesh periods, at least {COSET_LEAST}, but'
        f" samples_per_period = {experiment.samples_per_period} holds {meshed:.6g} of them: set samples_per_period ="
        f" {near}{speed}"
    )


def torque_realisation(experiment: Experiment, number: int, rig: Rig) -> Torque:
    """Torque of realisation `number` (0, 1, ...); a comb depends on the rig's teeth.

    Each realisation draws from its own stream, the `number`-th child of the experiment's seed: it does
    not depend on how many there are or in which order they are made. Raises BenchError, MultisineError.
    """
    wanted = experiment.multisine
    if wanted is None:
        return Torque(experiment.torque_mean)
    stream = np.random.default_rng(np.random.SeedSequence(experiment.seed, spawn_key=(number,)))
    comb = comb_for(experiment, rig)
    signal = random_phase_multisine(
        experiment.samples_per_period,
        experiment.sampling_rate,
        wanted.band,
        amplitude=wanted.amplitude,
        rms=wanted.rms,
        grid=wanted.grid,
        crest=wanted.crest,
        modulus=comb.modulus if comb else coset_modulus(experiment, rig),
        residue=comb.residue(number) if comb else 0,
        rng=stream,
    )
    return Torque(experiment.torque_mean, signal)

"""Sampling, speeds and periods of an experiment on a given pair of gears."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

from gearbench.bench.errors import BenchError
from gearbench.rig import Experiment, Rig

# How far the mesh phase may drift over the record [cycles] for it to count as a whole number of mesh
# periods: what the rounding of a speed in a case can do.
PHASE_DRIFT = 1e-6

# Fraction done (0..1) and a note.
ProgressReport = Callable[[float, str], None]


@dataclass(frozen=True)
class Schedule:
    """When is what: a block is the shortest run after which excitation and mesh both repeat, or the whole record where
    `repeats` is false: teeth that differ then meet again only after a longer time.

    `block_periods` excitation periods of `samples_per_period` samples make a block; it holds
    `mesh_cycles` mesh periods; the record has `blocks` of them. `sampling_rate` in Hz, speeds in rad/s,
    each positive in its gear's own direction.
    """

    sampling_rate: float
    samples_per_period: int
    block_periods: int
    blocks: int
    mesh_cycles: int
    speed_driver: float
    speed_driven: float
    repeats: bool = True

    @property
    def block_samples(self) -> int:
        """Samples of one block."""
        return self.block_periods * self.samples_per_period

    @property
    def mesh_frequency(self) -> float:
        """Mesh frequency [Hz], such that a block holds a whole number of mesh periods exactly."""
        return self.mesh_cycles * self.sampling_rate / self.block_samples

    @property
    def mesh_period(self) -> float:
        """Mesh period [s]."""
        return 1.0 / self.mesh_frequency


def schedule(experiment: Experiment, rig: Rig, repeat: int = 1) -> Schedule:
    """The schedule of an experiment on a rig that repeats after `repeat` mesh cycles.

    Raises BenchError unless the record holds a whole number of mesh periods.
    """
    wanted = experiment.mesh_frequency_for(rig.driver.teeth)
    if wanted >= experiment.sampling_rate / 2:
        raise BenchError(
            f"the mesh frequency of {wanted:g} Hz (experiment.mesh_frequency_hz or speed_driver_rpm) must lie below"
            f" half of experiment.sampling_rate_hz, {experiment.sampling_rate / 2:g} Hz"
        )
    period = experiment.samples_per_period / experiment.sampling_rate
    record = experiment.periods * period
    cycles = round(wanted * record)
    if abs(wanted * record - cycles) > PHASE_DRIFT or cycles < 1:
        low, high = max(1, int(wanted * record)) / record, (int(wanted * record) + 1) / record
        nearest = f"{high:.9g} Hz does" if low == high else f"{low:.9g} Hz and {high:.9g} Hz do"
        raise BenchError(
            f"the record of {record:g} s (periods x samples_per_period / sampling_rate_hz) holds"
            f" {wanted * record:.6g} mesh periods at {wanted:g} Hz, which must be a whole number; {nearest}"
        )
    whole = (
        n
        for n in range(1, experiment.periods + 1)
        if not experiment.periods % n and not n * cycles % (experiment.periods * repeat)
    )
    found = next(whole, None)
    block_periods = found or experiment.periods
    blocks = experiment.periods // block_periods
    mesh_cycles = cycles // blocks
    frequency = mesh_cycles / (block_periods * period)
    return Schedule(
        sampling_rate=experiment.sampling_rate,
        samples_per_period=experiment.samples_per_period,
        block_periods=block_periods,
        blocks=blocks,
        mesh_cycles=mesh_cycles,
        speed_driver=2 * pi * frequency / rig.driver.teeth,
        speed_driven=2 * pi * frequency / rig.driven.teeth,
        repeats=found is not None,
    )

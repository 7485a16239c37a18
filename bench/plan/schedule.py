"""Sampling, speeds and periods of an experiment on a given pair of gears."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import gcd, lcm, pi

from gearbench.bench.errors import BenchError
from gearbench.bench.plan.rotation import Rotation, rotation_of
from gearbench.geometry.tooth.iso1328 import drawn_gear
from gearbench.geometry.tooth.micro import teeth_alike
from gearbench.rig import Experiment, Gear, Rig

# How far the mesh phase may drift over the record [cycles] for it to count as a whole number of mesh
# periods: what the rounding of a speed in a case can do.
PHASE_DRIFT = 1e-6

# Fraction done (0..1) and a note.
ProgressReport = Callable[[float, str], None]


@dataclass(frozen=True)
class Schedule:
    """When is what. Excitation, mesh and teeth all repeat after `repeat_periods` excitation periods of
    `samples_per_period` samples; the record has `periods` of them. A block is what is run at a time: a repetition, or
    the whole record where that is shorter; it holds `mesh_cycles` mesh periods. `sampling_rate` in Hz, speeds in rad/s,
    each positive in its gear's own direction; `repeat_cycles` is the number of mesh cycles after which the same teeth
    meet again. A rig that `drifts` never repeats exactly, nor does one with a `rotation`, whose speed changes: its
    speeds and mesh frequency are those before the record, which need not hold whole mesh periods.
    """

    sampling_rate: float
    samples_per_period: int
    periods: int
    repeat_periods: int
    mesh_cycles: int
    speed_driver: float
    speed_driven: float
    repeat_cycles: int = 1
    drifts: bool = False
    rotation: Rotation | None = None
    teeth_driven: int = 0  # asked for where the speed changes

    @property
    def wraps(self) -> bool:
        """Whether the record is at least as long as what repeats, but for a slow drift."""
        return self.rotation is None and self.repeat_periods <= self.periods

    @property
    def repeats(self) -> bool:
        """Whether the record is at least as long as what repeats."""
        return self.wraps and not self.drifts

    @property
    def block_periods(self) -> int:
        """Excitation periods of one block."""
        return self.periods if self.drifts or self.rotation else min(self.repeat_periods, self.periods)

    @property
    def blocks(self) -> int:
        """Blocks that the record takes; the last one need not be used up."""
        return -(-self.periods // self.block_periods)

    @property
    def block_samples(self) -> int:
        """Samples of one block."""
        return self.block_periods * self.samples_per_period

    @property
    def record_samples(self) -> int:
        """Samples of all periods of the record."""
        return self.periods * self.samples_per_period

    @property
    def repeat_time(self) -> float:
        """Time [s] after which everything repeats."""
        return self.repeat_periods * self.samples_per_period / self.sampling_rate

    @property
    def cycles_per_sample(self) -> float:
        """Mesh cycles that pass in a sample, before the record where speed changes."""
        return self.mesh_frequency / self.sampling_rate if self.rotation else self.mesh_cycles / self.block_samples

    @property
    def mesh_frequency(self) -> float:
        """Mesh frequency [Hz], such that a block holds a whole number of mesh periods exactly."""
        if self.rotation is not None:
            return float(self.rotation.speed[0]) * self.rotation.teeth / (2 * pi)
        return self.mesh_cycles * self.sampling_rate / self.block_samples

    @property
    def mesh_period(self) -> float:
        """Mesh period [s]."""
        return 1.0 / self.mesh_frequency

    @property
    def shortest_mesh_period(self) -> float:
        """Mesh period [s] where the gears turn fastest."""
        return self.mesh_period if self.rotation is None else 1.0 / self.rotation.highest


def schedule(experiment: Experiment, rig: Rig) -> Schedule:
    """The schedule of an experiment on a rig. Raises BenchError unless the record holds a whole number of mesh periods
    or its speed changes."""
    rotation = rotation_of(experiment, rig)
    wanted = rotation.highest if rotation else experiment.mesh_frequency_for(rig.driver.teeth)
    if wanted >= experiment.sampling_rate / 2:
        raise BenchError(
            f"the mesh frequency of {wanted:g} Hz (experiment.mesh_frequency_hz or speed_driver_rpm) must lie below"
            f" half of experiment.sampling_rate_hz, {experiment.sampling_rate / 2:g} Hz"
        )
    if rotation is not None:
        return _changing(experiment, rig, rotation)
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
    repeat = cycles_to_repeat(rig)
    whole = experiment.periods * repeat
    repeat_periods = whole // gcd(whole, cycles)
    drifts = rig.mesh.stiffness_drift != 0.0
    block_periods = experiment.periods if drifts else min(repeat_periods, experiment.periods)
    mesh_cycles = block_periods * cycles // experiment.periods
    frequency = mesh_cycles / (block_periods * period)
    return Schedule(
        sampling_rate=experiment.sampling_rate,
        samples_per_period=experiment.samples_per_period,
        periods=experiment.periods,
        repeat_periods=repeat_periods,
        mesh_cycles=mesh_cycles,
        speed_driver=2 * pi * frequency / rig.driver.teeth,
        speed_driven=2 * pi * frequency / rig.driven.teeth,
        repeat_cycles=repeat,
        drifts=drifts,
    )


def _changing(experiment: Experiment, rig: Rig, rotation: Rotation) -> Schedule:
    """The schedule of an experiment whose speed changes. Raises BenchError for a comb."""
    if experiment.multisine is not None and experiment.multisine.grid == "comb":
        raise BenchError(
            'experiment.multisine.grid = "comb" keeps its lines between those of a constant speed, but the speed'
            ' changes: set "full" or "odd"'
        )
    return Schedule(
        sampling_rate=experiment.sampling_rate,
        samples_per_period=experiment.samples_per_period,
        periods=experiment.periods,
        repeat_periods=experiment.periods,
        mesh_cycles=0,
        speed_driver=float(rotation.speed[0]),
        speed_driven=float(rotation.speed[0]) * rig.driver.teeth / rig.driven.teeth,
        repeat_cycles=cycles_to_repeat(rig),
        drifts=rig.mesh.stiffness_drift != 0.0,
        rotation=rotation,
        teeth_driven=rig.driven.teeth,
    )


def cycles_to_repeat(rig: Rig) -> int:
    """Mesh cycles after which the same teeth with the same errors meet again: 1 where all are alike, the teeth of the
    gear whose teeth differ, or, where those of both do, the hunting period. Ripple of the drive and the run-out of an
    encoder count as a difference of that gear's teeth. Raises GeometryError for a grade that ISO 1328-1 has no
    tolerance for."""
    ripple = rig.drive.ripple
    driver = _differs(rig.driver, "rig.driver") or (ripple is not None and any(ripple.amplitude))
    driver = driver or rig.sensors.encoder_runout_driver > 0
    driven = _differs(rig.driven, "rig.driven") or rig.sensors.encoder_runout_driven > 0
    return lcm(rig.driver.teeth if driver else 1, rig.driven.teeth if driven else 1)


def _differs(gear: Gear, name: str) -> bool:
    """Whether one tooth of a gear is unlike another."""
    cracked = gear.crack is not None and (gear.crack.meshed or gear.crack.stiffness_loss > 0)
    return cracked or not teeth_alike(drawn_gear(gear, name))

"""One realisation on the non-linear lumped model: settle, then one stretch after which everything repeats."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, gcd, lcm, log

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.nonlinear.mesh_law import mesh_law
from gearbench.bench.plan.excitation import Torque
from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.refusals.effects import refuse_unknown
from gearbench.geometry import Pair
from gearbench.lumped import choose_substeps
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.model import COORDINATES, Coordinates, NonLinear, nonlinear_model
from gearbench.lumped.nonlinear.step import columns, integrate
from gearbench.lumped.nonlinear.tables import Motion, Table, tables
from gearbench.rig import Experiment, Gear, Rig, Simulation

Array = NDArray[np.float64]

MOST_ENTRIES = 2**20  # half steps tabulated at once
HEADROOM = 2.0  # largest tabulated over largest applied load: resonances load the flanks more than the torque does


@dataclass(frozen=True)
class Setup:
    """What all realisations share. The rig repeats after `block_samples` samples; `table` covers them from sample
    0 at `first_phase` [cycles], unless they are too many to keep. `repeats`: the record is at least that long."""

    model: NonLinear
    substeps: int
    sampling_rate: float
    samples_per_period: int
    cycles_per_sample: float
    block_samples: int
    repeats: bool
    table: Table | None
    first_phase: float = 0.0

    @property
    def step(self) -> float:
        """Integration step [s]."""
        return 1.0 / (self.sampling_rate * self.substeps)

    @property
    def mesh_frequency(self) -> float:
        """Mesh frequency [Hz]."""
        return self.cycles_per_sample * self.sampling_rate

    def phase_at(self, sample: int) -> float:
        """Mesh phase [cycles] of a sample."""
        return self.first_phase + sample * self.cycles_per_sample

    def table_for(self, start: int, samples: int) -> Table:
        """Table of `samples` samples from sample `start`."""
        return tables(
            self.model,
            Motion(
                cycles=samples * self.cycles_per_sample,
                entries=2 * self.substeps * samples,
                step=self.step,
                first_phase=self.phase_at(start),
            ),
        )

    def advance(self, force: Array, state: Array, start: int, samples: int) -> tuple[Array, Array]:
        """Final state and outputs (samples, 7) from sample `start`; force [N]: one excitation period, half steps."""
        if self.table is not None and start == 0 and samples == self.block_samples:
            return self._integrate(self.table, force, state, 0)
        parts, stop = [], start + samples
        most = max(MOST_ENTRIES // (2 * self.substeps), 1)
        for at in range(start, stop, most):
            table = self.table_for(at, min(most, stop - at))
            state, out = self._integrate(table, force, state, 2 * self.substeps * at % force.size)
            parts.append(out)
        return state, np.concatenate(parts)

    def _integrate(self, table: Table, force: Array, state: Array, first_entry: int) -> tuple[Array, Array]:
        return integrate(
            self.model,
            table,
            force,
            state,
            step=self.step,
            substeps=self.substeps,
            mesh_frequency=self.mesh_frequency,
            first_entry=first_entry,
        )

    def dte(self, outputs: Array) -> Array:
        """DTE [m] of outputs (samples, 7)."""
        seen = columns(outputs)
        return np.asarray(seen.u1 - seen.u2 + self.model.factor * (seen.y1 - seen.y2))

    def at_rest(self, mean_force: float, start: int) -> Array:
        """Static equilibrium under the mean force [N] at sample `start`."""
        table = self.table_for(start, 1)
        phase = self.phase_at(start)
        state = self.model.equilibrium(mean_force, float(table.excess[0]), float(table.gain[0]), phase)
        return state + self._common_motion(phase)

    def _common_motion(self, phase: float) -> Array:
        """Motion of both gears together under ripple: nothing holds it back, so it must begin right."""
        ripple, moved, moving = self.model.rig.drive.ripple, 0.0, 0.0
        if ripple is None or not self.model.free:
            return np.zeros(2 * COORDINATES)
        total = sum(self.model.masses[:3])
        radius, z1 = self.model.base_radii[0], self.model.rig.driver.teeth
        speed = 2 * np.pi * self.mesh_frequency / z1
        for order, size, angle in zip(ripple.orders, ripple.amplitude, ripple.phase, strict=True):
            turn = 2 * np.pi * order * phase / z1 + angle
            rate = order * speed
            push = size / radius / total
            moved -= push * np.cos(turn) / rate**2
            moving += push * np.sin(turn) / rate
        common = (Coordinates(u1=size, y1=0.0, y2=0.0, u2=size, w=size) for size in (moved, moving))
        return np.concatenate([*common])


@dataclass(frozen=True)
class Steady:
    """`outputs` (samples, 7) of one block, or of the whole record where that is shorter; `residual` the change of the
    DTE from the block before, largest value over its standard deviation; `settling_periods` excitation periods."""

    outputs: Array
    residual: float
    settling_periods: int


def cycles_to_repeat(rig: Rig) -> int:
    """Mesh cycles after which all teeth in contact are alike again: 1, the teeth of a gear, or the hunting period."""
    first, second = _differs(rig.driver), _differs(rig.driven)
    ripple = rig.drive.ripple
    if ripple is not None and any(ripple.amplitude):
        first = True
    return lcm(rig.driver.teeth if first else 1, rig.driven.teeth if second else 1)


def _differs(gear: Gear) -> bool:
    cracked = gear.crack is not None and gear.crack.stiffness_loss > 0
    return len(set(gear.pitch_error)) > 1 or gear.runout > 0 or cracked


def largest_load(experiment: Experiment) -> float:
    """Driver torque [N m] up to which the mesh law of an experiment is tabulated."""
    wanted = experiment.multisine
    peak = 0.0
    if wanted is not None:
        peak = wanted.amplitude if wanted.amplitude is not None else (wanted.rms or 0.0) * wanted.crest
    return HEADROOM * (experiment.torque_mean + peak)


def make_setup(
    rig: Rig,
    simulation: Simulation,
    experiment: Experiment,
    meshing: Pair,
    plan: Schedule,
    law: MeshLaw | None = None,
    first_phase: float = 0.0,
) -> Setup:
    """Model, step and tables of an experiment that begins at `first_phase` [cycles].

    Raises LumpedError, BenchError, GeometryError or ContactError.
    """
    refuse_unknown(rig)
    law = law or mesh_law(rig, simulation, largest_load(experiment))
    model = nonlinear_model(rig, meshing, law)
    band = experiment.multisine.band[1] if experiment.multisine is not None else 0.0
    # The forced response is a mode of that frequency as far as the time step is concerned.
    rate = max(model.fastest_rate(experiment.torque_mean / meshing.driver.base_radius), 2 * np.pi * band)
    substeps = choose_substeps(rate, plan.mesh_period, plan.sampling_rate, simulation.substeps)
    periods, cycles = plan.blocks * plan.block_periods, plan.blocks * plan.mesh_cycles
    whole = periods * cycles_to_repeat(rig)
    repeat = whole // gcd(whole, cycles)
    setup = Setup(
        model=model,
        substeps=substeps,
        sampling_rate=plan.sampling_rate,
        samples_per_period=plan.samples_per_period,
        cycles_per_sample=cycles / (periods * plan.samples_per_period),
        block_samples=repeat * plan.samples_per_period,
        repeats=repeat <= periods,
        table=None,
        first_phase=first_phase,
    )
    if not setup.repeats or 2 * substeps * setup.block_samples > MOST_ENTRIES:
        return setup
    return replace(setup, table=setup.table_for(0, setup.block_samples))


def steady_state(setup: Setup, experiment: Experiment, torque: Torque, record_samples: int) -> Steady:
    """Run one realisation. Raises BenchError if it does not settle within experiment.settling_periods_max."""
    fine = torque.sample(2 * setup.substeps * setup.samples_per_period)
    force = fine / setup.model.base_radii[0]
    mean = torque.mean / setup.model.base_radii[0]
    if not setup.repeats:
        return _long(setup, experiment, force, mean, record_samples)
    state, before = setup.advance(force, setup.at_rest(mean, 0), 0, setup.block_samples)
    settling = once = setup.block_samples // setup.samples_per_period
    while True:
        state, block = setup.advance(force, state, 0, setup.block_samples)
        residual = change(setup.dte(before), setup.dte(block))
        if residual <= experiment.settling_tolerance:
            return Steady(block, residual, settling)
        settling += once
        if settling > experiment.settling_periods_max:
            raise BenchError(
                f"no steady state: after {settling} excitation periods the DTE still changes by {residual:.3g} of its"
                " standard deviation from one repetition to the next, which experiment.settling_tolerance limits to"
                f" {experiment.settling_tolerance:g}; raise settling_periods_max = {experiment.settling_periods_max} or"
                " the damping"
            )
        before = block


def _long(setup: Setup, experiment: Experiment, force: Array, mean: float, samples: int) -> Steady:
    """A record shorter than what repeats: it begins when free vibrations have died out by the slowest decay rate."""
    decay = setup.model.slowest_decay(mean)
    wanted = log(1 / experiment.settling_tolerance) * setup.sampling_rate / setup.samples_per_period
    periods = ceil(wanted / decay) if decay > 0 else experiment.settling_periods_max + 1
    if periods > experiment.settling_periods_max:
        raise BenchError(
            f"no steady state: free vibrations take {periods} excitation periods to die out to"
            f" experiment.settling_tolerance = {experiment.settling_tolerance:g}, more than settling_periods_max ="
            f" {experiment.settling_periods_max}"
        )
    start = -periods * setup.samples_per_period
    state, _ = setup.advance(force, setup.at_rest(mean, start), start, -start)
    _, out = setup.advance(force, state, 0, samples)
    return Steady(out, experiment.settling_tolerance, periods)


def change(before: Array, after: Array) -> float:
    """Largest change of a DTE over its standard deviation, or over a millionth of its mean if it hardly varies."""
    scale = max(float(after.std()), 1e-6 * abs(float(after.mean())), np.finfo(float).tiny)
    return float(np.abs(after - before).max()) / scale

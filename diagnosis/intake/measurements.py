"""Intake: measured records become measurements, cut into hunting periods and held against the nominal rig.

After one hunting period, H = lcm(z1, z2) teeth, the same two teeth meet again, so everything that turns
with either shaft repeats; a repetition of a measurement is the shortest run that holds whole hunting periods and
whole excitation periods. What does not fit the nominal rig is refused in one sentence; what hides
small effects without making a verdict wrong is said in `Measurement.warnings`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import lcm, pi
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.intake.passing import passing_away
from gearbench.diagnosis.intake.plausible import (
    GEARS,
    Facts,
    angle_frequency,
    check_against_nominal,
    check_same_rig,
    facts_of,
    told_by_case,
)
from gearbench.diagnosis.intake.quality import NOISE_IN_WORDS, drift_of, noise_of
from gearbench.records import read_record
from gearbench.records.checks import (
    CHECKS,
    angles_follow_mesh_phase,
    check_record,
    clipped_channels,
    periods_repeat,
    same_samples,
    shafts_turn_true,
)
from gearbench.rig import Case

Array = NDArray[np.float64]

# How far the mesh phase may miss a whole number of hunting periods over one repetition [cycles].
PHASE_DRIFT = 2e-3
# A declared mesh period is taken at its word up to this part of itself; without one, the angles' own fit
# may miss a whole number of teeth over the record by this many cycles.
PHASE_FIT = 0.05
# Departure of an angle from steady rotation, in tooth pitches: said, and refused.
UNSTEADY, TOO_UNSTEADY = 0.03, 0.25
# Channels that are derived from others or are no signal of a sensor.
DERIVED = ("mesh_phase", "dte", "force")
# Repetitions are compared here, by hunting periods and channel by channel, the speed has to be steady, and what turns
# with a shaft is an effect.
DOOR = tuple(check for check in CHECKS if check not in (periods_repeat, angles_follow_mesh_phase, shafts_turn_true))


@dataclass(frozen=True, eq=False)
class Measurement:
    """One record, realisation 0, cut into repetitions.

    `record` says all that replaying it needs: its periods are the repetitions, and attributes that it lacked are
    filled in from the case.
    `periods`: channel -> (P, N) in SI, one repetition per hunting period; the angles are their departures [rad]
    from steady rotation, `angle - 2 pi phase / teeth`, everything else as recorded; a channel that the
    record lacks is absent. `phase` (N,): mesh phase [cycles] of the samples of the first repetition at steady
    speed (each repetition adds `mesh_cycles`). `phase_known`: its origin is the geometry's; `zero_known`: the
    angles' zero is unloaded contact, so that the mean of the transmission error means something.
    `noise`: channel -> rms of one sample's departure between repetitions (empty with one); `drift`: the largest
    change of a channel's level between repetitions beyond white noise, relative to its rms. `creep` (P, N): mesh
    cycles by which the rotation is ahead, on the mean zero. `path`: its file.
    """

    name: str
    record: xr.Dataset
    periods: dict[str, Array]
    sampling_rate: float
    mesh_frequency: float
    phase: Array
    warnings: tuple[str, ...] = ()
    condition: str = ""
    mesh_cycles: int = 0
    phase_known: bool = True
    zero_known: bool = True
    noise: dict[str, float] = field(default_factory=dict)
    drift: float = 0.0
    creep: Array = field(default_factory=lambda: np.zeros((1, 1)))
    path: Path | None = None

    @property
    def repetitions(self) -> int:
        """Number of repetitions P."""
        return int(self.periods["torque_driver"].shape[0])

    def mean(self, channel: str) -> Array:
        """Mean (N,) of a channel over the repetitions."""
        return self.periods[channel].mean(axis=0)


def intake(records: Sequence[str | Path | xr.Dataset], nominal: Case) -> tuple[Measurement, ...]:
    """The measurements in the records (files or datasets), one each and in that order, held against the nominal rig.

    Raises DiagnosisError or RecordError, one sentence each, for what cannot be diagnosed.
    """
    if not records:
        raise DiagnosisError("no RECORD is given: at least one is needed")
    paths = [None if isinstance(record, xr.Dataset) else Path(record) for record in records]
    resolved = [path.resolve() for path in paths if path]
    for number, one in enumerate(resolved):
        if one in resolved[:number]:
            raise DiagnosisError(f"record {one} is given twice: each one counts once")
    facts = facts_of(nominal)
    names = _names(records)
    sources = [str(path) if path else name for path, name in zip(paths, names, strict=True)]
    made = []
    for record, path, name, source in zip(records, paths, names, sources, strict=True):
        held = record if isinstance(record, xr.Dataset) else read_record(record)
        made.append(replace(measurement(held, name, nominal, source=source, facts=facts), path=path))
    _refuse_copies(made, sources)
    check_same_rig([one.record for one in made], sources)
    return tuple(made)


def measurement(
    record: xr.Dataset, name: str, nominal: Case, *, source: str = "", facts: Facts | None = None
) -> Measurement:
    """One record in memory as a measurement; `source` is what refusals call it (default: its name).

    Raises DiagnosisError, and RecordError for a record that contradicts itself.
    """
    source = source or name
    facts = facts or facts_of(nominal)
    record, notes = told_by_case(record, source, facts)
    doubts = [finding.sentence for finding in check_record(record, source, DOOR)]
    _refuse_clipped(record, source)
    condition, others = check_against_nominal(record, name, source, facts)
    notes += [*doubts, *others]
    frequency = _mesh_frequency(record, facts)
    samples, repetitions, cycles = _repetition(record, frequency, source, facts, notes)
    frequency = cycles * float(record.attrs["sampling_rate"]) / samples
    phase, known = _phase(record, frequency, facts, notes)
    record = _completed(record, (samples, repetitions), frequency, float(phase[0]))
    whole = {str(key): record[key].values[0, : repetitions * samples] for key in record.data_vars if key not in DERIVED}
    whole, zero = _departures(whole, phase, source, facts, notes)
    whole = _usable(whole, notes)
    periods = {key: values.reshape(repetitions, samples) for key, values in whole.items()}
    drift = drift_of(periods, facts.base_radii, notes) if repetitions > 1 else 0.0
    passed = passing_away(periods, facts.base_radii)
    record = without(record, passed)
    periods = {key: values - passed[key] for key, values in periods.items()}
    if repetitions == 1:
        _one_repetition(record, notes)
    if record.sizes["realisation"] > 1:
        notes.append(f"of {record.sizes['realisation']} realisations only the first is used")
    return Measurement(
        name,
        record,
        periods,
        float(record.attrs["sampling_rate"]),
        frequency,
        phase[:samples],
        tuple(notes),
        condition,
        cycles,
        known,
        zero,
        {key: noise_of(values) for key, values in periods.items()} if repetitions > 1 else {},
        drift,
        _creep(passed, facts),
    )


def held_out_of(
    measurements: Sequence[Measurement], name: str | None = None
) -> tuple[tuple[Measurement, ...], Measurement | None]:
    """The measurements to diagnose from, and the one that is held out (None: there is none to spare).

    `name` picks it by name or condition. Without a name it is the one whose name or condition is
    "held-out"; else, of four or more, the last one; else none. Raises DiagnosisError for a name that none
    or several have, and if nothing were left.
    """
    wanted = name or "held-out"
    picked = [one for one in measurements if wanted in (one.name, one.condition)]
    if name is not None and len(picked) != 1:
        known = ", ".join(one.name for one in measurements)
        raise DiagnosisError(f"held_out = {name} names {len(picked)} records, must name one of {known}")
    if not picked and len(measurements) >= 4:
        picked = [measurements[-1]]
    if name is not None and len(measurements) == 1:
        raise DiagnosisError(f"held_out = {name} is the only record: nothing is left to diagnose from")
    if len(picked) != 1 or len(measurements) == 1:
        return tuple(measurements), None
    return tuple(one for one in measurements if one is not picked[0]), picked[0]


def _names(records: Sequence[str | Path | xr.Dataset]) -> list[str]:
    """Short names, made distinct by a number: file stems without `record-`, conditions of datasets."""
    stems = []
    for record in records:
        if isinstance(record, xr.Dataset):
            stems.append(str(record.attrs.get("condition") or "record"))
        else:
            stem = Path(record).resolve().stem
            stems.append(stem.removeprefix("record-") or stem)
    return [
        stem if stems.count(stem) == 1 else f"{stem}-{1 + stems[:number].count(stem)}"
        for number, stem in enumerate(stems)
    ]


def _refuse_copies(made: Sequence[Measurement], sources: Sequence[str]) -> None:
    found = same_samples([one.record.isel(realisation=[0]) for one in made])
    if found is not None:
        (first, _), (second, _) = found
        raise DiagnosisError(
            f"records {sources[first]} and {sources[second]} hold the same samples: each one counts once"
        )


def _mesh_frequency(record: xr.Dataset, facts: Facts) -> float:
    """Mesh frequency [Hz]: the declared one, or the angles' own, rounded to whole teeth over the record."""
    if "mesh_period" in record.attrs:
        return 1.0 / float(record.attrs["mesh_period"])
    frequency = angle_frequency(record, facts)
    duration = record.sizes["time"] / float(record.attrs["sampling_rate"])
    cycles = round(frequency * duration)
    return cycles / duration if cycles and abs(frequency * duration - cycles) < PHASE_FIT else frequency


def _repetition(
    record: xr.Dataset, frequency: float, source: str, facts: Facts, notes: list[str]
) -> tuple[int, int, int]:
    """Samples of a repetition, number of repetitions, and mesh cycles of one: the fewest excitation periods that hold
    whole hunting periods."""
    rate = float(record.attrs["sampling_rate"])
    samples, periods = int(record.attrs["samples_per_period"]), int(record.attrs["periods"])
    hunting = lcm(*facts.teeth)
    for count in range(1, periods + 1):
        cycles = count * samples * frequency / rate
        turns = round(cycles / hunting)
        if turns >= 1 and abs(cycles - turns * hunting) <= PHASE_DRIFT:
            repetitions = periods // count
            if repetitions * count < periods:
                rest = periods - repetitions * count
                notes.append(
                    f"the last {rest} of {periods} excitation periods are left out: they hold no whole number of"
                    " hunting periods"
                )
            if turns > 1:
                notes.append(f"the excitation repeats only after {turns} hunting periods, which are taken as one")
            return count * samples, repetitions, turns * hunting
    held = periods * samples * frequency / rate
    if held < hunting - PHASE_DRIFT:
        raise DiagnosisError(
            f"{source} holds {held:.4g} mesh periods, less than one hunting period of lcm({facts.teeth[0]},"
            f" {facts.teeth[1]}) = {hunting}: it must last at least {hunting / frequency:.4g} s"
        )
    raise DiagnosisError(
        f"{source} holds {held:.6g} mesh periods in {periods} excitation period(s) of {samples} samples, of which no"
        f" whole number is a multiple of the hunting period of {hunting} mesh periods ({hunting / frequency:.6g} s)"
    )


def _phase(record: xr.Dataset, frequency: float, facts: Facts, notes: list[str]) -> tuple[Array, bool]:
    """Mesh phase [cycles] of every sample at steady speed, and whether its origin is the geometry's."""
    steps = np.arange(record.sizes["time"]) * (frequency / float(record.attrs["sampling_rate"]))
    origin = record.attrs.get("mesh_phase_origin")
    if "mesh_phase" in record:
        start = float((record["mesh_phase"].values[0] - steps).mean())
        known = origin in (None, "geometry")
    elif "mesh_phase" in record.attrs:
        start = float(np.ravel(record.attrs["mesh_phase"])[0])
        known = origin in (None, "geometry")
    else:
        # At steady speed both angles tell the phase; the deflection between them is shared.
        turned = [
            record[f"angle_{gear}"].values[0] * teeth / (2 * pi)
            for gear, teeth in zip(GEARS, facts.teeth, strict=True)
        ]
        start = float((0.5 * (turned[0] + turned[1]) - steps).mean())
        known = origin == "geometry"
    if not known:
        notes.append(
            "the origin of the mesh phase is arbitrary (mesh_phase_origin): single teeth and contact zones cannot be"
            " told by their number"
        )
    return np.asarray(start + steps, dtype=np.float64), known


def _completed(record: xr.Dataset, repetition: tuple[int, int], frequency: float, start: float) -> xr.Dataset:
    """The record with repetitions for periods, and those attributes filled in that the angles tell."""
    known = {"mesh_period": 1.0 / frequency, "mesh_phase": start}
    filled = {key: value for key, value in known.items() if key not in record.attrs}
    samples, repetitions = repetition
    whole = record.isel(time=slice(0, samples * repetitions))
    return whole.assign_attrs(filled | {"samples_per_period": samples, "periods": repetitions})


def without(record: xr.Dataset, part: dict[str, Array]) -> xr.Dataset:
    """The record without a part (P, N) of the channels of its first realisation."""
    moved = {key: values.ravel() for key, values in part.items() if values.any()}
    if not moved:
        return record
    channels = {key: record[key].copy(data=record[key].values.copy()) for key in moved}
    for key, values in moved.items():
        channels[key].values[0] -= values
    return record.assign(channels)


def _departures(
    whole: dict[str, Array], phase: Array, source: str, facts: Facts, notes: list[str]
) -> tuple[dict[str, Array], bool]:
    """The channels with steady rotation taken off the angles, and whether the angles' zero is contact."""
    departures = dict(whole)
    for gear, teeth in zip(GEARS, facts.teeth, strict=True):
        name = f"angle_{gear}"
        departure = whole[name] - 2 * pi / teeth * phase[: whole[name].size]
        wander = float(np.abs(departure - departure.mean()).max()) * teeth / (2 * pi)
        if wander > TOO_UNSTEADY:
            raise DiagnosisError(
                f"{source}: {name} departs from steady rotation by {wander:.3g} tooth pitches (limit"
                f" {TOO_UNSTEADY:g}): the speed must be steady over the record"
            )
        if wander > UNSTEADY:
            notes.append(
                f"{name} departs from steady rotation by {wander:.2g} tooth pitches: lines of the mesh orders widen"
            )
        departures[name] = departure
    radii = facts.base_radii
    means = [float(departures[f"angle_{gear}"].mean()) for gear in GEARS]
    slack = abs(radii[0] * means[0] - radii[1] * means[1])
    zero = max(slack, *(radius * abs(mean) for radius, mean in zip(radii, means, strict=True))) < facts.slack
    if not zero:
        notes.append(
            f"the angles' zero is not unloaded contact (mean transmission error {slack * 1e6:.3g} um): mean"
            " deflections are left out"
        )
        for gear in GEARS:
            departures[f"angle_{gear}"] = departures[f"angle_{gear}"] - departures[f"angle_{gear}"].mean()
    return departures, zero


def _creep(passed: dict[str, Array], facts: Facts) -> Array:
    """Mesh cycles (P, N) by which what passes away in both angles turns the mesh on."""
    turned = [passed[f"angle_{gear}"] * teeth for gear, teeth in zip(GEARS, facts.teeth, strict=True)]
    return np.asarray(np.mean(turned, axis=0) / (2 * pi))


def _refuse_clipped(record: xr.Dataset, source: str) -> None:
    """What clipping leaves in a channel looks like an effect."""
    for name, (share, _) in clipped_channels(record).items():
        if name not in DERIVED:
            raise DiagnosisError(
                f"{source}: channel {name} is clipped at {100 * share:.2g} % of its samples (limit 0)"
            )


def _usable(whole: dict[str, Array], notes: list[str]) -> dict[str, Array]:
    """The channels that carry a signal; what missing ones cost is said."""
    dead = {f"y_{gear}" for gear in GEARS if f"y_{gear}" in whole and np.ptp(whole[f"y_{gear}"]) == 0.0}
    # A set point that was logged in place of the reaction's torque.
    if "torque_driven" in whole and _constant(whole["torque_driven"]):
        dead.add("torque_driven")
    kept = {name: values for name, values in whole.items() if name not in dead}
    for name, loss in (
        ("y_driver", "what happens at the driver's support is seen only through the mesh"),
        ("y_driven", "what happens at the driven gear's support is seen only through the mesh"),
        ("torque_driven", "the load side has no force balance of its own"),
    ):
        if name not in kept:
            notes.append(f"there is no {name}: {loss}, so that small effects stay hidden")
    if _constant(kept["torque_driver"]):
        notes.append("the torque is constant: without excitation only the operating response is seen")
    return kept


def _constant(values: Array) -> bool:
    """Whether a torque is one number, but for rounding."""
    return bool(np.ptp(values) <= 1e-9 * abs(float(values.mean())))


def _one_repetition(record: xr.Dataset, notes: list[str]) -> None:
    averaged = int(record.attrs.get("periods_averaged", 1))
    if averaged > 1:
        notes.append(f"the record holds the mean over {averaged} blocks: {NOISE_IN_WORDS}")
    else:
        notes.append(f"the record holds one hunting period only: {NOISE_IN_WORDS}")

"""What a record needs beyond its columns: one clock, mesh period and phase, integrals, the places of torques."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import pi

import numpy as np

from gearbench.records.conversion.channel_map import ChannelMap
from gearbench.records.conversion.clock import resampled
from gearbench.records.conversion.common import Common
from gearbench.records.conversion.integrate import integrated, lost_share
from gearbench.records.conversion.signals import Signal
from gearbench.records.errors import RecordError
from gearbench.records.even_speed import LOST, VARIES, departure
from gearbench.records.formats.source import Array

# Largest relative distance of a measured mean speed from the declared one.
SPEED = 0.01
# The angles' own mean speed is rounded to whole teeth over the record within this many [cycles].
WHOLE_TEETH = 0.05
# Interpolation errors beyond this part of a signal are said to be large.
DOUBTFUL = 0.01
# Frequencies over the sampling rate up to which interpolation errs by 2 %: quintic splines, 1 / (1 + (x / (1 - x))^6)
# (Unser 1999), and the windowed sinc.
SPLINES, SINC = 0.35, 0.47
# Integration of vibrations leaves out what lies below this [Hz], unless the map says otherwise.
LOWEST = 5.0
# What was integrated keeps a channel of its own.
_RAW = (("angle_", 1, "speed_"), ("y_", 2, "acceleration_"), ("x_", 2, "acceleration_x_"))


@dataclass(frozen=True, eq=False)
class Assembly:
    """A record while it is put together: `channels` (runs, n) and their `details` are filled, `notes` grow."""

    signals: tuple[Signal, ...]
    common: Common
    channel_map: ChannelMap
    attributes: Mapping[str, float | str]
    notes: list[str]
    channels: dict[str, Array] = field(default_factory=dict)
    details: dict[str, dict[str, float | str]] = field(default_factory=dict)

    def teeth(self, signal: Signal) -> float | None:
        """Teeth of the gear whose angle a signal is; None if it is none or they are not known."""
        teeth = self.attributes.get(f"teeth_{signal.name.removeprefix('angle_')}") if signal.turns else None
        return None if teeth is None else float(teeth)


def put_on_clock(work: Assembly, signal: Signal, mesh_period: float | None, progress: Callable[[float], None]) -> None:
    """Bring a signal onto the record's clock, and say what that did to it."""
    common, said = work.common, work.details.setdefault(signal.name, {})
    work.channels[signal.name], error = resampled(
        signal.values,
        signal.clock,
        common.start,
        common.rate,
        common.total,
        slope=_slope(work, signal, mesh_period) if signal.turns and not signal.integrals else 0.0,
        period=common.samples / common.rate,
        progress=progress,
    )
    if error is not None:
        said["interpolation_error"] = error
        said["believed_to_hz"] = (SPLINES if signal.clock.time is not None else SINC) * signal.clock.rate
        was = "single times" if signal.clock.time is not None else f"{signal.clock.rate:.9g} Hz"
        work.notes.append(
            f"{signal.name} is interpolated from {was} to {common.rate:.9g} Hz, relative error {error:.1g}"
            + (f" (more than {DOUBTFUL:g}: is it sampled fast enough?)" if error > DOUBTFUL else "")
        )
    if signal.resolution is not None:
        said["resolution"] = signal.resolution
        work.notes.append(f"{signal.name} is resolved to {1e6 * signal.resolution:.3g} urad")


def mesh_period_of(work: Assembly, declared: float | None) -> float | None:
    """The mesh period [s]: declared and held against what turns, or taken from it; of a speed that varies the mean one.
    Raises RecordError."""
    found, measured, varies = None, None, False
    for signal in work.signals:
        teeth = work.teeth(signal)
        if teeth is None or signal.integrals == 2:
            continue
        values = work.channels[signal.name]
        angle = np.cumsum(values, axis=1) / work.common.rate if signal.integrals else values
        departs = departure(angle * teeth / (2 * pi))
        if signal.integrals and departs > LOST:
            raise RecordError(
                f"{signal.name} is integrated from speed, which varies by {departs:.3g} cycles of the mesh from a"
                f" constant one (limit {LOST:g}): an error of its gain would run away; measure the angle"
            )
        varies = varies or departs > LOST
        speed = float(values.mean()) if signal.integrals else _speed(values, work.common.rate)
        if not speed > 0:
            raise RecordError(
                f"{signal.name} turns backwards (mean speed {speed:.4g} rad/s, must be positive): each gear's angle"
                f" rises in its own direction of rotation; give [channel.{signal.name}] sign = -1"
            )
        own = 2 * pi / (speed * teeth)
        if declared is not None and not varies and abs(own / declared - 1) > SPEED:
            raise RecordError(
                f"{signal.name} turns at a mesh frequency of {1 / own:.5g} Hz, but {1 / declared:.5g} Hz is declared"
                f" (limit {SPEED:.0%}): wrong unit, pulses per revolution, teeth or sampling rate"
            )
        if not signal.integrals:
            # Where the speed varies nothing is declared, but the gears keep step: saw-teeth of a counter do not.
            first, measured = measured or (signal.name, own), (signal.name, own)
            if abs(own / first[1] - 1) > SPEED:
                raise RecordError(
                    f"{first[0]} turns at a mean mesh frequency of {1 / first[1]:.5g} Hz, but {signal.name} at"
                    f" {1 / own:.5g} Hz (limit {SPEED:.0%}): wrong pulses per revolution or teeth, or a counter that"
                    " starts again"
                )
        found = found or own
    if found is not None and varies:
        return found
    if declared is not None or found is None:
        return declared
    duration = work.common.duration
    cycles, whole = duration / found, round(duration / found)
    if whole and abs(cycles - whole) < WHOLE_TEETH:
        work.notes.append(
            f"the mesh frequency is taken from the angles: {whole / duration:.6g} Hz, {whole} teeth in the record"
        )
        return duration / whole
    work.notes.append(
        f"the record holds {cycles:.5g} mesh periods by its angles, no whole number, which identify needs: choose"
        " periods, or say mesh_frequency_hz"
    )
    return found


def integrate_all(work: Assembly, mesh_period: float | None) -> None:
    """Integrate, over the whole periods of the record, what was measured as a derivative."""
    for signal in work.signals:
        if not signal.integrals:
            continue
        name = signal.name
        for prefix, order, kept in _RAW:
            raw_name = kept + name.removeprefix(prefix)
            if name.startswith(prefix) and signal.integrals == order and raw_name not in work.channels:
                work.channels[raw_name] = work.channels[name]
        if signal.turns:
            _integrate_rotation(work, signal, mesh_period)
        else:
            _integrate_vibration(work, signal)


def _integrate_rotation(work: Assembly, signal: Signal, mesh_period: float | None) -> None:
    """Angle from speed or angular acceleration: the mean speed is the mesh's, so that both gears keep step."""
    teeth, raw, rate = work.teeth(signal), work.channels[signal.name], work.common.rate
    if mesh_period is None or teeth is None:
        raise RecordError(f"{signal.name} is integrated: its mean speed needs mesh_frequency_hz and the teeth")
    mean = 2 * pi / (teeth * mesh_period)
    lowest = work.channel_map.channels[signal.name].lowest or 0.0
    ramp = mean * np.arange(work.common.total) / rate
    work.channels[signal.name] = ramp + integrated(raw, rate, signal.integrals, lowest)
    measured = f", measured {raw.mean():.6g}" if signal.integrals == 1 else ""
    work.notes.append(
        f"{signal.name} is integrated from {'speed' if signal.integrals == 1 else 'acceleration'}: its zero is"
        f" arbitrary, its mean speed is the mesh's ({mean:.6g} rad/s{measured})"
    )


def _integrate_vibration(work: Assembly, signal: Signal) -> None:
    """Displacement from velocity or acceleration, from the lowest frequency on that the sensor can tell."""
    raw, rate = work.channels[signal.name], work.common.rate
    lowest = work.channel_map.channels[signal.name].lowest
    lowest = LOWEST if lowest is None else lowest
    share = lost_share(raw, rate, lowest)
    work.channels[signal.name] = integrated(raw, rate, signal.integrals, lowest)
    work.details[signal.name] |= {"integrated_times": signal.integrals, "integrated_from_hz": lowest}
    work.notes.append(
        f"{signal.name} is integrated from {'acceleration' if signal.integrals == 2 else 'velocity'}: what lies below"
        f" {lowest:g} Hz ({share:.2g} of its rms) and the mean deflection are lost"
    )


def add_mesh_phase(work: Assembly, mesh_period: float | None) -> float | None:
    """Mesh phase [cycles] of each run from the angles, by which identification aligns runs: at steady speed that of the
    mesh period. Returns the mesh period, None where the speed varies too much for one."""
    turning = [(signal, teeth) for signal in work.signals if (teeth := work.teeth(signal)) is not None]
    cycles = [work.channels[signal.name] * teeth / (2 * pi) for signal, teeth in turning]
    given = work.channels.get("mesh_phase")
    departs = max((departure(rows) for rows in (cycles if given is None else [given])), default=0.0)
    period = None if departs > LOST else mesh_period
    if departs > VARIES:
        work.notes.append(
            f"the speed varies, by {departs:.3g} cycles of the mesh from a constant one:"
            f" {'mesh_phase follows the angles' if given is None else 'mesh_phase tells it'}"
            f"{', and the record has no mesh period' if period is None else ''}"
        )
    if given is not None or not turning or (mesh_period is None and departs <= VARIES):
        return period
    phase = np.mean(cycles, axis=0)
    if departs <= VARIES and mesh_period is not None:
        steps = np.arange(work.common.total) / (work.common.rate * mesh_period)
        phase = (phase - steps).mean(axis=1, keepdims=True) + steps
    work.channels["mesh_phase"] = phase
    _say_where_phases_start(work, turning)
    return period


def _say_where_phases_start(work: Assembly, turning: list[tuple[Signal, float]]) -> None:
    """Say what a zero that is not the geometry's means."""
    relative = [signal.name for signal, _ in turning if not signal.absolute]
    if relative and work.attributes.get("mesh_phase_origin") == "geometry":
        work.notes.append(
            f"{', '.join(relative)}: counted without an absolute zero, so that mesh phase 0 is not the geometry's, as"
            " mesh_phase_origin says"
        )
    if relative and len(work.channels["mesh_phase"]) > 1:
        work.notes.append(
            f"{', '.join(relative)}: without an absolute zero the runs' mesh phases against one another are not known,"
            " and identify, which aligns runs by them, may be wrong"
        )


def say_locations(work: Assembly) -> None:
    """Say of each channel what the map knows, and of torques what their place means for the force on the mesh."""
    for name, spec in work.channel_map.channels.items():
        if spec.location is not None:
            work.details[name]["location"] = spec.location
        if spec.delay:
            work.details[name]["delay_corrected"] = spec.delay
        if spec.pulses_per_revolution is not None:
            work.details[name]["pulses_per_revolution"] = spec.pulses_per_revolution
    places = {
        name: spec.location or "not given"
        for name, spec in work.channel_map.channels.items()
        if name in ("torque_driver", "torque_driven") and spec.location not in ("gear", "outermost")
    }
    lonely = {"y_driver", "y_driven"} & set(work.channels)
    if len(lonely) == 1 and "dte" not in work.channels:
        work.notes.append(f"only {lonely.pop()} of y_driver and y_driven is there, and identify needs both for the DTE")
    if places:
        work.notes.append(
            f"{' and '.join(places)} (location: {', '.join(places.values())}): recorded unchanged, as at the outermost"
            " inertia: it is not gear torque unless the rig's case has what lies between, [rig.drive.coupling] or"
            " [rig.load.coupling]"
        )


def _slope(work: Assembly, signal: Signal, mesh_period: float | None) -> float:
    """Mean speed [rad/s] of an angle: the declared one where it is near, else a linear fit."""
    clock, teeth = signal.clock, work.teeth(signal)
    times = clock.times
    fitted = float(np.polyfit(times - times.mean(), signal.values.mean(axis=0), 1)[0])
    if mesh_period is not None and teeth is not None:
        declared = 2 * pi / (teeth * mesh_period)
        if abs(fitted / declared - 1) <= 1e-3:
            return declared
    return fitted


def _speed(angle: Array, rate: float) -> float:
    """Mean speed [rad/s] of an angle (runs, n)."""
    steps = np.arange(angle.shape[1]) - 0.5 * (angle.shape[1] - 1)
    return float((steps @ (angle - angle.mean(axis=1, keepdims=True)).T / (steps @ steps)).mean()) * rate

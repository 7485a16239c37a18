"""Channels of two devices whose clocks run at rates of their own: the teeth that both angles pass tell the ratio.

Both gears pass the same number of teeth, z_1 theta_1 and z_2 theta_2 over 2 pi, whatever they do in between. On clocks
that agree their difference is a vibration; on clocks that do not it drifts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gearbench.records.conversion.channel_map import ChannelSpec
from gearbench.records.conversion.clock import Clock
from gearbench.records.conversion.signals import Signal
from gearbench.records.errors import RecordError

GEARS = ("driver", "driven")
# Clocks of devices differ by less than this; beyond it something else is wrong.
LARGEST = 1e-3
# A drift of the teeth passed is reported where it exceeds their scatter by this factor.
SHOWS = 3.0


def clocks_by_teeth(
    signals: Sequence[Signal], specs: Mapping[str, ChannelSpec], attributes: Mapping[str, float | str], notes: list[str]
) -> list[Signal]:
    """The signals, those with clock = "teeth" at the rate that makes both gears pass the same teeth.

    Without that key a ratio that shows is reported in `notes`. Raises RecordError where the key cannot be followed.
    """
    chosen = [signal.name for signal in signals if specs[signal.name].clock == "teeth"]
    angles = {s.name.removeprefix("angle_"): s for s in signals if s.turns and not s.integrals}
    teeth = [float(attributes.get(f"teeth_{gear}", 0.0)) for gear in GEARS]
    if set(angles) != set(GEARS) or not all(teeth):
        if chosen:
            raise RecordError(f"channel.{chosen[0]}.clock = 'teeth' needs both angles, measured, and both teeth")
        return list(signals)
    speeds = [_speed(angles[gear]) * number for gear, number in zip(GEARS, teeth, strict=True)]
    ratio = speeds[0] / speeds[1]
    if not chosen:
        if _shows(angles, teeth, abs(ratio - 1)):
            notes.append(_said_of(ratio))
        return list(signals)
    own = [gear for gear in GEARS if f"angle_{gear}" in chosen]
    if len(own) != 1:
        raise RecordError(
            f"clock = 'teeth' names {' and '.join(chosen)}: it must name the angle of one gear, and not of both"
        )
    factor = ratio if own == ["driven"] else 1.0 / ratio
    if abs(factor - 1) > LARGEST:
        raise RecordError(
            f"channel.angle_{own[0]}.clock = 'teeth': the angles pass teeth at rates that differ by {factor - 1:+.2%}"
            f" (limit {LARGEST:.1%} for clocks): wrong teeth, sampling rate or pulses per revolution"
        )
    notes.append(
        f"the clock of {', '.join(chosen)} runs {1e6 * (factor - 1):+.4g} ppm against the others', by the teeth that"
        " both gears pass: taken off. Its offset is not known from them"
    )
    return [replace(s, clock=_faster(s.clock, factor)) if s.name in chosen else s for s in signals]


def _said_of(ratio: float) -> str:
    """What angles that pass teeth at rates of that ratio may come from."""
    rates = f"angle_driver and angle_driven pass teeth at rates that differ by {1e6 * (ratio - 1):+.3g} ppm"
    if abs(ratio - 1) > LARGEST:
        return f"{rates}, more than clocks do (limit {LARGEST:.1%}): wrong pulses per revolution, teeth or unit of one"
    return (
        f"{rates}: if they come from devices with clocks of their own, clock = 'teeth' for the channels of one of them"
        " makes them agree"
    )


def reference_rate(signals: Sequence[Signal], specs: Mapping[str, ChannelSpec]) -> dict[str, float | str]:
    """The rate of the record as an attribute, where some clocks follow from the teeth: that of the others."""
    others = [s.clock.rate for s in signals if specs[s.name].clock is None and s.clock.time is None]
    return {"sampling_rate": max(others)} if others and any(spec.clock for spec in specs.values()) else {}


def _faster(clock: Clock, factor: float) -> Clock:
    """The clock with its rate times a factor; its start is kept."""
    time = None if clock.time is None else clock.time[0] + (clock.time - clock.time[0]) / factor
    return Clock(clock.start, clock.rate * factor, clock.samples, time)


def _line(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Straight line with weights that fade out at the ends, so that vibrations do not tilt it."""
    size = time.size
    weight = np.sin(np.pi * (np.arange(size) + 0.5) / size) ** 2
    return np.asarray(np.polyfit(time - time[0], values, 1, w=weight))


def _speed(signal: Signal) -> float:
    """Mean speed [rad/s] of all runs."""
    time = signal.clock.times
    return float(np.mean([_line(time, row)[0] for row in signal.values]))


def _shows(angles: Mapping[str, Signal], teeth: Sequence[float], departure: float) -> bool:
    """Whether a departure of the ratio makes the teeth passed drift by more than they swing about a steady rotation."""
    swing, passed = 0.0, 0.0
    for gear, number in zip(GEARS, teeth, strict=True):
        time = angles[gear].clock.times
        for row in angles[gear].values:
            swing = max(swing, number * float(np.std(row - np.polyval(_line(time, row), time - time[0]))))
            passed = max(passed, number * float(np.ptp(row)))
    return departure * passed > SHOWS * swing

"""What repeats with each turn of an encoder, found and taken off: eccentric discs, uneven pulses.

The reading of an eccentric encoder is theta + e cos(theta - phi); uneven lines add higher orders. Whatever else a gear
does once a turn, as teeth that run out make it do, looks the same in its angle and goes with it: only who asks for it
knows which it is.

In a single angle the rotation itself stands beside the orders, and only a straight line in time can be told from
them. Where both angles are there on one clock, z1 theta1 - z2 theta2 is free of it, whatever the speed does, and the
orders of both gears are found in that.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.records.conversion.channel_map import ChannelSpec
from gearbench.records.conversion.signals import Signal
from gearbench.records.errors import RecordError
from gearbench.records.even_speed import VARIES, departure
from gearbench.records.formats.source import Array

# Turns below which what repeats with each turn cannot be told from what happened once.
TURNS = 2.0
# An order is taken off where it exceeds what its neighbours hold by this factor.
STANDS_OUT = 3.0
# Neighbours of an order, as parts of the inverse number of turns.
NEIGHBOURS = np.array([-5.0, -4.0, -3.0, 3.0, 4.0, 5.0])
# Orders of both gears that turn alike (order 2 of 20 teeth, 3 of 30) share what is found: singular values below.
TWINS = 0.02
# Cycles over the record by which orders of the other gear part at least from those that are wanted.
APART = 0.25
# Rounds in which the rotation itself loses the error.
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class _Turning:
    """An angle (runs, n) [rad] whose `orders` of its own turn are looked for in a sum of angles that has it times
    `weight`."""

    signal: Signal
    orders: NDArray[np.int64]
    weight: float = 1.0

    @property
    def turns(self) -> float:
        """Turns in the shortest run."""
        return float(np.ptp(self.signal.values, axis=1).min()) / (2 * pi)


def taken_off(
    signals: list[Signal],
    specs: Mapping[str, ChannelSpec],
    notes: list[str],
    attributes: Mapping[str, float | str],
) -> tuple[list[Signal], dict[str, dict[str, float | str]]]:
    """All signals, those without the orders 1..`runout_orders` that the map names of them, and what is to be said of
    their channels, as in `notes`. `attributes`: the teeth of both gears, if known.

    Raises RecordError for what is no angle, for fewer than TURNS turns, and for a speed that varies where the other
    gear's angle is not there on the same clock.
    """
    details: dict[str, dict[str, float | str]] = {signal.name: {} for signal in signals}
    asked = {signal.name: _turning(signal, specs[signal.name]) for signal in signals}
    wanted = [turning for turning in asked.values() if turning is not None]
    if not wanted:
        return signals, details
    pair = _pair(signals, attributes)
    if pair is not None:
        passed = sum((weight * signal.values for signal, weight in pair), np.zeros(()))
        groups = [(_both(pair, wanted), np.asarray(passed))]
    else:
        groups = [([turning], turning.signal.values) for turning in wanted]
    cleaned = {signal.name: signal for signal in signals}
    for parts, values in groups:
        if pair is None:
            _require_steady(parts[0].signal, attributes)
        for turning, values_without, said, more in _without(parts, values):
            name = turning.signal.name
            if asked[name] is None:
                continue
            cleaned[name] = replace(turning.signal, values=values_without)
            notes.append(f"{name}: what repeats with each turn is taken off ({said})")
            details[name] |= more
    return list(cleaned.values()), details


def _turning(signal: Signal, spec: ChannelSpec) -> _Turning | None:
    """The signal with the orders that the map asks for, None where it asks for none. Raises RecordError."""
    if spec.runout_orders is None:
        return None
    where = f"channel.{signal.name}.runout_orders = {spec.runout_orders:g}"
    if not signal.turns or signal.integrals:
        raise RecordError(f"{where} belongs to a measured angle, which {signal.name} is not")
    found = _Turning(signal, np.arange(1, int(spec.runout_orders) + 1))
    if found.turns < TURNS:
        raise RecordError(
            f"{where}: {signal.name} makes {found.turns:.3g} turns, at least {TURNS:g} are needed to tell what repeats"
        )
    return found


def _pair(signals: list[Signal], attributes: Mapping[str, float | str]) -> list[tuple[Signal, float]] | None:
    """Both angles on one clock, each with the factor by which the gears' rotation falls out of their sum."""
    angles = {signal.name: signal for signal in signals if signal.turns and not signal.integrals}
    if not {"angle_driver", "angle_driven"} <= set(angles) or not {"teeth_driver", "teeth_driven"} <= set(attributes):
        return None
    first, second = angles["angle_driver"], angles["angle_driven"]
    if first.values.shape != second.values.shape or not np.array_equal(first.clock.times, second.clock.times):
        return None
    return [(first, float(attributes["teeth_driver"])), (second, -float(attributes["teeth_driven"]))]


def _both(pair: list[tuple[Signal, float]], wanted: list[_Turning]) -> list[_Turning]:
    """The angles whose orders are wanted, and of one that is not asked for the orders that turn otherwise than these:
    they are found beside them, and stay in it."""
    weights = {signal.name: weight for signal, weight in pair}
    parts = [replace(turning, weight=weights[turning.signal.name]) for turning in wanted]
    most = max(int(turning.orders[-1]) for turning in wanted)
    taken = np.concatenate([turning.orders * turning.turns for turning in wanted])
    for signal, weight in pair:
        if signal.name in {turning.signal.name for turning in wanted}:
            continue
        other = _Turning(signal, np.arange(1, most + 1), weight)
        apart = np.abs(other.orders[:, None] * other.turns - taken).min(axis=1) > APART
        if apart.any():
            parts.append(replace(other, orders=other.orders[apart]))
    return parts


def _require_steady(signal: Signal, attributes: Mapping[str, float | str]) -> None:
    teeth = attributes.get(f"teeth_{signal.name.removeprefix('angle_')}")
    departs = 0.0 if teeth is None else departure(signal.values) * float(teeth) / (2 * pi)
    if departs > VARIES:
        raise RecordError(
            f"channel.{signal.name}.runout_orders: the speed varies, by {departs:.3g} cycles of the mesh from a"
            f" constant one (limit {VARIES:g}), and without both angles on one clock run-out cannot be told from that"
        )


def _without(
    parts: list[_Turning], values: Array
) -> Iterator[tuple[_Turning, Array, str, dict[str, float | str]]]:
    """Each angle without the orders that stand out of `values` (runs, n), the sum in which they are looked for, what is
    said of them in words, and the first one's size and phase."""
    time = parts[0].signal.clock.times
    rotations = [part.signal.values for part in parts]
    found = [np.zeros(part.orders.size, dtype=complex) for part in parts]
    for _ in range(ROUNDS):
        found = _orders(values, parts, rotations, time)
        rotations = [
            part.signal.values - _error(own, part.orders, rotation)
            for part, own, rotation in zip(parts, found, rotations, strict=True)
        ]
    left = values - sum(
        part.weight * _error(own, part.orders, rotation)
        for part, own, rotation in zip(parts, found, rotations, strict=True)
    )
    for part, own, rotation in zip(parts, found, rotations, strict=True):
        limits = STANDS_OUT * _level(left / abs(part.weight), rotation, time, part)
        kept = np.where(np.abs(own) > limits, own, 0.0)
        said = [
            f"order {order}: {1e6 * abs(value):.4g} urad at {np.degrees(-np.angle(value)) % 360:.3g} deg"
            if abs(value) > limit
            else f"order {order}: nothing above {1e6 * limit:.3g} urad"
            for order, value, limit in zip(part.orders, own, limits, strict=True)
        ]
        first: dict[str, float | str] = {"runout_removed": float(abs(kept[0]))}
        first["runout_phase"] = float(-np.angle(kept[0]))
        yield part, part.signal.values - _error(kept, part.orders, rotation), "; ".join(said), first


def _error(found: NDArray[np.complex128], orders: NDArray[np.int64], rotation: Array) -> Array:
    """Error (runs, n) of the reading at each rotation: Re sum of c_n exp(j n theta)."""
    turn = np.exp(1j * rotation)
    return np.asarray(sum((value * turn ** int(order)).real for order, value in zip(orders, found, strict=True)))


def _orders(values: Array, parts: list[_Turning], rotations: list[Array], time: Array) -> list[NDArray[np.complex128]]:
    """Coefficients c_n of each part's orders, the same in all runs, beside a straight line in each; least squares with
    weights that fade out at the ends, so that vibrations do not leak in."""
    runs, size = values.shape
    weight = np.sin(pi * (np.arange(size) + 0.5) / size)
    steady = np.stack([np.ones(size), (time - time[0]) / (time[-1] - time[0])], axis=1)
    sizes = [part.orders.size for part in parts]
    columns = np.zeros((runs, size, 2 * runs + 2 * sum(sizes)))
    for run in range(runs):
        turns = [
            part.weight * np.exp(1j * np.outer(rotation[run], part.orders))
            for part, rotation in zip(parts, rotations, strict=True)
        ]
        turn = np.concatenate(turns, axis=1)
        columns[run, :, 2 * run : 2 * run + 2] = steady
        columns[run, :, 2 * runs :] = np.concatenate([turn.real, -turn.imag], axis=1)
    matrix = (columns * weight[:, None]).reshape(runs * size, -1)
    scale = np.linalg.norm(matrix, axis=0)
    solution = np.linalg.lstsq(matrix / scale, (values * weight).ravel(), rcond=TWINS)[0] / scale
    solution = solution[2 * runs :]
    found = solution[: sum(sizes)] + 1j * solution[sum(sizes) :]
    return np.split(found, np.cumsum(sizes)[:-1])


def _level(left: Array, rotation: Array, time: Array, part: _Turning) -> Array:
    """Rms amplitude of what is left (runs, n) beside each order."""
    window = np.sin(pi * (np.arange(time.size) + 0.5) / time.size) ** 2
    window = window / window.sum()
    straight = np.stack([row - np.polyval(np.polyfit(time - time[0], row, 1), time - time[0]) for row in left])
    level = []
    for order in part.orders:
        beside = order + NEIGHBOURS / part.turns
        beside = beside[beside > 1.5 / part.turns]
        amplitudes = [2 * np.abs(np.mean(straight * np.exp(-1j * at * rotation) @ window)) for at in beside]
        level.append(float(np.sqrt(np.mean(np.square(amplitudes)))))
    return np.array(level)

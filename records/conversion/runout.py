"""What repeats with each turn of an encoder, found and taken off: eccentric discs, uneven pulses.

The reading of an eccentric encoder is theta + e cos(theta - phi); uneven lines add higher orders. Whatever else a gear
does once a turn, as teeth that run out make it do, looks the same in its angle and goes with it: only who asks for it
knows which it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import pi

import numpy as np

from gearbench.records.conversion.channel_map import ChannelSpec
from gearbench.records.conversion.signals import Signal
from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Array

# Turns below which what repeats with each turn cannot be told from what happened once.
TURNS = 2.0
# An order is taken off where it exceeds what its neighbours hold by this factor.
STANDS_OUT = 3.0
# Neighbours of an order, as parts of the inverse number of turns.
NEIGHBOURS = np.array([-5.0, -4.0, -3.0, 3.0, 4.0, 5.0])
# Rounds in which the rotation itself loses the error.
ROUNDS = 3


def runout_taken_off(
    signal: Signal, spec: ChannelSpec, notes: list[str], details: dict[str, float | str]
) -> Signal:
    """The signal without the orders 1..`spec.runout_orders` of its own rotation; said in `notes` and `details`.

    Raises RecordError for what is no angle and for fewer than TURNS turns.
    """
    if spec.runout_orders is None:
        return signal
    where = f"channel.{signal.name}.runout_orders = {spec.runout_orders:g}"
    if not signal.turns or signal.integrals:
        raise RecordError(f"{where} belongs to a measured angle, which {signal.name} is not")
    turns = float(np.ptp(signal.values, axis=1).min()) / (2 * pi)
    if turns < TURNS:
        raise RecordError(
            f"{where}: {signal.name} makes {turns:.3g} turns, at least {TURNS:g} are needed to tell what repeats"
        )
    orders = np.arange(1, int(spec.runout_orders) + 1)
    clock = signal.clock
    time = clock.time if clock.time is not None else np.arange(clock.samples) / clock.rate
    rotation, found = signal.values, np.zeros(orders.size, dtype=complex)
    for _ in range(ROUNDS):
        found = _orders(signal.values, rotation, time, orders)
        rotation = signal.values - _error(found, orders, rotation)
    limits = STANDS_OUT * _level(rotation, time, orders, turns)
    kept = np.where(np.abs(found) > limits, found, 0.0)
    said = [
        f"order {order}: {1e6 * abs(value):.4g} urad at {np.degrees(-np.angle(value)) % 360:.3g} deg"
        if abs(value) > limit
        else f"order {order}: nothing above {1e6 * limit:.3g} urad"
        for order, value, limit in zip(orders, found, limits, strict=True)
    ]
    notes.append(f"{signal.name}: what repeats with each turn is taken off ({'; '.join(said)})")
    details |= {"runout_removed": float(abs(kept[0])), "runout_phase": float(-np.angle(kept[0]))}
    return replace(signal, values=signal.values - _error(kept, orders, rotation))


def taken_off(
    signals: list[Signal], specs: Mapping[str, ChannelSpec], notes: list[str]
) -> tuple[list[Signal], dict[str, dict[str, float | str]]]:
    """All signals, those without the orders that the map names of them, and what is to be said of their channels."""
    details: dict[str, dict[str, float | str]] = {}
    cleaned = [
        runout_taken_off(signal, specs[signal.name], notes, details.setdefault(signal.name, {})) for signal in signals
    ]
    return cleaned, details


def _error(found: np.ndarray, orders: np.ndarray, rotation: Array) -> Array:
    """Error (runs, n) of the reading at each rotation: Re sum of c_n exp(j n theta)."""
    turn = np.exp(1j * rotation)
    return np.asarray(sum((value * turn ** int(order)).real for order, value in zip(orders, found, strict=True)))


def _orders(values: Array, rotation: Array, time: Array, orders: np.ndarray) -> np.ndarray:
    """Coefficients c_n of the orders, the same in all runs, beside a straight line in each; least squares with weights
    that fade out at the ends, so that vibrations do not leak in."""
    runs, size = values.shape
    weight = np.sin(pi * (np.arange(size) + 0.5) / size)
    steady = np.stack([np.ones(size), (time - time[0]) / (time[-1] - time[0])], axis=1)
    columns = np.zeros((runs, size, 2 * runs + 2 * orders.size))
    for run in range(runs):
        turn = np.exp(1j * np.outer(rotation[run], orders))
        columns[run, :, 2 * run : 2 * run + 2] = steady
        columns[run, :, 2 * runs :] = np.concatenate([turn.real, -turn.imag], axis=1)
    matrix = (columns * weight[:, None]).reshape(runs * size, -1)
    solution = np.linalg.lstsq(matrix, (values * weight).ravel(), rcond=None)[0][2 * runs :]
    return np.asarray(solution[: orders.size] + 1j * solution[orders.size :])


def _level(rotation: Array, time: Array, orders: np.ndarray, turns: float) -> Array:
    """Rms amplitude of what is left beside each order."""
    window = np.sin(pi * (np.arange(time.size) + 0.5) / time.size) ** 2
    window = window / window.sum()
    left = np.stack([row - np.polyval(np.polyfit(time, row, 1), time) for row in rotation])
    level = []
    for order in orders:
        beside = order + NEIGHBOURS / turns
        beside = beside[beside > 1.5 / turns]
        amplitudes = [2 * np.abs(np.mean(left * np.exp(-1j * at * rotation) @ window)) for at in beside]
        level.append(float(np.sqrt(np.mean(np.square(amplitudes)))))
    return np.array(level)

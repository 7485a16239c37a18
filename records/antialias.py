"""The anti-alias filter that a record says its channels passed, and the delay that they have in common.

What force and transmission error passed alike turns the mesh: their lines are those of an earlier mesh phase than the
record's own, and a filter that delays sidebands otherwise than the lines that they stem from turns each by its own
angle. Both are known where the channels state `filter` and `filter_hz`, or `delay`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.records.errors import RecordError

# Channels that force and transmission error are made of, else these themselves.
PARTS = ("torque_driver", "torque_driven", "angle_driver", "angle_driven", "y_driver", "y_driven")
WHOLE = ("force", "dte")
BUTTERWORTH, ORDERS = "Butterworth, order ", range(1, 21)


@dataclass(frozen=True)
class Lag:
    """What all channels passed: a Butterworth filter of an order with its corner [Hz] (0: none), else a `delay` [s]."""

    delay: float
    corner: float = 0.0
    order: int = 0

    def response(self, frequency: NDArray[np.floating[Any]]) -> NDArray[np.complex128]:
        """By what lines at frequencies (n,) [Hz] were multiplied."""
        if self.order:
            return butterworth(frequency, self.corner, self.order)
        return np.asarray(np.exp(-2j * pi * frequency * self.delay))


def common_lag(record: xr.Dataset) -> Lag | None:
    """What the channels of force and transmission error passed alike; None where they state nothing in common. A
    channel `mesh_phase` that states a delay of its own is late by it already.

    Raises RecordError for a stated filter or delay that none can be.
    """
    names = [name for name in PARTS if name in record] or [name for name in WHOLE if name in record]
    stated = [_stated(record, name) for name in names]
    if not stated or any(one is None for one in stated):
        return None
    first, phase = stated[0], _stated(record, "mesh_phase") if "mesh_phase" in record else None
    own = 0.0 if phase is None else phase.delay
    if first is not None and first.order and all(one == first for one in stated) and not own:
        return first
    delay = min(one.delay for one in stated if one is not None) - own
    return Lag(delay) if delay > 0.0 else None


def about_filter(corner: float, order: int) -> dict[str, Any]:
    """Attributes by which a channel states a Butterworth filter that it passed, its corner in Hz."""
    return {"filter_hz": corner, "filter": f"{BUTTERWORTH}{order}", "delay": butterworth_delay(corner, order)}


def _stated(record: xr.Dataset, name: str) -> Lag | None:
    about = record[name].attrs
    found = re.fullmatch(rf"{BUTTERWORTH}(\d+)", str(about.get("filter", "")))
    if found is not None and "filter_hz" in about:
        corner, order = _number(about, name, "filter_hz", "Hz"), int(found[1])
        if order not in ORDERS:
            raise RecordError(f"{name}: filter = '{BUTTERWORTH}{order}' must be of order 1 to {ORDERS[-1]}")
        return Lag(butterworth_delay(corner, order), corner, order)
    return Lag(_number(about, name, "delay", "s", least=0.0)) if "delay" in about else None


def _number(about: dict[str, Any], name: str, key: str, unit: str, *, least: float = 1e-3) -> float:
    """A number that a channel states. Raises RecordError for what is none, or below the `least`."""
    try:
        value = float(about[key])
    except (TypeError, ValueError):
        value = np.nan
    if not (np.isfinite(value) and value >= least):
        raise RecordError(f"{name}: {key} = {about[key]} must be a number of {unit} (limit {least:g})")
    return value


def butterworth(frequency: NDArray[np.floating[Any]], corner: float, order: int) -> NDArray[np.complex128]:
    """Response (n,) of an analogue low-pass at frequencies (n,) [Hz], 3 dB down at its corner [Hz] (Butterworth,
    Wireless Engineer 7, 1930)."""
    poles = _poles(corner, order)
    return np.asarray(np.prod(-poles / (2j * pi * np.asarray(frequency)[..., None] - poles), axis=-1))


def butterworth_delay(corner: float, order: int) -> float:
    """Its delay [s] far below the corner [Hz]."""
    return float((-1.0 / _poles(corner, order)).real.sum())


def _poles(corner: float, order: int) -> NDArray[np.complex128]:
    number = np.arange(order)
    return np.asarray(2 * pi * corner * np.exp(1j * pi * (2 * number + 1 + order) / (2 * order)))

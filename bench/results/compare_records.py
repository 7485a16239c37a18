"""Two records of the same experiment, sample by sample: rms of each channel and of the difference, by band.

That is how a gap between measured and simulated is told. It makes sense only where both were driven by the same
torque at the same mesh phase; of other records nothing is said here.
"""

from __future__ import annotations

import warnings
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.identification.spectra.transmission_error import TransmissionError, dte

Array = NDArray[np.float64]

# Largest rms difference of the torques relative to their own fluctuation (if constant, to their mean), and largest
# difference of the mesh phase [cycles], that sensors explain.
SAME_TORQUE, SAME_PHASE = 0.01, 1e-3
# Bands end here [Hz] and at the end of the excitation, in steps of 50 Hz: lines above a tenth of the strongest.
BAND_ENDS = (200.0, 1000.0)
STEP, EXCITED = 50.0, 0.1
# Channels, how they are called, factor to the unit, unit.
_CHANNELS = (
    ("dte", "DTE", 1e6, "um"),
    ("y_driver", "y of the driver", 1e6, "um"),
    ("y_driven", "y of the driven gear", 1e6, "um"),
    ("torque_driven", "torque on the driven gear", 1.0, "N m"),
)


class Difference(NamedTuple):
    """Rms of a channel in both records and of their difference over a band, the mean left out."""

    quantity: str
    band: str
    unit: str
    a: float
    b: float
    difference: float


def differences(one: xr.Dataset, two: xr.Dataset) -> list[Difference]:
    """Channel by channel, the whole band first; empty unless both are records of the same experiment."""
    if not same_experiment(one, two):
        return []
    rate = float(one.attrs["sampling_rate"])
    torque = period_mean(one, "torque_driver")
    assert torque is not None
    bands = _bands(torque, rate)
    found = []
    for channel, name, factor, unit in _CHANNELS:
        values = [factor * mean for record in (one, two) if (mean := period_mean(record, channel)) is not None]
        if len(values) < 2:
            continue
        for low, high in bands:
            sizes = [_rms(part, rate, low, high) for part in (values[0], values[1], values[1] - values[0])]
            found.append(Difference(f"{name}, rms", f"{low:g}-{high:g} Hz", unit, *sizes))
    return found


def same_experiment(one: xr.Dataset, two: xr.Dataset) -> bool:
    """Whether both records were driven by the same torque, sampled alike and began at the same mesh phase."""
    for key in ("sampling_rate", "samples_per_period", "mesh_period"):
        first, second = (float(record.attrs.get(key, np.nan)) for record in (one, two))
        if not abs(first - second) <= 1e-9 * first:
            return False
    torques = [mean for record in (one, two) if (mean := period_mean(record, "torque_driver")) is not None]
    if len(torques) < 2 or "mesh_phase" not in one or "mesh_phase" not in two:
        return False
    apart = float(one["mesh_phase"].values[0, 0] - two["mesh_phase"].values[0, 0])
    size = max(float(torques[0].std()), SAME_TORQUE * abs(float(torques[0].mean())))
    return abs(apart) <= SAME_PHASE and float(np.sqrt(np.mean((torques[0] - torques[1]) ** 2))) <= SAME_TORQUE * size


def period_mean(record: xr.Dataset, channel: str) -> Array | None:
    """Mean (N,) of a channel of realisation 0 over the excitation periods; None if the record lacks it."""
    first = record.isel(realisation=[0])
    if channel == "dte" and "angle_driver" in record:
        # As the sensors give it, not as a simulation knows it.
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                values = dte(first.drop_vars("dte", errors="ignore")).values[0]
        except TransmissionError:
            return None
    elif channel in record:
        values = first[channel].values[0]
    else:
        return None
    return np.asarray(values.reshape(int(record.attrs["periods"]), -1).mean(axis=0))


def _bands(torque: Array, rate: float) -> list[tuple[float, float]]:
    size = np.abs(np.fft.rfft(torque))
    size[0] = 0.0
    lines = np.flatnonzero(size > EXCITED * size.max())
    top = rate / 2
    if size.max() > 1e-9 * np.abs(torque).sum():
        top = min(float(np.ceil(lines[-1] * rate / torque.size / STEP - 1e-9) * STEP), top)
    edges = [0.0, *(end for end in BAND_ENDS if end < top), top]
    parts = list(pairwise(edges))
    return [(0.0, top), *parts] if len(parts) > 1 else parts


def _rms(values: Array, rate: float, low: float, high: float) -> float:
    """Rms over the lines above `low` and up to `high` [Hz]."""
    energy = np.abs(np.fft.rfft(values) / values.size) ** 2
    energy[1 : (values.size + 1) // 2] *= 2
    frequency = np.fft.rfftfreq(values.size, 1 / rate)
    return float(np.sqrt(energy[(frequency > low) & (frequency <= high)].sum()))

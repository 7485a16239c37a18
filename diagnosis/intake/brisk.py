"""A repetition at as many instants as its transforms take quickly.

The rest of a diagnosis goes through thousands of Fourier transforms of repetitions. With a large prime factor in the
number of samples each takes up to ten times as long; a sensor that holds no more than half the sampling rate shows the
same lines at a few instants more.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from gearbench.bench.record.sensors import resampled
from gearbench.diagnosis.intake.measurements import Measurement

Array = NDArray[np.float64]

LARGE = 30  # a prime factor beyond which a transform takes twice as long or more


def brisk(measured: Measurement) -> Measurement:
    """The measurement with a few samples more in each repetition, whose lines are the same up to half its own sampling
    rate; itself where its transforms are quick enough, and where its samples are those of instants, as of a simulation:
    others would fold otherwise."""
    samples = measured.phase.size
    if "model" in measured.record.attrs or largest_prime(samples) <= LARGE:
        return measured
    quick = 2 * next_fast_len(-(-samples // 2), real=True)
    rate = measured.sampling_rate * quick / samples
    phase = measured.phase[0] + measured.mesh_cycles / quick * np.arange(quick)
    periods = {name: resampled(values, quick) for name, values in measured.periods.items()}
    record = _record(measured, phase, rate)
    return replace(measured, record=record, periods=periods, sampling_rate=rate, phase=phase)


def largest_prime(number: int) -> int:
    """The largest prime factor of a number above one."""
    factor, rest = 2, number
    while factor * factor <= rest:
        if rest % factor == 0:
            rest //= factor
        else:
            factor += 1
    return rest


def _record(measured: Measurement, phase: Array, rate: float) -> xr.Dataset:
    """What replaying the measurement needs, at samples of mesh phases (N,) in each repetition."""
    old, turns = measured.record, measured.mesh_cycles * np.arange(measured.repetitions)[:, None]
    before, after = turns + measured.phase, turns + phase
    channels = {}
    for name in measured.periods:
        gear = name.removeprefix("angle_")
        turning = 2 * pi / int(old.attrs[f"teeth_{gear}"]) if gear != name else 0.0
        swing = old[name].values[0].reshape(before.shape) - turning * before
        channels[name] = resampled(swing, phase.size) + turning * after
    if "mesh_phase" in old:
        channels["mesh_phase"] = after
    variables = {name: (old[name].dims, one.reshape(1, -1), old[name].attrs) for name, one in channels.items()}
    attributes = {**old.attrs, "sampling_rate": rate, "samples_per_period": phase.size}
    return xr.Dataset(variables, attrs=attributes)

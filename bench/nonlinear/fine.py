"""A steady motion at more instants than its samples: where flanks part and meet between two of them."""

from __future__ import annotations

from dataclasses import replace
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.nonlinear.replay import Steady, resampled
from gearbench.bench.nonlinear.run import State
from gearbench.bench.protocol import Drive
from gearbench.lumped.nonlinear.coordinates import NAMES
from gearbench.lumped.nonlinear.step import columns

Array = NDArray[np.float64]


class Fine(NamedTuple):
    """Places and rates (instants, n) of all coordinates [m, m/s] over one repetition."""

    places: Array
    rates: Array


def interpolated(steady: Steady, instants: int) -> Fine:
    """Through the samples, of a motion that holds no more than half the sampling rate."""
    places = placed(steady.setup.model.size, steady.outputs)
    rates = rates_of(places, steady.setup.sampling_rate)
    return Fine(*(np.stack([resampled(one, instants) for one in values.T], axis=1) for values in (places, rates)))


def integrated(steady: Steady, instants: int) -> Fine:
    """By running through the repetition again, which impacts call for."""
    setup, samples = steady.setup, len(steady.outputs)
    times = instants // samples
    finer = replace(
        setup,
        sampling_rate=setup.sampling_rate * times,
        cycles_per_sample=setup.cycles_per_sample / times,
        block_samples=setup.block_samples * times,
        record_samples=setup.record_samples * times,
        substeps=ceil(setup.substeps / times),
        table=None,
    )
    torque = steady.drive.torque
    fine = resampled(torque, 2 * finer.substeps * times * torque.size) / setup.meshing.driver.base_radius
    _, outputs = finer.advance(Drive(torque, fine), State(0, steady.state), instants)
    places = placed(setup.model.size, outputs)
    return Fine(places, rates_of(places, finer.sampling_rate))


def placed(size: int, outputs: Array) -> Array:
    """Places (samples, n) of all coordinates."""
    out = columns(outputs)
    return np.stack([getattr(out, name) for name in NAMES[:size]], axis=1)


def rates_of(places: Array, sampling_rate: float) -> Array:
    """Time derivatives (samples, n) of places (samples, n) that repeat."""
    frequency = np.fft.rfftfreq(len(places), 1 / sampling_rate)
    lines = 2j * np.pi * frequency[:, None] * np.fft.rfft(places, axis=0)
    return np.asarray(np.fft.irfft(lines, len(places), axis=0))


def averaged(values: Array, times: int) -> Array:
    """Means (entries, ...) over as many instants (times entries, ...) about each entry, half of both outermost ones."""
    if times == 1:
        return values
    half = times // 2
    total = sum(np.roll(values, -shift, axis=0) for shift in range(1 - half, half))
    edges = np.roll(values, -half, axis=0) + np.roll(values, half, axis=0)
    return np.asarray((total + 0.5 * edges)[::times] / times)

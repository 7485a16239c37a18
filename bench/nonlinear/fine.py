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
from gearbench.lumped.nonlinear.model import NonLinear
from gearbench.lumped.nonlinear.step import columns

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """At instants of one repetition (instants,): deflection of the mesh [m], its rate [m/s], and how far the centres
    turn the mesh on [cycles]; rates (instants, n) of all coordinates [m/s], without columns on a rig without
    friction."""

    travel: Array
    rate: Array
    turned: Array
    rates: Array


def interpolated(steady: Steady, mesh: Array, instants: int) -> Motion:
    """Through the samples, of a motion that holds no more than half the sampling rate; mesh (n,): what coordinates
    contribute to the deflection."""
    places = placed(steady.setup.model.size, steady.outputs)
    found = _motion(steady.setup.model, places, mesh, steady.setup.sampling_rate)
    travel, rate, turned = (resampled(one, instants) for one in found[:3])
    rates = np.empty((instants, found.rates.shape[1]))
    for column, values in enumerate(found.rates.T):
        rates[:, column] = resampled(values, instants)
    return Motion(travel, rate, turned, rates)


def integrated(steady: Steady, mesh: Array, instants: int) -> Motion:
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
    return _motion(setup.model, placed(setup.model.size, outputs), mesh, finer.sampling_rate)


def _motion(model: NonLinear, places: Array, mesh: Array, sampling_rate: float) -> Motion:
    """That of places (instants, n) at their own instants."""
    rates = _rates_of(places, sampling_rate)
    rubs = model.rig.friction.coefficient != 0.0
    return Motion(places @ mesh, rates @ mesh, model.turned_on(places), rates if rubs else rates[:, :0])


def placed(size: int, outputs: Array) -> Array:
    """Places (samples, n) of all coordinates."""
    out = columns(outputs)
    return np.stack([getattr(out, name) for name in NAMES[:size]], axis=1)


def _rates_of(places: Array, sampling_rate: float) -> Array:
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

"""One channel of a record beside its simulations, as signals: what a figure of the gap shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import (
    UNITS,
    line_energy,
    measured_channels,
    noise_of_mean,
    simulated_channels,
)
from gearbench.diagnosis.replay.adjustable import Simulate
from gearbench.rig import Case

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Traces:
    """One channel of a record: `measured` (N,), the mean over its repetitions, and `simulated` (stage -> (N,)), in
    `unit`, sampled at `rate` [Hz]; `noise` (lines,) rms of the noise of the measured mean in each line, None if
    unknown; `mesh` [Hz]."""

    channel: str
    unit: str
    rate: float
    mesh: float
    measured: Array
    simulated: Mapping[str, Array]
    noise: Array | None


def traces_of(channel: str, judged: Measurement, stages: Mapping[str, Case], simulate: Simulate) -> Traces:
    """The traces of a channel of a measurement and of the rigs `stages`, by name."""
    repetitions = measured_channels(judged)[channel]
    noise = line_energy(noise_of_mean(repetitions)).sum(axis=0) ** 0.5 if len(repetitions) > 1 else None
    simulated = {
        stage: simulated_channels(judged, simulate(case, judged.record))[channel] for stage, case in stages.items()
    }
    rate, mesh = judged.sampling_rate, judged.mesh_frequency
    return Traces(channel, UNITS[channel], rate, mesh, repetitions.mean(axis=0), simulated, noise)

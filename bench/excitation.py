"""Torque on the driver: the mean plus one realisation of the multisine, on any grid of one period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.multisine import MultisineSignal, random_phase_multisine
from gearbench.rig import Experiment

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Torque:
    """Periodic driver torque [N m]: `mean` plus `signal` (none: constant)."""

    mean: float
    signal: MultisineSignal | None = None

    def sample(self, points: int) -> Array:
        """Exact values (points,) [N m] at equidistant instants of one excitation period, from its start."""
        if self.signal is None:
            return np.full(points, self.mean)
        return self.mean + self.signal.sample(points)


def torque_realisation(experiment: Experiment, number: int) -> Torque:
    """Torque of realisation `number` (0, 1, ...).

    Each realisation draws from its own stream, the `number`-th child of the experiment's seed: it does
    not depend on how many there are or in which order they are made.
    """
    wanted = experiment.multisine
    if wanted is None:
        return Torque(experiment.torque_mean)
    stream = np.random.default_rng(np.random.SeedSequence(experiment.seed, spawn_key=(number,)))
    signal = random_phase_multisine(
        experiment.samples_per_period,
        experiment.sampling_rate,
        wanted.band,
        amplitude=wanted.amplitude,
        rms=wanted.rms,
        grid=wanted.grid,
        crest=wanted.crest,
        rng=stream,
    )
    return Torque(experiment.torque_mean, signal)

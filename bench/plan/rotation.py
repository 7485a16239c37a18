"""Nominal rotation of a rig whose speed changes over the record: piecewise linear in speed, continuous in angle."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.rig import Experiment, Rig

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rotation:
    """Speed of the driver `speed` (n,) [rad/s] at instants `time` (n,) [s] that rise from 0, the first sample of the
    record: linear between them, constant before the first and after the last. `teeth`: of the driver.

    Cycles are of the mesh, 0 at time 0; where time is an array (m,), so is the answer.
    """

    time: Array
    speed: Array
    teeth: int

    @property
    def angle(self) -> Array:
        """Rotation of the driver (n,) [rad] at the instants `time`."""
        steps = np.diff(self.time) * (self.speed[1:] + self.speed[:-1]) / 2
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def highest(self) -> float:
        """Highest mesh frequency [Hz]."""
        return float(self.speed.max()) * self.teeth / (2 * pi)

    def frequency(self, time: Array) -> Array:
        """Mesh frequency [Hz]."""
        return np.asarray(np.interp(time, self.time, self.speed) * self.teeth / (2 * pi))

    def cycles(self, time: Array) -> Array:
        """Mesh phase [cycles]."""
        at = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 1)
        since = time - self.time[at]
        # Speeds at both ends of the stretch since the last instant make its mean one.
        mean = 0.5 * (self.speed[at] + np.interp(time, self.time, self.speed))
        return np.asarray((self.angle[at] + since * mean) * self.teeth / (2 * pi))

    def acceleration(self, time: Array) -> Array:
        """Angular acceleration of the driver [rad/s^2]; at an instant of the table that of the stretch before it."""
        slopes = np.concatenate([[0.0], np.diff(self.speed) / np.diff(self.time), [0.0]])
        return np.asarray(slopes[np.searchsorted(self.time, time, side="left")])


def rotation_of(experiment: Experiment, rig: Rig) -> Rotation | None:
    """The rotation of an experiment whose speed changes; None where it is constant.

    `speed_end` is reached at the last sample of the record.
    """
    teeth = rig.driver.teeth
    if experiment.speed_table is not None:
        time, speed = np.array(experiment.speed_table.time), np.array(experiment.speed_table.driver)
        if time[0] > 0.0:
            time, speed = np.concatenate([[0.0], time]), np.concatenate([speed[:1], speed])
        return Rotation(time, speed, teeth)
    if experiment.speed_end is None:
        return None
    begin = 2 * pi * experiment.mesh_frequency_for(teeth) / teeth
    last = (experiment.periods * experiment.samples_per_period - 1) / experiment.sampling_rate
    return Rotation(np.array([0.0, last]), np.array([begin, experiment.speed_end]), teeth)

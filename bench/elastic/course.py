"""What the reduced and the full model share on their way through time: excitation, samples, what ends a course."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.plan.excitation import Torque
from gearbench.bench.protocol import Drive

Array = NDArray[np.float64]


def drive_of(torque: Torque, samples_per_period: int, substeps: int) -> Drive:
    """One period of the driver torque, of which entry k of `fine` is that at the end of step k."""
    period = torque.sample(torque.samples_of(samples_per_period) * substeps)
    return Drive(period[::substeps].copy(), np.roll(period, -1))


def torque_of(drive: Drive, first: int, steps: int) -> Array:
    """Driver torque [N m] (steps,) at the ends of the steps from `first` on."""
    # Not by `take` with mode "wrap", which comes down to an index by one period after the other.
    return np.asarray(drive.fine[np.arange(first, first + steps) % drive.fine.size])


def check_course(t: float, lost: str, outputs: Array) -> None:
    """Raises BenchError where an integration has ended early at `t` [s]: without contact forces (`lost` is then the
    sentence for it, else empty), or without end."""
    if lost:
        raise BenchError(lost)
    if not np.isfinite(outputs).all():
        raise BenchError(f"the integration diverged before t = {t:.6g} s")


def begun_with(here: Array, outputs: Array) -> Array:
    """Outputs (samples, n) at the starts of steps, from `here` (n,) and those at their ends."""
    return np.vstack([here[None], outputs[:-1]])

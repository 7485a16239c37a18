"""What the mean transmission error says of a late angle: a shaft turns on while its sensor lags.

An angle that is recorded tau late is behind by Omega tau all the time, so that the mean transmission error moves by
v tau, v = Omega r_b the speed of the base circle, tens of micrometres where lines hardly tell a delay from what a
shaft, a filter or a support does to their phases. Where the angles' zero is unloaded contact, a delay that the mean
does not show is none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.sensor_delay import KEYS
from gearbench.diagnosis.fitting.fit import Optimum
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]

ANGLES = tuple(key for channel, key in KEYS.items() if channel.startswith("angle"))
# Of the mean by which a delay moves the transmission error, what a record must show: true delays of drawn rigs show
# 0.8 to 1.02 of it, delays that take the place of something else 0.1 at most.
SHOWN = 0.5
# Of the mean deflection under the load, what a rig's stiffness leaves unknown of it.
UNKNOWN = 0.1


def told_by_means(simulator: Simulator, one: Hypothesis, optimum: Optimum) -> float:
    """What the mean transmission error says for the lag of an angle as it is in the `optimum` [nats]: -inf where the
    records show less than half of what it does to their means. Nothing of other effects, nor where no record's zero is
    known.

    Means may be off otherwise, a zero or a load, in all records alike: they count as one number with Cauchy's
    distribution.
    """
    at = [wide.entries(simulator.layout.unknowns) for wide in one.wide if wide.key in ANGLES]
    known = [measured for measured in simulator.target.measurements if measured.zero_known]
    if not at or not known:
        return 0.0
    prompt = optimum.p.copy()
    prompt[np.concatenate(at)] = 0.0
    late, without = (_means(simulator, p, known) for p in (optimum.p, prompt))
    mean, moved = _measured(known), late - without
    if (mean - without) @ moved < SHOWN * moved @ moved:
        return -np.inf
    # Without displacements the supports' deflection is in it, too; a lag of the other angle may leave none.
    unknown = UNKNOWN * np.maximum(np.abs(without), simulator.layout.model.deflection)
    costs = [np.log1p(((mean - there) / unknown) ** 2).mean() for there in (without, late)]
    return float(costs[0] - costs[1])


def _means(simulator: Simulator, p: Array, known: Sequence[Measurement]) -> Array:
    """Mean transmission error [m] of the rig `p` (size,) in every record."""
    return np.array([simulator.channels(p, measured)["dte"].mean() for measured in known])


def _measured(known: Sequence[Measurement]) -> Array:
    return np.array([measured_channels(measured)["dte"].mean() for measured in known])

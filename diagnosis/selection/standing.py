"""What the mean transmission error says of a late angle: a shaft turns on while its sensor lags.

An angle that is recorded tau late is behind by Omega tau all the time, so that the mean transmission error moves by
v tau, v = Omega r_b the speed of the base circle, tens of micrometres where lines hardly tell a delay from what a
shaft, a filter or a support does to their phases. Where the angles' zero is unloaded contact, a delay that the mean
does not show is none.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.sensor_delay import KEYS
from gearbench.diagnosis.fitting.fit import Optimum
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]

ANGLES = tuple(key for channel, key in KEYS.items() if channel.startswith("angle"))
# Of the mean by which a delay moves the transmission error, what a record must show: true delays of drawn rigs show
# 0.8 to 1.02 of it, delays that take the place of something else 0.1 at most.
SHOWN = 0.5


def is_refuted(simulator: Simulator, one: Hypothesis, optimum: Optimum) -> bool:
    """Whether the mean transmission error of the records shows less than half of what the lag of an angle, as it is in
    the `optimum`, does to it. Never of other effects, nor where no record's zero is known."""
    at = [wide.entries(simulator.layout.unknowns) for wide in one.wide if wide.key in ANGLES]
    if not at:
        return False
    prompt = optimum.p.copy()
    prompt[np.concatenate(at)] = 0.0
    shown = moved = 0.0
    for measured in simulator.target.measurements:
        if not measured.zero_known:
            continue
        with_lag, without = (float(simulator.channels(p, measured)["dte"].mean()) for p in (optimum.p, prompt))
        gap = float(measured_channels(measured)["dte"].mean()) - without
        shown += gap * (with_lag - without)
        moved += (with_lag - without) ** 2
    return shown < SHOWN * moved

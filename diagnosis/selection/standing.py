"""What the mean transmission error says of a late angle: a shaft turns on while its sensor lags.

An angle that is recorded tau late is behind by Omega tau all the time, so that the mean transmission error moves by
v tau, v = Omega r_b the speed of the base circle, tens of micrometres where lines hardly tell a delay from what a
shaft, a filter or a support does to their phases. Where the angles' zero is unloaded contact, a delay that the mean
does not show is none, and one that it does is where a fit begins.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.sensor_delay import KEYS
from gearbench.diagnosis.fitting.fit import Optimum, fit_afresh
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.simulation.jacobian import FOLLOWED
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

ANGLES = tuple(key for channel, key in KEYS.items() if channel.startswith("angle"))
# Of the mean by which a delay moves the transmission error, what a record must show: true delays of drawn rigs show
# 0.8 to 1.02 of it, delays that take the place of something else 0.1 at most.
SHOWN = 0.5
# Of the mean deflection under the load, what is unknown of it where no fit has asked for it.
UNKNOWN = 0.1
# Nats that the means must say for a lag to be tried, and its largest standard deviation; over that of a sound rig's,
# what two of its angles differ by at most: in 95 % of rigs no more than twice its root of two.
CALLS, FARTHEST, SOUND = 2.0, 4.0, 2.0 * sqrt(2.0)
# Renewals of the Jacobian around a lag that is held, and of the fit in which it is free.
RENEWALS_HELD, RENEWALS = 4, 1
TINY = 1e-30  # [m^2]: less no lag moves a mean by


def denied_by_means(simulator: Simulator, one: Hypothesis, optimum: Optimum) -> bool:
    """Whether the records show less than half of what the lag of an angle, as it is in the `optimum`, does to their
    means. What these are worth is among the lines of a fit (`simulation.target`). Nothing denies other effects, nor a
    lag where no record's zero is known."""
    at, known = _lags(simulator, one), _known(simulator)
    if not at.size or not known:
        return False
    without = _means(simulator, _prompt(optimum.p, at), known)
    moved = _means(simulator, optimum.p, known) - without
    return bool((_measured(known) - without) @ moved < SHOWN * moved @ moved)


def called_for(simulator: Simulator, base: Optimum, one: Hypothesis) -> Array | None:
    """Unknowns (size,) of the rig `base` with the lag of an angle that the means call for; None where they call for
    none, for one that sound rigs have or that no chain of sensors has, and of the driven angle none that would be
    early."""
    at, known = _lags(simulator, one), _known(simulator)
    if not at.size or not known:
        return None
    begin, wide = _prompt(base.p, at), one.widened(simulator.layout.unknowns, base.sd)[at]
    try:
        without = _means(simulator, begin, known)
        begin[at] = wide
        moved = _means(simulator, begin, known) - without
    except ValueError:  # so late no rig answers
        return None
    mean = _measured(known)
    part = float((mean - without) @ moved) / max(float(moved @ moved), TINY)
    begin[at] = part * wide
    early = part < 0.0 and any(one.key == FOLLOWED for one in one.wide)
    sound = bool((np.abs(begin[at]) < SOUND * base.sd[at]).all())
    if early or sound or abs(part) > FARTHEST or _said(simulator, mean, without, without + part * moved) < CALLS:
        return None
    return begin


def begun_late(simulator: Simulator, base: Optimum, one: Hypothesis, begin: Array) -> Optimum | None:
    """The optimum of a late angle beside `base`, begun with the lag of `begin` (size,), which was `called_for`.

    Numbers around it have moved to where the angle was prompt, and a fit in which it is free goes back there: the lag
    is held until they have followed.
    """
    sd = one.widened(simulator.layout.unknowns, base.sd)
    held = sd.copy()
    held[_lags(simulator, one)] = 0.0
    around = fit_afresh(simulator, begin, held, renewals=RENEWALS_HELD)
    return fit_afresh(simulator, around.p, sd, renewals=RENEWALS) if around else None


def _said(simulator: Simulator, mean: Array, without: Array, late: Array) -> float:
    """Nats by which the means of the records speak for those of a rig with a lag against those without."""
    # Without displacements the supports' deflection is in it, too; a lag of the other angle may leave none.
    unknown = UNKNOWN * np.maximum(np.abs(without), simulator.layout.model.deflection)
    costs = [np.log1p(((mean - there) / unknown) ** 2).mean() for there in (without, late)]
    return float(costs[0] - costs[1])


def _lags(simulator: Simulator, one: Hypothesis) -> Integers:
    """Numbers of the hypothesis' unknowns that are lags of angles."""
    at = [wide.entries(simulator.layout.unknowns) for wide in one.wide if wide.key in ANGLES]
    return np.concatenate([np.empty(0, dtype=np.int64), *at])


def _prompt(p: Array, at: Integers) -> Array:
    """`p` (size,) without these lags."""
    out = p.copy()
    out[at] = 0.0
    return out


def _known(simulator: Simulator) -> list[Measurement]:
    """The records whose zeros are known."""
    return list(simulator.target.meant)


def _means(simulator: Simulator, p: Array, known: Sequence[Measurement]) -> Array:
    """Mean transmission error [m] of the rig `p` (size,) in every record."""
    return np.array([simulator.channels(p, measured)["dte"].mean() for measured in known])


def _measured(known: Sequence[Measurement]) -> Array:
    return np.array([measured_channels(measured)["dte"].mean() for measured in known])

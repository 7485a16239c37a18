"""Which effects of a truth rig show at all: how far the held-out record changes when one is taken out of the rig.

What a diagnosis makes of that change can only be less: nuisances take up a part. A backlash whose back flanks never
touch leaves no trace, and nobody can owe it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.plan.schedule import schedule
from gearbench.challenge.truth.measure import attributes_of, noisy
from gearbench.challenge.truth.rigs import Bench, conditions_of
from gearbench.records import make_record
from gearbench.records.transmission_error import AngleOnlyWarning, dte_of_channels
from gearbench.rig import Condition

Array = NDArray[np.float64]

HELD_OUT = "held-out"

# How a truth rig's record of one condition is made on a bench.
Recorder = Callable[[Bench, Condition], xr.Dataset]
TINY = 1e-12  # in a channel's unit: of sensors without noise


def traces_of(bench: Bench, whole: Recorder, without: Mapping[str, Recorder]) -> dict[str, float]:
    """For each effect the rms change of the held-out record (the last one, if none has that name) between that of the
    `whole` rig and those `without` it, over the noise of the mean over the record's periods: the largest of
    transmission error and channels, the driver's torque among them, which replays are given."""
    if not without:
        return {}
    conditions = conditions_of(bench.nominal)
    condition = next((one for one in conditions if one.name == HELD_OUT), conditions[-1])
    rig = bench.nominal.rig
    sensors = rig.sensors.model_copy(update={"noise_angle": 0.0, "noise_displacement": 0.0, "noise_torque": 0.0})
    silent = bench.nominal.model_copy(update={"rig": rig.model_copy(update={"sensors": sensors})})
    quiet = replace(bench, nominal=silent)

    def seen(record: xr.Dataset) -> dict[str, Array]:
        return _mean_period(record, condition.experiment.periods)

    record = whole(quiet, condition)
    here, noise = seen(record), seen(_noise(bench, condition, record, np.random.default_rng(0)))
    out = {}
    for effect, fewer in without.items():
        rest = seen(fewer(quiet, condition))
        out[effect] = max(float((rest[name] - here[name]).std() / max(noise[name].std(), TINY)) for name in here)
    return out


def _noise(bench: Bench, condition: Condition, record: xr.Dataset, rng: np.random.Generator) -> xr.Dataset:
    """A record of the sensors' noise alone, with the channels of another."""
    plan = schedule(condition.experiment, bench.nominal.rig)
    still = {str(name): np.zeros(channel.size) for name, channel in record.data_vars.items()}
    return make_record(noisy(still, bench.nominal.rig.sensors, rng), attributes_of(bench, condition, plan, ""))


def _mean_period(record: xr.Dataset, periods: int) -> dict[str, Array]:
    """Channels and transmission error (N,), the mean over periods."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AngleOnlyWarning)
        channels = {**record.data_vars, "dte": dte_of_channels(record)}
    return {str(name): one.values[0].reshape(periods, -1).mean(axis=0) for name, one in channels.items()}

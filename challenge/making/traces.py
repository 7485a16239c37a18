"""Which effects of a truth rig show at all: how far the held-out record changes when one is taken out of the rig.

What a diagnosis makes of that change can only be less: nuisances take up a part. A backlash whose back flanks never
touch leaves no trace, and nobody can owe it.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.plan.schedule import schedule
from gearbench.challenge.truth.levels import Levels
from gearbench.challenge.truth.measure import attributes_of, measure, noisy
from gearbench.challenge.truth.rigs import Bench, conditions_of
from gearbench.challenge.truth.structure import Structure
from gearbench.records import make_record
from gearbench.records.transmission_error import AngleOnlyWarning, dte_of_channels
from gearbench.rig import Condition

Array = NDArray[np.float64]

HELD_OUT = "held-out"


def traces_of(bench: Bench, structure: Structure, levels: Levels, without: Mapping[str, Levels]) -> dict[str, float]:
    """For each effect the rms change of the transmission error on the held-out record (the last one, if none has that
    name) between the levels and those `without` it, over the noise of the mean over the record's periods."""
    if not without:
        return {}
    conditions = conditions_of(bench.nominal)
    condition = next((one for one in conditions if one.name == HELD_OUT), conditions[-1])
    rig = bench.nominal.rig
    sensors = rig.sensors.model_copy(update={"noise_angle": 0.0, "noise_displacement": 0.0, "noise_torque": 0.0})
    silent = bench.nominal.model_copy(update={"rig": rig.model_copy(update={"sensors": sensors})})
    quiet, rng = replace(bench, nominal=silent), np.random.default_rng(0)

    def error(record: xr.Dataset) -> Array:
        return _mean_period(record, condition.experiment.periods)

    records = {name: error(measure(quiet, structure, one, condition, "", rng)) for name, one in without.items()}
    here = measure(quiet, structure, levels, condition, "", rng)
    noise = max(float(error(_noise(bench, condition, here, rng)).std()), 1e-12)
    return {name: float((one - error(here)).std()) / noise for name, one in records.items()}


def _noise(bench: Bench, condition: Condition, record: xr.Dataset, rng: np.random.Generator) -> xr.Dataset:
    """A record of the sensors' noise alone, with the channels of another."""
    plan = schedule(condition.experiment, bench.nominal.rig)
    still = {str(name): np.zeros(channel.size) for name, channel in record.data_vars.items()}
    return make_record(noisy(still, bench.nominal.rig.sensors, rng), attributes_of(bench, condition, plan, ""))


def _mean_period(record: xr.Dataset, periods: int) -> Array:
    """Transmission error (N,) [m], the mean over periods."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AngleOnlyWarning)
        error = dte_of_channels(record).values[0]
    return np.asarray(error.reshape(periods, -1).mean(axis=0))

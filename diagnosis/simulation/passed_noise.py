"""What noise leaves of measured minus simulated channels: that of each channel, less what the replay makes of the noise
in what it is given.

A replay turns the driven gear as it was measured, so that the noise of that angle shakes the simulated gear: through
its inertia alone a reaction of J omega^2 times it, which at a few kHz is far above the noise of a torque sensor.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels, noise_of_mean, simulated_channels
from gearbench.diagnosis.replay.replays import Replay
from gearbench.rig import Case

Array = NDArray[np.float64]

GIVEN = ("torque_driver", "angle_driven")
# Part of what noise does that may have the same sign as for the opposite noise, rms over rms.
CURVED = 0.5
MOST = 4  # groups that repetitions are taken in: one replay less


def noise_left(case: Case, measured: Measurement, simulate: Replay) -> dict[str, Array]:
    """Channel -> (parts, N): independent parts of the noise of the mean measured minus the simulated channel, whose
    squares add up to its variance; none for a record of one repetition, and that of the channels alone where the case
    cannot be simulated."""
    groups = min(measured.repetitions, MOST)
    if groups < 2:
        return {}
    parts = {name: noise_of_mean(_grouped(values, groups)) for name, values in measured_channels(measured).items()}
    given = {
        name: noise_of_mean(_grouped(measured.periods[name], groups)) for name in GIVEN if name in measured.periods
    }
    try:
        passed = _passed(case, measured, given, simulate)
    except ValueError:
        return parts
    return {name: values - passed[name] if name in passed else values for name, values in parts.items()}


def _passed(case: Case, measured: Measurement, given: Mapping[str, Array], simulate: Replay) -> dict[str, Array]:
    """Channel -> (parts, N): what the simulated channels become for the noise in what is given. Raises ValueError
    where that is no answer to it, as where flanks part and any little thing leads to another motion: the same noise
    with the other sign must do the opposite."""

    def channels(record: xr.Dataset) -> dict[str, Array]:
        return simulated_channels(measured, simulate(case, record))

    def shaken(part: int, sign: float = 1.0) -> dict[str, Array]:
        noisy = channels(_shaken(measured.record, {name: sign * values[part] for name, values in given.items()}))
        return {name: noisy[name] - quiet[name] for name in quiet}

    quiet = channels(measured.record)
    count = len(next(iter(given.values())))
    rows = [shaken(part) for part in range(count - 1)]
    there, back = rows[0]["dte"], shaken(0, -1.0)["dte"]
    if float(np.mean((there + back) ** 2)) > CURVED**2 * float(np.mean((there - back) ** 2)):
        raise ValueError(f"{measured.name}: no linear answer to noise")
    found = {name: np.array([row[name] for row in rows]) for name in quiet}
    # Parts add up to nothing, as departures from a mean do.
    return {name: np.concatenate([values, -values.sum(axis=0, keepdims=True)]) for name, values in found.items()}


def _shaken(record: xr.Dataset, noise: Mapping[str, Array]) -> xr.Dataset:
    """The record with the same noise (N,) added to each repetition of channels."""
    changed = {}
    for name, values in noise.items():
        samples = record[name].sizes["time"]
        changed[name] = record[name] + np.tile(values, samples // values.size)
    return record.assign({name: values.assign_attrs(record[name].attrs) for name, values in changed.items()})


def _grouped(repetitions: Array, groups: int) -> Array:
    """Means (groups, N) of equally many repetitions (P, N); what does not fill a group is left out."""
    each = len(repetitions) // groups
    kept = repetitions[: groups * each].reshape(groups, each, -1)
    return np.asarray(kept.mean(axis=1), dtype=np.float64)

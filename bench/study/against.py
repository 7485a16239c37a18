"""A measured record as a study holds its members against it: its DTE as the mesh repeats it.

The gap of a member is the rms over the mesh period of the difference of both DTEs, each the mean over all mesh periods
and realisations without its own mean: what excitation and noise do averages out, what the mesh does every period stays.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

PHASES = 128
# Relative difference of mesh periods beyond which records were not run at the same speed.
SAME_SPEED = 0.01


class Reference(NamedTuple):
    """What is known of the measured record: `dte` [um] on PHASES uniform mesh phases, without its mean; `anchored`:
    whether its mesh phase is the geometry's; `period` [s]: its mesh period."""

    dte: tuple[float, ...]
    anchored: bool
    period: float


def reference_of(record: xr.Dataset) -> Reference:
    """The reference in a record. Raises BenchError for one whose speed changes or whose DTE does not vary."""
    period = float(record.attrs.get("mesh_period", 0.0))
    if not period > 0.0:
        raise BenchError("the measured record has no mesh_period: a gap is told of records at constant speed")
    values = _curve(record)
    if not np.ptp(values) > 0.0:
        raise BenchError("the DTE of the measured record does not vary over the mesh period: nothing to hold against")
    anchored = str(record.attrs.get("mesh_phase_origin", "geometry")) == "geometry"
    return Reference(tuple(float(f"{value:.9g}") for value in values), anchored, period)


def gap(record: xr.Dataset, reference: Reference) -> tuple[float, float]:
    """Gap [um] of a simulated record, and in percent of the rms of the measured DTE. Raises BenchError for a record at
    another speed."""
    period = float(record.attrs.get("mesh_period", 0.0))
    if not abs(period - reference.period) <= SAME_SPEED * reference.period:
        raise BenchError(
            f"gap: the measured record has a mesh period of {reference.period:.6g} s, this one {period:.6g} s: set"
            f" experiment.mesh_frequency_hz = {1 / reference.period:.6g}"
        )
    from gearbench.bench.results.compare import best_shift

    measured, simulated = np.array(reference.dte), _curve(record)
    if not reference.anchored:
        simulated = np.roll(simulated, round(best_shift(measured, simulated) * PHASES))
    apart = _rms(measured - simulated)
    return apart, 100 * apart / _rms(measured)


def _curve(record: xr.Dataset) -> Array:
    """DTE (PHASES,) [um] of a record over the mesh period, without its mean."""
    from gearbench.bench.results.measures import synchronous_mean

    values = 1e6 * synchronous_mean(record, points=PHASES)[1]
    return np.asarray(values - values.mean())


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))

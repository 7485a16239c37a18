"""Order spectrum of the transmission error: amplitudes over the driver's revolutions, whatever the speed did."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from gearbench.identification.spectra.joint import Floats, SpectraError
from gearbench.identification.spectra.records import mesh_period
from gearbench.identification.spectra.transmission_error import dte

# Departure of the mesh phase from constant speed [cycles] from which on the DTE is resampled over the phase.
WANDER = 1e-4
# Records are taken to hold whole mesh cycles that they miss by no more than this.
NEARLY = 0.01


def order_spectrum(records: Sequence[xr.Dataset]) -> xr.DataArray:
    """Amplitudes (order,) [m] of the mean DTE of all realisations, by order of the driver's shaft.

    Without the attribute `teeth_driver`, orders are those of the mesh (attribute `reference` says which). Where the
    mesh phase departs from constant speed, the DTE is resampled over it (cubic splines) before the transform; what the
    excitation causes shrinks with the number of realisations, and what turns with the gears stays. Raises SpectraError
    for records of different length and TransmissionError where the DTE is missing.
    """
    sizes = sorted({record.sizes["time"] for record in records})
    if len(sizes) != 1:
        raise SpectraError(f"records of {' and '.join(map(str, sizes)) or 'no'} samples have no common orders")
    count = sizes[0]
    total, number, cycles = np.zeros(count), 0, 0.0
    for record in records:
        for row, values in enumerate(dte(record).values):
            phase = _phase(record, row)
            cycles = _cycles(phase)
            total += _over_phase(values, phase, cycles)
            number += 1
    teeth = records[0].attrs.get("teeth_driver")
    amplitude = np.abs(np.fft.rfft(total / number)) / count
    amplitude[1:] *= 2.0
    order = np.arange(amplitude.size) / cycles * float(teeth or 1)
    return xr.DataArray(
        amplitude,
        {"order": ("order", order, {"units": "1"})},
        ("order",),
        attrs={"units": "m", "reference": "driver" if teeth else "mesh", "realisations": number},
    )


def _phase(record: xr.Dataset, row: int) -> Floats:
    if "mesh_phase" in record:
        return np.asarray(record["mesh_phase"].values[row], dtype=float)
    return np.arange(record.sizes["time"]) / (float(record.attrs["sampling_rate"]) * mesh_period(record))


def _cycles(phase: Floats) -> float:
    """Mesh cycles of a record, to the sample after its last one; whole where they are nearly."""
    cycles = float(phase[-1] - phase[0]) + float(phase[1] - phase[0])
    return float(round(cycles)) if abs(cycles - round(cycles)) < NEARLY and round(cycles) else cycles


def _over_phase(values: Floats, phase: Floats, cycles: float) -> Floats:
    """Values at equal steps of the phase; as they are where the speed is constant."""
    even = phase[0] + cycles * np.arange(phase.size) / phase.size
    if np.abs(phase - even).max() <= WANDER:
        return values
    if not (np.diff(phase) > 0).all():
        raise SpectraError("the mesh phase does not rise from sample to sample: orders need a rig that turns one way")
    return np.asarray(CubicSpline(phase, values)(even))

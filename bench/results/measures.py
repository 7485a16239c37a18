"""Single numbers out of results: what a summary opens with and a comparison lists."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from gearbench.identification.spectra.transmission_error import dte

Array = NDArray[np.float64]


def mesh_orders(values: ArrayLike, orders: int = 3) -> Array:
    """Amplitudes (orders,) of the mesh orders 1, 2, ... of values (n,) on the uniform phases 0, 1/n, ...

    Amplitude: half the peak-to-peak of that order's sine.
    """
    samples = np.asarray(values, dtype=float)
    if samples.size < 2 * orders + 1:
        raise ValueError(
            f"{samples.size} phases cannot resolve {orders} mesh orders; {2 * orders + 1} are needed"
        )
    return 2 * np.abs(np.fft.rfft(samples)[1 : orders + 1]) / samples.size


def synchronous_mean(record: xr.Dataset, channel: str = "dte", points: int = 256) -> tuple[Array, Array]:
    """Mean of a channel over mesh periods and realisations: phases (points,) [cycles], values (points,).

    A sample counts in the phase interval that it falls into; an interval without one is interpolated. Phase
    comes from the `mesh_phase` of the record, or from its `mesh_period` and time (origin arbitrary then). A DTE
    that the record does not hold is computed from its angles and displacements.
    """
    signal = (dte(record) if channel == "dte" else record[channel]).values
    if "mesh_phase" in record:
        phase = record["mesh_phase"].values % 1.0
    else:
        phase = np.broadcast_to(
            record["time"].values / float(record.attrs["mesh_period"]) % 1.0, signal.shape
        )
    index = np.floor(phase * points + 0.5).astype(np.int64) % points
    count = np.bincount(index.ravel(), minlength=points)
    total = np.bincount(index.ravel(), weights=signal.ravel(), minlength=points)
    grid = np.arange(points) / points
    filled = count > 0
    return grid, np.interp(grid, grid[filled], total[filled] / count[filled], period=1.0)


def mode_range(frf: xr.Dataset, mode: int = 0) -> tuple[float, float]:
    """Lowest and highest natural frequency [Hz] of a mode over the mesh cycle; NaN where none was found."""
    values = frf["natural_frequency"].values
    if mode >= len(values) or not np.isfinite(values[mode]).any():
        return float("nan"), float("nan")
    return float(np.nanmin(values[mode])), float(np.nanmax(values[mode]))


def median_in(
    frf: xr.Dataset, zones: Sequence[tuple[float, float]], inside: bool = True, mode: int = 0
) -> float:
    """Median natural frequency [Hz] of a mode at phases inside (or outside) the zones; NaN if none."""
    if mode >= frf.sizes.get("mode", 0):
        return float("nan")
    phase, values = frf["phase"].values, frf["natural_frequency"].values[mode]
    within = np.zeros(phase.shape, dtype=bool)
    for start, stop in zones:
        within |= (phase >= start) & (phase <= stop)
    chosen = values[within == inside]
    chosen = chosen[np.isfinite(chosen)]
    return float(np.median(chosen)) if chosen.size else float("nan")


def itf_difference(one: xr.Dataset, two: xr.Dataset, band: tuple[float, float] | None = None) -> float:
    """||G1 - G2|| / ||G2|| over phase and the frequencies (in `band` [Hz]) that both have.

    NaN without common frequencies.
    """
    first, second = np.round(one["frequency"].values, 9), np.round(two["frequency"].values, 9)
    common, i, j = np.intersect1d(first, second, return_indices=True)
    if band is not None:
        keep = (common >= band[0]) & (common <= band[1])
        i, j = i[keep], j[keep]
    if not i.size:
        return float("nan")
    phases = max(one.sizes["phase"], two.sizes["phase"])
    g1, g2 = (_at_phases(frf, rows, phases) for frf, rows in ((one, i), (two, j)))
    return float(np.linalg.norm(g1 - g2) / np.linalg.norm(g2))


def _at_phases(frf: xr.Dataset, rows: NDArray[np.int64], phases: int) -> NDArray[np.complex128]:
    """ITF (rows, phases) on `phases` uniform phases: the trigonometric interpolant over the phases it has."""
    itf = frf["itf_re"].values[rows] + 1j * frf["itf_im"].values[rows]
    count = itf.shape[1]
    if count == phases:
        return itf
    spectrum = np.fft.fft(itf, axis=1) / count
    order = np.fft.fftfreq(count, 1 / count)
    return spectrum @ np.exp(2j * np.pi * np.outer(order, np.arange(phases) / phases))

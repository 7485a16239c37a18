"""Pictures of what goes in and what comes out over time: stiffness, torque, transmission error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.figures.plotting import BLUE, GREEN, GREY, ORANGE, closed, figure, phase_axis, save, shade
from gearbench.geometry.pair.zones import Span
from gearbench.identification import dte

Array = NDArray[np.float64]

_MOST_POINTS = 20_000


def draw_stiffness(path: Path, static: xr.Dataset, zones: Sequence[Span], label: str) -> None:
    """Mesh stiffness over the mesh cycle, secant and tangent, for each static load."""
    phase = static["phase"].values
    unit = static["load"].attrs["units"]
    with figure(size=(8.0, 4.4)) as (drawing, axes):
        shade(axes, zones, label)
        colours = (BLUE, ORANGE, GREEN, GREY)
        for number, load in enumerate(static["load"].values):
            colour = colours[number % len(colours)]
            tangent = static["stiffness_tangent"].values[number]
            secant = static["stiffness_secant"].values[number]
            axes.plot(*closed(phase, tangent / 1e6), color=colour, label=f"tangent dF/d dte at {load:g} {unit}")
            if np.abs(secant - tangent).max() > 1e-6 * tangent.max():
                text = f"secant F/dte at {load:g} {unit}"
                axes.plot(*closed(phase, secant / 1e6), color=colour, ls="--", label=text)
        axes.set_ylim(bottom=0)
        phase_axis(axes)
        axes.set_ylabel("mesh stiffness k [N/um]")
        axes.set_title(f"Mesh stiffness over one mesh period, {static.attrs.get('model', '')} model")
        axes.legend(loc="lower right")
        save(drawing, path)


def draw_record(path: Path, record: xr.Dataset, realisation: int = 0) -> None:
    """Driver torque and DTE of one realisation against time, and a few milliseconds of both."""
    time, torque, error = (np.asarray(v) for v in _signals(record, realisation))
    samples = min(time.size, max(200, int(0.03 * float(record.attrs["sampling_rate"]))))
    step = max(1, time.size // _MOST_POINTS)
    count = record.sizes["realisation"]
    with figure(2, 2, (11.0, 5.6), sharex="col", sharey="row") as (drawing, axes):
        for row, (values, colour, label) in enumerate(
            ((torque, ORANGE, "driver torque [N m]"), (error * 1e6, BLUE, "DTE [um]"))
        ):
            axes[row, 0].plot(time[::step], values[::step], color=colour, lw=0.5)
            axes[row, 1].plot(1e3 * time[:samples], values[:samples], color=colour, lw=1.0)
            axes[row, 0].set_ylabel(label)
        axes[1, 0].set_xlabel("time [s]")
        axes[1, 1].set_xlabel("time [ms]")
        axes[0, 0].set_title(f"Record, realisation {realisation + 1} of {count}")
        axes[0, 1].set_title(f"Its first {1e3 * samples / float(record.attrs['sampling_rate']):.0f} ms")
        save(drawing, path)


def draw_spectra(path: Path, records: Mapping[str, xr.Dataset]) -> None:
    """Amplitudes of the DTE of the first realisation of records, line by line; the first mesh orders are marked."""
    with figure(size=(8.0, 4.2)) as (drawing, axes):
        least, most, last = np.inf, 0.0, 0.0
        for colour, (name, record) in zip((BLUE, ORANGE, GREEN), records.items(), strict=False):
            frequency, amplitude = dte_spectrum(record)
            axes.plot(frequency, amplitude, color=colour, lw=0.6, label=name, rasterized=True)
            least, most = min(least, float(np.median(amplitude))), max(most, float(amplitude.max()))
            last = max(last, float(frequency[-1]))
        period = float(next(iter(records.values())).attrs.get("mesh_period", 0.0))
        for order in range(1, 4) if period else ():
            axes.axvline(order / period, color=GREY, ls=":", lw=1.0, label="mesh orders 1-3" if order == 1 else None)
        axes.set_yscale("log")
        axes.set_ylim(bottom=max(0.1 * least, 1e-6 * most, 1e-12))
        axes.set(xlabel="frequency [Hz]", ylabel="amplitude of the DTE [um]", xlim=(0.0, last))
        axes.set_title("Spectrum of the DTE, first realisation")
        axes.legend(loc="upper right")
        save(drawing, path)


def dte_spectrum(record: xr.Dataset) -> tuple[Array, Array]:
    """Frequencies (n,) [Hz] and amplitudes (n,) [um] of the DTE of a record's first realisation, without its mean."""
    values = 1e6 * dte(record).values[0]
    amplitude = 2 * np.abs(np.fft.rfft(values - values.mean()))[1:] / values.size
    return np.arange(1, amplitude.size + 1) * float(record.attrs["sampling_rate"]) / values.size, amplitude


def _signals(record: xr.Dataset, realisation: int) -> tuple[Array, Array, Array]:
    row = record.isel(realisation=realisation)
    return record["time"].values, row["torque_driver"].values, row["dte"].values

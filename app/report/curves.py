"""Live figures of records and results over time, frequency and mesh phase."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.figures.plotting import BLUE, GREEN, GREY, ORANGE, SINGLE_ZONE, closed
from gearbench.figures.records.record import dte_spectrum
from gearbench.figures.responses.frf import NO_MODE, magnitude
from gearbench.identification import dte
from gearbench.report.live import MOST, Quantity, Sheet, axes, curve, live, live_map, log_axis, thinned

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.geometry.pair.zones import Span

Array = NDArray[np.float64]

COLOURS = {"identified": BLUE, "exact": ORANGE, "frozen": GREEN, "linearised": GREEN}
NAMES = {
    "identified": "identified",
    "exact": "exact",
    "frozen": "frozen (not the truth)",
    "linearised": "linearised model, frozen",
}
PALETTE = (BLUE, ORANGE, GREEN, GREY, "#7a3e9d", "#a01010")
PHASE = "mesh phase [cycles]"
ROWS, COLUMNS = 600, 128  # of a map: more is not seen
ORDERS = 12.0  # mesh orders that a spectrum shows at first


def over_time(name: str, record: xr.Dataset, still: str, realisation: int = 0) -> str:
    """DTE of one realisation of a record over time, to zoom."""
    rate = float(record.attrs["sampling_rate"])
    values = 1e6 * dte(record).values[realisation]
    index, shown = thinned(values)
    count = record.sizes["realisation"]
    words = f"DTE of realisation {realisation + 1} of {count}, {values.size / rate:g} s."
    if shown.size < values.size:
        stretch = -(-2 * values.size // MOST)
        words += f" {values.size} samples are drawn as the least and the largest of every {stretch}."
    traces = [curve(index / rate, shown, "DTE", BLUE, line={"width": 1})]
    layout = axes("time [s]", "DTE [um]", showlegend=False)
    return live(name, traces, layout, still, f"{words} Drag to zoom, double-click to go back.")


def spectrum(name: str, records: Mapping[str, xr.Dataset], still: str, band: float = 0.0) -> str:
    """Amplitude spectra of the DTE of the first realisation of records, over frequency; mesh orders are marked.

    band: frequency [Hz] that is shown at first, where it holds more than a dozen mesh orders.
    """
    traces, period, top, least = [], 0.0, 0.0, np.inf
    for number, (title, record) in enumerate(records.items()):
        frequency, amplitude = dte_spectrum(record)
        index, values = thinned(amplitude)
        shown = np.maximum(values, 1e-7 * amplitude.max())  # a logarithmic axis has no zero
        traces.append(curve(frequency[index], shown, title, PALETTE[number], line={"width": 1}))
        period = float(record.attrs.get("mesh_period", 0.0)) or period
        top, least = max(top, float(amplitude.max())), min(least, float(np.median(amplitude)))
    last = max(float(record.attrs["sampling_rate"]) / 2 for record in records.values())
    marks = [n / period for n in range(1, 4)] if period else []
    lines = [
        {"type": "line", "x0": f, "x1": f, "yref": "paper", "y0": 0, "y1": 1, "line": {"color": GREY, "dash": "dot"}}
        for f in marks
    ]
    upper = min(last, max(ORDERS / period, 1.1 * band)) if period else last
    y = log_axis(least, top) | {"range": [float(np.log10(max(0.1 * least, 1e-6 * top))), float(np.log10(2 * top))]}
    layout = axes(
        "frequency [Hz]", "amplitude of the DTE [um]", {"range": [0, upper]}, y, shapes=lines,
        showlegend=len(traces) > 1,
    )  # fmt: skip
    said = f"Spectrum of the DTE, line by line, of the first realisation; dotted: the first {len(marks)} mesh orders"
    rest = f". Shown up to {upper:.4g} Hz of {last:.4g}: zoom out for the rest." if upper < last else "."
    return live(name, traces, layout, still, said + rest)


def over_phase(
    name: str, curves: Sequence[tuple[str, Array, Array]], y_title: str, still: str, caption: str,
    *, zones: Sequence[Span] = (), zone_words: str = "", from_zero: bool = False,
    colours: Mapping[str, str] | None = None,
) -> str:  # fmt: skip
    """Periodic curves (name, phases, values) over the mesh phase; `zones` are shaded, gaps stay gaps.

    `colours` by name; of two of one colour the second is dashed."""
    given = COLOURS | dict(colours or {})
    seen: set[str] = set()
    traces, period = [], 1.0
    for number, (title, phase, values) in enumerate(curves):
        period = float(round(phase[-1] + phase[1])) if len(phase) > 1 else 1.0
        x, y = closed(phase, values, period)
        colour = given.get(title, PALETTE[number % len(PALETTE)])
        line = {"dash": "dash" if colour in seen else "solid"}
        traces.append(curve(x, y, NAMES.get(title, title), colour, line=line))
        seen.add(colour)
    words = caption + (f" Shaded: {zone_words}." if zones and zone_words else "")
    y_axis = {"rangemode": "tozero"} if from_zero else {}
    layout = axes(PHASE, y_title, {"range": [0, period]}, y_axis, shapes=_shaded(zones), showlegend=len(traces) > 1)
    return live(name, traces, layout, still, words)


def stiffness_curves(static: xr.Dataset, load: int = 0) -> list[tuple[str, Array, Array]]:
    """Tangent mesh stiffness [N/um] of a static result over the phase, and the secant one where it differs."""
    phase = static["phase"].values
    tangent, secant = (1e-6 * static[f"stiffness_{key}"].values[load] for key in ("tangent", "secant"))
    curves = [("tangent dF/d dte", phase, tangent)]
    apart = np.abs(secant - tangent).max() > 1e-6 * tangent.max()
    return [*curves, ("secant F/dte", phase, secant)] if apart else curves


def natural_frequencies(
    name: str, results: Mapping[str, xr.Dataset], still: str, zones: Sequence[Span] = (), zone_words: str = ""
) -> str:
    """Natural frequencies of every mode over the mesh phase."""
    traces, found = [], []
    gaps = False
    for number, (kind, frf) in enumerate(results.items()):
        for mode, values in enumerate(frf["natural_frequency"].values):
            x, y = closed(frf["phase"].values, values)
            colour = COLOURS.get(kind, PALETTE[number % len(PALETTE)])
            marks: dict[str, Any] = {"mode": "lines+markers", "marker": {"size": 4}} if kind == "identified" else {}
            marks |= {"hovertemplate": f"mode {mode + 1}: %{{y:.1f}} Hz at %{{x:.3f}}"}
            title = NAMES.get(kind, kind)
            traces.append(curve(x, y, title, colour, legendgroup=kind, showlegend=mode == 0, **marks))
            gaps |= kind == "identified" and mode == 0 and bool(np.isnan(values).any())
            if kind != "linearised":
                found.append(values[np.isfinite(values)])
    y_axis = _around(np.concatenate(found) if found else np.empty(0))
    layout = axes(PHASE, "natural frequency [Hz]", {"range": [0, 1]}, y_axis, shapes=_shaded(zones))
    words = "Natural frequencies over one mesh period; 0 is contact at the pitch point."
    words += f" Shaded: {zone_words}." if zones and zone_words else ""
    words += f" Where a curve breaks off: {NO_MODE}." if gaps else ""
    return live(name, traces, layout, still, words)


def _shaded(zones: Sequence[Span]) -> list[dict[str, Any]]:
    """Spans of the abscissa as coloured bands."""
    band = {"type": "rect", "yref": "paper", "y0": 0, "y1": 1, "fillcolor": SINGLE_ZONE, "layer": "below"}
    return [band | {"x0": start, "x1": stop, "line": {"width": 0}} for start, stop in zones]


def _around(values: Array) -> dict[str, Any]:
    if not values.size:
        return {}
    low, high = float(values.min()), float(values.max())
    margin = max(0.25 * (high - low), 0.02 * high)
    return {"range": [max(low - margin, 0.0), high + 1.6 * margin]}


def itf_map(name: str, results: Mapping[str, xr.Dataset], still: str, caption: str = "") -> str:
    """|ITF| over frequency and mesh phase, with a cursor; the results side by side as curves."""
    first = next(iter(results.values()))
    step = max(1, first.sizes["phase"] // COLUMNS)
    phase = first["phase"].values[::step]
    sheets = []
    for number, (kind, frf) in enumerate(results.items()):
        rows = slice(None, None, max(1, -(-frf.sizes["frequency"] // ROWS)))
        values = _at_phases(1e9 * magnitude(frf)[rows], frf["phase"].values, phase)
        colour = COLOURS.get(kind, PALETTE[number % len(PALETTE)])
        sheets.append(Sheet(NAMES.get(kind, kind), frf["frequency"].values[rows], values, colour))
    positive = np.concatenate([one.values[one.values > 0] for one in sheets])
    low, high = (float(one) for one in np.quantile(positive, (0.001, 0.9999)))
    words = (
        "Magnitude of the ITF over frequency and mesh phase. Move over the map or the sliders: below, the curve over"
        " frequency at that phase and the curve over phase at that frequency."
    )
    return live_map(
        name, (Quantity("mesh phase", "cycles"), Quantity("frequency", "Hz"), Quantity("|ITF|", "nm/N")), phase, sheets,
        still, f"{words} {caption}".strip(), start=_peak(sheets[0], phase), limits=(low, high),
    )  # fmt: skip


def _at_phases(values: Array, own: Array, wanted: Array) -> Array:
    """Columns of a map at the phases that are nearest to those wanted."""
    if own.size == wanted.size and np.allclose(own, wanted):
        return values
    apart = np.abs((own[None, :] - wanted[:, None] + 0.5) % 1.0 - 0.5)
    return values[:, apart.argmin(axis=1)]


def _peak(sheet: Sheet, phase: Array) -> tuple[float, float]:
    """Where the largest value of a map stands."""
    row, column = np.unravel_index(int(np.nanargmax(sheet.values)), sheet.values.shape)
    return float(phase[column]), float(sheet.y[row])

"""The page of a speed sweep: resonance curves up and down, orders over speed."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.figures.plotting import BLUE, GREY, ORANGE
from gearbench.figures.records.sweep import FLOOR, ROWS, SHOWN, plot_sweep, plot_waterfall
from gearbench.report.html import drawing, table, text
from gearbench.report.live import Quantity, Sheet, axes, curve, live, live_map, live_page
from gearbench.report.parts import files_table, lead, limits, mark, provenance, versions, warned

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.rig import Case

GAP = 0.06  # of the height, between two panels


def sweep_page(
    case: Case, result: xr.Dataset, summary: Mapping[str, Any], files: Mapping[str, tuple[str, str]]
) -> str:
    """The page as one HTML text. `summary`: as the command prints it; `files`: what each holds, and its SHA-256."""
    title = f"{case.name}: largest DTE {summary['dte_rms_um']:.3g} um rms at {summary['dte_rms_rpm']:.0f} rpm"
    body = [
        mark("sweep", case.name),
        text(title, "h1"),
        *lead(_answer(result, summary)),
        _panels(result),
        *warned(list(summary["warnings"])),
        text("Orders over speed", "h2"),
        _orders(result),
        text("Where it is largest", "h2"),
        table(("quantity", "value", "unit"), _numbers(summary), numbers=(1,)),
        text("How far to trust it", "h2"),
        text(
            f"Every speed begins where the one before ended; it has settled when the DTE changes by less than a"
            f" thousandth of its standard deviation from check to check. {_restless(result)} K_v of ISO 6336-1 is that"
            " of discs that turn freely, without supports and shafts."
        ),
        *limits(str(result.attrs["model"])),
        text("Files beside this page", "h2"),
        files_table(files),
        *provenance(versions(), case),
    ]
    return live_page(title, body)


def _answer(result: xr.Dataset, summary: Mapping[str, Any]) -> list[str]:
    rpm = result["speed"].values * 30 / pi
    two = summary["two_answers_rpm"]
    return [
        f"From {rpm[0]:.0f} to {rpm[-1]:.0f} rpm under {result.attrs['torque_mean']:g} N m the DTE is largest at"
        f" {summary['dte_rms_rpm']:.0f} rpm: {summary['dte_rms_um']:.4g} um rms about its mean.",
        f"The largest dynamic factor is {summary['dynamic_factor']:.3g} (ISO 6336-1 Method B:"
        f" {summary['iso_dynamic_factor']:.3g}, resonance at {summary['iso_resonance_rpm']:.0f} rpm); teeth are apart"
        f" for at most {100 * summary['contact_loss']:.3g} % of the time.",
        f"At {len(two)} of {len(rpm)} speeds, from {min(two):.0f} to {max(two):.0f} rpm, the way up and the way down"
        " differ by more than a tenth: the answer jumps."
        if two
        else "The way up and the way down agree: the answer does not jump.",
    ]


def _panels(result: xr.Dataset) -> str:
    """The rows of the picture, one above the other over one axis of speed."""
    rpm = result["speed"].values * 30 / pi
    traces: list[dict[str, Any]] = []
    height = (1 - GAP * (len(ROWS) - 1)) / len(ROWS)
    panels: dict[str, Any] = {}
    for number, (key, scale, label) in enumerate(ROWS):
        suffix = "" if number == 0 else str(number + 1)
        top = 1 - number * (height + GAP)
        panels[f"yaxis{suffix}"] = {"domain": [max(top - height, 0.0), top], "title": {"text": label}}
        for direction, colour, dash in (("up", BLUE, "solid"), ("down", ORANGE, "dash")):
            values = scale * result[key].sel(direction=direction).values
            more = {"line": {"dash": dash}, "mode": "lines+markers", "marker": {"size": 4}, "yaxis": f"y{suffix}"}
            shown = {"legendgroup": direction, "showlegend": number == 0}
            traces.append(curve(rpm, values, f"speed {direction}", colour, **more, **shown))
        if key == "dynamic_factor":
            name = "K_v, ISO 6336-1 Method B"
            traces.append(curve(rpm, result["iso_dynamic_factor"].values, name, GREY, yaxis=f"y{suffix}"))
    layout = axes("driver speed [1/min]", "")
    style = layout["yaxis"] | {"rangemode": "tozero"}
    layout |= {name: style | own for name, own in panels.items()}
    layout["xaxis"] |= {"anchor": f"y{len(ROWS)}"}
    still = drawing(partial(plot_sweep, result), "sweep")
    caption = "DTE, dynamic factor and contact loss over the driver's speed, upwards and downwards."
    return live("sweep-live", traces, layout, still, caption, 760)


def _orders(result: xr.Dataset) -> str:
    """Amplitude over mesh order and speed, with a cursor, upwards and downwards."""
    order = result["order"].values
    shown = (order > 0) & (order <= SHOWN)
    rpm = result["speed"].values * 30 / pi
    amplitudes = {d: 1e6 * result["dte_amplitude"].sel(direction=d).values[:, shown] for d in ("up", "down")}
    top = max(float(values.max()) for values in amplitudes.values())
    sheets = [
        Sheet(f"speed {direction}", rpm, np.maximum(amplitudes[direction], 0.1 * FLOOR * top), colour)
        for direction, colour in (("up", BLUE), ("down", ORANGE))
    ]
    quantities = Quantity("mesh order", ""), Quantity("driver speed", "1/min"), Quantity("DTE", "um")
    row, column = np.unravel_index(int(amplitudes["up"].argmax()), amplitudes["up"].shape)
    start = float(order[shown][column]), float(rpm[row])
    still = drawing(partial(plot_waterfall, result), "waterfall")
    caption = (
        "Amplitude of the DTE over mesh order and speed; below, one order over speed and one speed over the orders."
    )
    return live_map(
        "orders-live", quantities, order[shown], sheets, still, caption, start=start, limits=(FLOOR * top, top)
    )


def _numbers(summary: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    return [
        ("DTE, rms about its mean", f"{summary['dte_rms_um']:.5g}", "um"),
        ("at the driver speed", f"{summary['dte_rms_rpm']:.1f}", "1/min"),
        ("dynamic factor", f"{summary['dynamic_factor']:.4g}", "1"),
        ("K_v, ISO 6336-1 Method B", f"{summary['iso_dynamic_factor']:.4g}", "1"),
        ("resonance by ISO 6336-1", f"{summary['iso_resonance_rpm']:.1f}", "1/min"),
        ("teeth apart", f"{100 * summary['contact_loss']:.3g}", "% of the time"),
    ]


def _restless(result: xr.Dataset) -> str:
    settled = result["settled"].values
    restless = int((settled == 0).sum())
    return "All speeds have settled." if restless == 0 else f"{restless} of {settled.size} speeds have not settled."

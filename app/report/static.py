"""The page of a static analysis: transmission error over phase and load, stiffness by every method, root stress."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.figures.gears.static import draw_harris_map, plot_static
from gearbench.figures.gears.stiffness import COLOURS, draw_stiffness_table
from gearbench.figures.gears.stress import GEARS, plot_root_stress, tooth_history
from gearbench.figures.plotting import BLUE
from gearbench.report.curves import over_phase
from gearbench.report.html import drawing, items, table, text
from gearbench.report.live import Quantity, Sheet, axes, curve, live, live_map, live_page
from gearbench.report.parts import files_table, lead, limits, mark, provenance, versions, warned
from gearbench.words.te_source import te_source

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.results.stiffness_table import StiffnessTable
    from gearbench.rig import Case

MAP_FROM = 3  # loads from which on there is a map over the load
ROOT_ROWS = (
    ("largest tension over the mesh cycle [MPa]", "largest_mpa"),
    ("whole force at the outer point of single contact [MPa]", "outer_point_mpa"),
    ("ISO 6336-3 Method B, sigma_F0 [MPa]", "sigma_f0_mpa"),
)


def static_page(
    case: Case, result: xr.Dataset, summary: Mapping[str, Any], tables: Sequence[StiffnessTable],
    roots: Sequence[Mapping[str, Any]], files: Mapping[str, tuple[str, str]],
) -> str:  # fmt: skip
    """The page as one HTML text. `summary`: as the command prints it; `tables`: stiffness by every method under each
    load that carries; `roots`: root stress under each load; `files`: what each holds, and its SHA-256."""
    unit, rows = str(summary["unit"]), list(summary["loads"])
    main = max(rows, key=lambda row: float(row["load"]))
    title = f"{case.name}: {_swing(main, unit)}"
    body = [
        mark("static", case.name),
        text(title, "h1"),
        *lead(_answer(rows, unit, roots)),
        _curves(result),
        *warned(list(summary["warnings"])),
        *_harris(result),
        text("Every load", "h2"),
        _loads(rows, unit),
        *_stiffness(tables),
        *_roots(result, roots),
        text("How far to trust it", "h2"),
        text(
            "Hub centres are held and nothing moves: this is the limit of slow rotation. What finite elements reach"
            " against an outside program is printed by gearbench validate."
        ),
        text(te_source(str(result.attrs["model"]), case.simulation.mesh_stiffness)),
        *limits(str(result.attrs["model"])),
        text("Files beside this page", "h2"),
        files_table(files),
        *provenance(versions(), case),
    ]
    return live_page(title, body)


def _swing(row: Mapping[str, Any], unit: str) -> str:
    if unit == "um":
        return f"{row['torque_mean_nm']:.4g} N m at a DTE of {row['load']:g} um"
    return f"TE {row['te_peak_to_peak_um']:.3g} um peak to peak at {row['load']:g} N m"


def _answer(rows: Sequence[Mapping[str, Any]], unit: str, roots: Sequence[Mapping[str, Any]]) -> list[str]:
    main = max(rows, key=lambda row: float(row["load"]))
    said = [f"Under {main['torque_mean_nm']:.4g} N m the transmission error is {main['te_mean_um']:.4g} um in the mean"]
    said[0] += f" and {main['te_peak_to_peak_um']:.3g} um peak to peak."
    if len(rows) > 1 and unit != "um":
        least = min(rows, key=lambda row: float(row["te_peak_to_peak_um"]))
        least_swing = f"{least['te_peak_to_peak_um']:.3g} um"
        said[0] += f" Of {len(rows)} loads it is least under {least['load']:g} N m: {least_swing}."
    low, high = main["stiffness_least_n_per_um"], main["stiffness_most_n_per_um"]
    said.append(f"The tangent mesh stiffness runs from {low:.4g} to {high:.4g} N/um over the mesh period.")
    if roots:
        gears = max(roots, key=lambda one: float(one["torque_nm"]))["gears"]
        values = " and ".join(f"{gears[key]['largest_mpa']:.4g} MPa in the {name}" for key, name, *_ in GEARS)
        said.append(f"The largest tension in the tooth roots is {values}.")
    return said


def _curves(result: xr.Dataset) -> str:
    """TE over phase, a curve a load; the torque where DTEs were prescribed."""
    unit, loads, phase = result["load"].attrs["units"], result["load"].values, result["phase"].values
    held = unit == "m"
    values = result["torque"].values if held else 1e6 * result["transmission_error"].values
    curves = [
        (f"{1e6 * load:.4g} um" if held else f"{load:.4g} {unit}", phase, row)
        for load, row in zip(loads, values, strict=True)
    ]
    if not held and "transmission_error_unloaded" in result:
        curves.append(("without load", phase, 1e6 * result["transmission_error_unloaded"].values))
    what = "Torque that carries each DTE" if held else "Static transmission error"
    still = drawing(partial(plot_static, result), "te")
    return over_phase("te-live", curves, "driver torque [N m]" if held else "TE [um]", still, f"{what} over phase.")


def _harris(result: xr.Dataset) -> list[str]:
    """TE over phase and load, with a cursor (Harris map)."""
    loads = result["load"].values
    if len(loads) < MAP_FROM or result["load"].attrs["units"] == "m":
        return []
    order = np.argsort(loads)
    te = 1e6 * result["transmission_error"].values[order]
    phase = result["phase"].values
    step = max(1, len(phase) // 512)
    swing = te - te.mean(axis=1, keepdims=True)
    sheets = [Sheet("without its mean", loads[order], swing[:, ::step], BLUE)]
    quantities = Quantity("mesh phase", "cycles"), Quantity("driver torque", "N m"), Quantity("TE less its mean", "um")
    caption = "Harris map: transmission error less its mean under each load, over mesh phase and load."
    start = float(phase[len(phase) // 2]), float(loads[order][-1])
    still = drawing(partial(draw_harris_map, result), "harris")
    return [
        text("Transmission error over load", "h2"),
        live_map("harris-live", quantities, phase[::step], sheets, still, caption, start=start, logarithmic=False),
    ]


def _loads(rows: Sequence[Mapping[str, Any]], unit: str) -> str:
    keys = (
        "load", "torque_mean_nm", "te_mean_um", "te_peak_to_peak_um", "stiffness_least_n_per_um",
        "stiffness_most_n_per_um",
    )  # fmt: skip
    head = (
        f"load [{unit}]", "torque, mean [N m]", "TE, mean [um]", "TE, peak to peak [um]", "stiffness, least [N/um]",
        "most [N/um]",
    )  # fmt: skip
    return table(head, [[f"{row[key]:.5g}" for key in keys] for row in rows], numbers=range(len(keys)))


def _stiffness(tables: Sequence[StiffnessTable]) -> list[str]:
    """Stiffness by every method under the largest torque."""
    if not tables:
        return []
    shown = max(tables, key=lambda one: one.torque)
    curves = [(row.model, shown.phase, 1e-6 * row.curve) for row in shown.rows if row.curve is not None]
    rows = [(row.model, *(_micro(v) for v in (row.single, row.mean, row.least, row.most))) for row in shown.rows]
    still = drawing(partial(draw_stiffness_table, table=shown), "stiffness")
    words = f"Secant mesh stiffness at {shown.torque:.4g} N m by every method that gives a curve."
    colours = {name: COLOURS[name] for name, *_ in curves}
    return [
        text("Mesh stiffness, like with like", "h2"),
        over_phase("stiffness-live", curves, "stiffness [N/um]", still, words, from_zero=True, colours=colours),
        table(("method [N/um]", "one pair", "mean", "least", "most"), rows, numbers=(1, 2, 3, 4)),
        items(shown.notes),
    ]


def _micro(value: float | None) -> str:
    return "–" if value is None else f"{1e-6 * value:.1f}"


def _roots(result: xr.Dataset, roots: Sequence[Mapping[str, Any]]) -> list[str]:
    """Root stress of one tooth of each gear under the largest load, beside ISO."""
    if not roots:
        reason = str(result.attrs.get("root_stress_note", ""))
        return [text("Root stress", "h2"), text(f"Not given: {reason}.")] if reason else []
    data = max(roots, key=lambda one: float(one["torque_nm"]))
    load = int(np.argmax(result["torque"].values.mean(axis=1)))
    traces = []
    for key, name, colour, _ in GEARS:
        phase, stress = tooth_history(result, key, load)
        traces.append(curve(phase, 1e-6 * stress, f"{name}, finite elements", colour))
        if iso := data["gears"][key]["sigma_f0_mpa"]:
            ends = [float(phase[0]), float(phase[-1])]
            line = {"dash": "dash", "width": 1.2}
            traces.append(curve(ends, [iso, iso], f"{name}, sigma_F0", colour, line=line))
    iso_values = {key: one["sigma_f0_mpa"] for key, one in data["gears"].items() if one["sigma_f0_mpa"]}
    still = drawing(partial(plot_root_stress, result, iso=iso_values), "roots")
    layout = axes("mesh phase after the pitch point [cycles]", "tension in the root [MPa]")
    words = f"Largest tension in the working root of one tooth of each gear at {data['torque_nm']:.4g} N m."
    rows = [
        (words_, *("–" if (v := data["gears"][key][field]) is None else f"{v:.1f}" for key, *_ in GEARS))
        for words_, field in ROOT_ROWS
    ]
    return [
        text("Root stress", "h2"),
        live("roots-live", traces, layout, still, words),
        table(("", *(name for _, name, *_ in GEARS)), rows, numbers=(1, 2)),
        items(data["notes"]),
    ]

"""The numbers of a run's summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.bench.models import model_for
from gearbench.bench.results.measures import itf_difference, median_in, mesh_orders, mode_range

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.geometry.pair.zones import Span
    from gearbench.rig import Case


def run_numbers(
    case: Case,
    static: xr.Dataset,
    record: xr.Dataset,
    results: Mapping[str, xr.Dataset],
    modes: Mapping[str, xr.Dataset],
    zones: Sequence[Span],
) -> dict[str, Any]:
    """All numbers of a summary, for JSON.

    `results`: identified and, for lumped cases, exact and frozen; `modes`: natural frequencies from elsewhere.
    """
    te = 1e6 * static["transmission_error"].values[0]
    stiffness = static["stiffness_tangent"].values[0]
    dte = 1e6 * record["dte"].values
    identified = results["identified"]
    numbers: dict[str, Any] = {
        "case": case.name,
        "model": record.attrs.get("model", ""),
        "model_title": model_for(case)[1].title,
        "mesh_stiffness": case.simulation.mesh_stiffness,
        "te_peak_to_peak_um": float(te.max() - te.min()),
        "te_mesh_orders_um": [float(value) for value in mesh_orders(te)],
        "first_mode_hz": mode_range(identified),
        "first_mode_fewest_pairs_hz": median_in(identified, zones, inside=True),
        "first_mode_most_pairs_hz": median_in(identified, zones, inside=False),
        "first_mode_damping": first_mode_damping(identified),
        "torque_mean_nm": float(record.attrs["torque_mean"]),
        "dte_record_peak_to_peak_um": float(dte.max() - dte.min()),
        "stiffness_n_per_um": (float(stiffness.min()) / 1e6, float(stiffness.max()) / 1e6),
        "realisations": int(record.sizes["realisation"]),
        "mesh_frequency_hz": 1.0 / float(record.attrs["mesh_period"]),
        "sampling_rate_hz": float(record.attrs["sampling_rate"]),
        "duration_s": record.sizes["time"] / float(record.attrs["sampling_rate"]),
        "settling_residual": record.attrs.get("settling_residual"),
        "identification": {key: plain(value) for key, value in identified.attrs.items()},
        "record_warnings": record.attrs.get("warnings", ""),
    }
    for name, result in (*results.items(), *modes.items()):
        if name != "identified":
            numbers[f"first_mode_{name}_hz"] = mode_range(result)
    if "exact" in results:
        numbers["itf_error_against_exact"] = itf_difference(identified, results["exact"])
        numbers["frozen_against_exact"] = itf_difference(results["frozen"], results["exact"])
    numbers["support_corner_hz"] = support_corner(case)
    return numbers


def support_corner(case: Case) -> float | None:
    """Lowest corner frequency k/(2 pi c) [Hz] of the supports; None where they are not damped."""
    supports = (case.rig.support.driver, case.rig.support.driven)
    corners = [one.stiffness / (2 * pi * one.damping) for one in supports if one.stiffness and one.damping]
    return min(corners, default=None)


def first_mode_damping(frf: xr.Dataset) -> float:
    """Median damping ratio of the first mode over the mesh period; NaN where no mode was found."""
    values = frf["damping_ratio"].values
    return float(np.nanmedian(values[0])) if len(values) and np.isfinite(values[0]).any() else float("nan")


def plain(value: Any) -> Any:
    """An attribute of a dataset as a plain Python value."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return value

"""The summary of a run: first the answers, then an honest account of how far they go."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.rig import Case
    from gearbench.zones import Span


def run_numbers(
    case: Case,
    static: xr.Dataset,
    record: xr.Dataset,
    results: Mapping[str, xr.Dataset],
    zones: Sequence[Span],
) -> dict[str, Any]:
    """All numbers of a summary, for JSON. `results`: identified and, for lumped cases, exact and frozen."""
    from gearbench.bench.measures import itf_difference, median_in, mesh_orders, mode_range

    te = 1e6 * static["transmission_error"].values[0]
    stiffness = static["stiffness_tangent"].values[0]
    dte = 1e6 * record["dte"].values
    identified = results["identified"]
    numbers: dict[str, Any] = {
        "case": case.name,
        "model": record.attrs.get("model", ""),
        "te_peak_to_peak_um": float(te.max() - te.min()),
        "te_mesh_orders_um": [float(value) for value in mesh_orders(te)],
        "first_mode_hz": mode_range(identified),
        "first_mode_fewest_pairs_hz": median_in(identified, zones, inside=True),
        "first_mode_most_pairs_hz": median_in(identified, zones, inside=False),
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
    for name, result in results.items():
        if name != "identified":
            numbers[f"first_mode_{name}_hz"] = mode_range(result)
    if "exact" in results:
        numbers["itf_error_against_exact"] = itf_difference(identified, results["exact"])
        numbers["frozen_against_exact"] = itf_difference(results["frozen"], results["exact"])
    return numbers


def plain(value: Any) -> Any:
    """An attribute of a dataset as a plain Python value."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return value


def headline(numbers: Mapping[str, Any]) -> list[str]:
    """The first lines of a summary: peak-to-peak TE, mesh orders 1-3, range of the first mode."""
    orders = ", ".join(f"{value:.4g}" for value in numbers["te_mesh_orders_um"])
    low, high = numbers["first_mode_hz"]
    few, many = numbers["first_mode_fewest_pairs_hz"], numbers["first_mode_most_pairs_hz"]
    return [
        f"Peak-to-peak TE: {numbers['te_peak_to_peak_um']:.4g} um (static, {numbers['torque_mean_nm']:g} N m)",
        f"TE mesh orders 1-3: {orders} um",
        f"First mode: {low:.0f}-{high:.0f} Hz over the mesh cycle"
        f" (medians {few:.0f} Hz with fewest, {many:.0f} Hz with most tooth pairs in contact)",
    ]


def summary_text(numbers: Mapping[str, Any], pictures: Sequence[str]) -> str:
    """summary.md: answers first, then how far they go."""
    found = numbers["identification"]
    stiffness = numbers["stiffness_n_per_um"]
    lines = [
        *(f"{line}  " for line in headline(numbers)),
        "",
        f"# {numbers['case']}, {numbers['model']} model",
        "",
        "## How far the identification goes",
        "",
        f"* Local polynomial method: L = {found['harmonics']} branches a side, order R = {found['order']}, window"
        f" n = {found['window']} lines: {found['unknowns']} unknowns and {found['equations']} equations a window,"
        f" condition number {found['condition_number']:.3g}.",
        f"* Expected error of the ITF: {found['expected_error']:.1%}, of which truncation to L branches"
        f" {found['truncation_error']:.1%} and variance {found['variance_error']:.1%}.",
        *(f"* **{line}**" for line in str(found.get("warnings", "")).splitlines() if line),
        *_against_truth(numbers),
        "",
        "## What was done",
        "",
        f"* {numbers['realisations']} realisation(s) of {numbers['duration_s']:g} s at"
        f" {numbers['sampling_rate_hz']:g} Hz; mesh frequency {numbers['mesh_frequency_hz']:g} Hz.",
        f"* Mesh stiffness (tangent) {stiffness[0]:.4g}-{stiffness[1]:.4g} N/um over the mesh cycle.",
        f"* DTE of the record: {numbers['dte_record_peak_to_peak_um']:.4g} um peak to peak.",
        f"* Steady state: the DTE changes by {numbers['settling_residual']:.2g} of its standard deviation from"
        " period to period.",
        *(f"* {line}" for line in str(numbers["record_warnings"] or "").split("; ") if line),
        "",
        "## Pictures",
        "",
        *(f"![{name}]({name})" for name in pictures),
        "",
    ]
    return "\n".join(lines)


def _against_truth(numbers: Mapping[str, Any]) -> list[str]:
    """Lumped cases: the measured errors, and why the frozen response is no truth."""
    if "itf_error_against_exact" not in numbers:
        return ["* No exact response exists for this model: the error above is an estimate, not a measurement."]
    return [
        f"* Measured error against the exact ITF: {numbers['itf_error_against_exact']:.2%} (rms over phase and band).",
        f"* The frozen response differs from the exact one by {numbers['frozen_against_exact']:.2%}; it is shown for"
        " comparison and is not the truth.",
    ]

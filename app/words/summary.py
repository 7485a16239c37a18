"""The words of summary.md."""

from __future__ import annotations

from math import isfinite
from typing import Any

from gearbench.words.accuracy import honest_warning, trust
from gearbench.words.distortion import distortion_lines
from gearbench.words.te_source import te_source

AGREES = 0.75  # identified and linearised ranges further apart than this ratio are not the same mode


def headline(numbers: dict[str, Any]) -> list[str]:
    """The first lines of a summary: peak-to-peak TE, mesh orders 1-3, range of the first mode."""
    orders = ", ".join(f"{value:.4g}" for value in numbers["te_mesh_orders_um"])
    return [
        f"Peak-to-peak TE: {numbers['te_peak_to_peak_um']:.4g} um (static, {numbers['torque_mean_nm']:g} N m)",
        f"TE mesh orders 1-3: {orders} um",
        f"First mode: {first_mode(numbers)}",
    ]


def summary_text(numbers: dict[str, Any]) -> str:
    """summary.md: the answers first, then the account of how far they go."""
    parts = ["  \n".join(headline(numbers)), f"# {numbers['case']}", *_account(numbers), *_what(numbers)]
    if "distortion" in numbers:
        parts += ["## Noise and distortion", "\n".join(distortion_lines(numbers["distortion"]))]
    return "\n\n".join([*(part for part in parts if part), *_files(numbers)]) + "\n"


def first_mode(numbers: dict[str, Any]) -> str:
    """The first mode in words, to follow "First mode:"."""
    linearised = numbers.get("first_mode_linearised_hz", (float("nan"),) * 2)
    if not isfinite(numbers["first_mode_hz"][0]):
        model = f" (the linearised model has it at {_range(linearised)} Hz)" if isfinite(linearised[0]) else ""
        return f"none in the identified band{model}"
    expected = numbers.get("identification", {}).get("expected_error", 0.0)
    if expected >= 1.0:
        return f"not told by this record, whose response is expected to err by {expected:.0%}; more realisations help"
    low, high = numbers["first_mode_hz"]
    if high < AGREES * linearised[0] or AGREES * low > linearised[1]:
        return (
            f"none that the model confirms: the record has a hump at {_range((low, high))} Hz, the linearised model its"
            f" first mode at {_range(linearised)} Hz"
        )
    text = f"{_range(numbers['first_mode_hz'])} Hz over the mesh period"
    fewest, most = numbers["first_mode_fewest_pairs_hz"], numbers["first_mode_most_pairs_hz"]
    if isfinite(fewest) and isfinite(most):
        text += f" (medians {fewest:.0f} Hz where the fewest tooth pairs are in contact, {most:.0f} Hz elsewhere)"
    return text


def _range(limits: tuple[float, float]) -> str:
    return f"{limits[0]:.0f}-{limits[1]:.0f}"


def _what(numbers: dict[str, Any]) -> list[str]:
    return ["## What was done and found", *findings(numbers)]


def findings(numbers: dict[str, Any]) -> list[str]:
    """What was done and found, in plain paragraphs."""
    stiffness = numbers["stiffness_n_per_um"]
    lines = [
        f"The {numbers['model_title']} ran {numbers['realisations']} realisation(s) of {numbers['duration_s']:g} s at"
        f" {numbers['sampling_rate_hz']:g} Hz, {numbers['torque_mean_nm']:g} N m mean torque and"
        f" {numbers['mesh_frequency_hz']:g} Hz mesh frequency.",
        "TE is the static transmission error under the mean torque with the gear centres held; a mesh order is the"
        " amplitude of its sine. In the record, with multisine and supports, the DTE spans"
        f" {numbers['dte_record_peak_to_peak_um']:.4g} um. The tangent mesh stiffness runs from {stiffness[0]:.4g} to"
        f" {stiffness[1]:.4g} N/um over the mesh period.",
        *_law(numbers),
        te_source(str(numbers["model"]), str(numbers["mesh_stiffness"])),
    ]
    corner = numbers["support_corner_hz"]
    if corner is not None and corner < 0.1 * numbers["first_mode_hz"][0]:
        lines.append(
            f"The supports are over-damped: above k/(2 pi c) = {corner:.3g} Hz their dampers and not their springs"
            " carry the gears, which shows in the damping of the first mode."
        )
    for name, words in (
        ("exact", "the exact ITF"),
        ("frozen", "frozen coefficients (not the truth)"),
        ("linearised", "the finite-element model, linearised at each phase (frozen)"),
    ):
        if isfinite(numbers.get(f"first_mode_{name}_hz", (float("nan"),))[0]):
            lines.append(f"First-mode range from {words}: {_range(numbers[f'first_mode_{name}_hz'])} Hz.")
    if numbers["settling_residual"] is not None:
        lines.append(
            f"Steady state: from period to period the DTE changes by {numbers['settling_residual']:.2g} of its"
            " standard deviation."
        )
    return lines


def _law(numbers: dict[str, Any]) -> list[str]:
    """Whether the first mode follows the number of tooth pairs."""
    fewest, most = numbers["first_mode_fewest_pairs_hz"], numbers["first_mode_most_pairs_hz"]
    if not (isfinite(fewest) and isfinite(most)):
        return []
    law = "lower" if fewest < most else "NOT lower"
    return [
        f"The first mode is {law} where the fewest tooth pairs carry. Its damping ratio is about"
        f" {numbers['first_mode_damping']:.2g}."
    ]


def _account(numbers: dict[str, Any]) -> list[str]:
    bold = honest_warning(numbers)
    notes = [f"- **{line}**" if line == bold else f"- {line}" for line in warnings_of(numbers)]
    return ["## How far to trust the identified response", *trust(numbers), "\n".join(notes)]


def warnings_of(numbers: dict[str, Any]) -> list[str]:
    """What identification and record warn of, the most important first."""
    found = numbers["identification"]
    said = [honest_warning(numbers), *str(found.get("warnings", "")).splitlines()]
    return [line for line in (*said, *str(numbers["record_warnings"] or "").splitlines()) if line]


def _files(numbers: dict[str, Any]) -> list[str]:
    rows = [f"| `{name}` | {about} |" for name, about in numbers["files"].items() if not name.endswith(".png")]
    table = "\n".join(["| file | what it holds |", "|---|---|", *rows])
    pictures = [f"![{about}]({name})" for name, about in numbers["files"].items() if name.endswith(".png")]
    return ["## Files", table, "## Pictures", *pictures]

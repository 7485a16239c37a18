"""What `identify` and the summary of a run say about noise and distortion."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

_WORDS = {
    "signal": "response on the excited lines",
    "even": "even distortion",
    "odd": "odd distortion",
    "operating": "operating response",
}
# Beyond this part of the response a linear analysis describes another machine.
TELLING = 0.1


def distortion_numbers(split: xr.Dataset) -> dict[str, Any]:
    """The numbers of a split of signal, noise and distortion, for JSON: rms in um, shares of the response."""
    micro = {str(part): 1e6 * float(split["rms"].sel(part=part)) for part in split["part"].values}
    limits = {str(part): 1e6 * float(split["limit"].sel(part=part)) for part in split["part"].values}
    known = {part: limit if isfinite(limit) else None for part, limit in limits.items()}
    about = split.attrs
    return {
        "rms_um": micro,
        "limit_um": known,
        "noise_um": 1e6 * about["noise_rms"] if "noise_rms" in about else None,
        "share": about["share"],
        "odd_inside_um": 1e6 * about["odd_inside_rms"],
        "operating_scatter_um": 1e6 * about["operating_scatter_rms"] if "operating_scatter_rms" in about else None,
        "warnings": [line for line in str(about.get("warnings", "")).splitlines() if line],
    }


def distortion_lines(numbers: dict[str, Any]) -> list[str]:
    """A Markdown table for a person, and a sentence on what it means."""
    signal = numbers["rms_um"]["signal"]
    rows = [f"| {words} | {_row(numbers['rms_um'][part], signal)} | {_seen(numbers, part)} |"
            for part, words in _WORDS.items()]  # fmt: skip
    if numbers["noise_um"] is not None:
        rows.append(f"| noise of the mean over periods | {_row(numbers['noise_um'], signal)} | |")
    if numbers["operating_scatter_um"] is not None:
        scatter = _row(numbers["operating_scatter_um"], signal)
        rows.append(f"| operating lines, from realisation to realisation (even distortion) | {scatter} | |")
    if _seen(numbers, "odd") != "no":
        inside = _row(numbers["odd_inside_um"], signal)
        rows.append(f"| odd distortion on the excited lines, as of a cube | {inside} | |")
    table = ["| DTE on the lines of | rms [um] | of the response | above the noise |", "|---|---|---|---|", *rows]
    return [*table, "", _verdict(numbers)]


def _row(value: float, signal: float) -> str:
    return f"{value:.4g} | {value / signal:.2%}" if signal else f"{value:.4g} |"


def _seen(numbers: dict[str, Any], part: str) -> str:
    limit = numbers["limit_um"][part]
    if limit is None:
        return "not known: one period"
    return "yes" if numbers["rms_um"][part] > limit else "no"


def _verdict(numbers: dict[str, Any]) -> str:
    share = numbers["share"]
    if {_seen(numbers, "even"), _seen(numbers, "odd")} == {"no"}:
        return "No distortion stands out of the noise: the machine answered linearly."
    if share > TELLING:
        return (
            f"Distortion is {share:.0%} of the response: the identified response holds for this excitation only, and"
            " what the machine does, such as a loss of contact, is not in it."
        )
    return f"Distortion is {share:.2g} of the response."

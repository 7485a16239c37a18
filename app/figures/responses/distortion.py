"""Picture of what lies on which lines: response, operating response, even and odd distortion, noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from gearbench.figures.plotting import BLUE, GREEN, GREY, ORANGE, figure, log_ticks, save

_PURPLE = "#8a3f8f"
_STYLES = {
    "signal": ("excited lines: linear response", BLUE, 7.0),
    "operating": ("operating response", GREY, 7.0),
    "even": ("even distortion", ORANGE, 5.0),
    "odd": ("odd distortion", _PURPLE, 5.0),
}


def draw_distortion(path: Path, split: xr.Dataset) -> None:
    """Amplitude of each line by what made it (a split of `identification.distortion`), and the noise."""
    frequency, part = split["frequency"].values, split["line_part"].values
    size, noise = 1e9 * split["line_rms"].values, 1e9 * split["line_noise"].values
    order = [str(name) for name in split["part"].values]
    seen = size[part == order.index("signal")]
    floor = 1e-7 * float(seen.max())  # what rounding leaves of a line is not drawn
    with figure(size=(9.0, 5.0)) as (drawing, axes):
        for name, (label, colour, dot) in _STYLES.items():
            own = (part == order.index(name)) & (size > floor)
            rms = 1e9 * float(split["rms"].sel(part=name))
            if own.any():
                axes.scatter(frequency[own], size[own], s=dot, color=colour, lw=0, label=f"{label}, {_length(rms)} rms")
        known = np.isfinite(noise) & (noise > floor)
        if known.any():
            rms = 1e9 * float(split.attrs["noise_rms"])
            axes.plot(frequency[known], noise[known], color=GREEN, lw=0.8, label=f"noise, {_length(rms)} rms", zorder=0)
        axes.set_yscale("log")
        log_ticks(axes.yaxis, *axes.get_ylim())
        axes.set_xlim(0.0, frequency[-1])
        axes.set_xlabel("frequency [Hz]")
        axes.set_ylabel("DTE of a line, rms [nm]")
        axes.set_title(_title(split))
        # Below: lines lie everywhere, and none may be hidden.
        below = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.12), "ncols": 2, "frameon": False}
        axes.legend(**below, markerscale=2.0, fontsize=9)
        save(drawing, path)


def _length(nanometres: float) -> str:
    return f"{nanometres:.3g} nm" if nanometres < 1e3 else f"{nanometres / 1e3:.3g} um"


def _title(split: xr.Dataset) -> str:
    parts = split.sel(part=["even", "odd"])
    if bool((parts["rms"] <= parts["limit"]).all()):
        return "No distortion stands out of the noise"
    return f"Distortion is {float(split.attrs['share']):.2g} of the response"

"""The pictures of an identification, of `identify --pictures DIR` and of a run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from gearbench.figures.responses.distortion import draw_distortion
from gearbench.figures.responses.frf import draw_natural_frequencies
from gearbench.figures.responses.frf_quality import draw_branches, draw_orders, draw_quality, draw_uncertainty
from gearbench.identification.spectra.orders import order_spectrum


def draw_identified(
    folder: Path, frf: xr.Dataset, records: Sequence[xr.Dataset], distortion: xr.Dataset | None = None
) -> list[Path]:
    """Draw a frequency response and the records behind it into `folder`, which is made; the pictures."""
    folder.mkdir(exist_ok=True)
    drawn = []

    def path(name: str) -> Path:
        drawn.append(folder / f"{name}.png")
        return drawn[-1]

    draw_uncertainty(path("itf"), frf)
    draw_branches(path("htf"), frf)
    if frf.sizes["mode"]:
        draw_natural_frequencies(path("natural_frequency"), {"identified": frf}, (), "")
    if "coherence" in frf:
        draw_quality(path("quality"), frf)
    draw_record_orders(path("orders"), records)
    if distortion is not None:
        draw_distortion(path("distortion"), distortion)
    return drawn


def draw_record_orders(path: Path, records: Sequence[xr.Dataset]) -> None:
    """The order spectrum of records."""
    teeth = records[0].attrs.get("teeth_driver")
    draw_orders(path, order_spectrum(records), int(teeth) if teeth else None)

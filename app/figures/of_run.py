"""The pictures of a run, in the order of its summary: a new one costs a file beside this, a line here and a test."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from gearbench.figures.frf import draw_itf, draw_natural_frequencies
from gearbench.figures.record import draw_record, draw_spectra, draw_stiffness
from gearbench.figures.static import plot_static
from gearbench.geometry.pair.zones import Span


class RunResults(NamedTuple):
    """What there is to draw of a run.

    responses: frequency responses (`identified` and, for lumped cases, `exact` and `frozen`); modes: natural
    frequencies from elsewhere; zones: mesh phases with the fewest pairs in contact, and their label; warning: what a
    picture of the identified response must say.
    """

    static: xr.Dataset
    record: xr.Dataset
    responses: Mapping[str, xr.Dataset]
    modes: Mapping[str, xr.Dataset]
    zones: Sequence[Span]
    label: str
    warning: str


class RunFigure(NamedTuple):
    """A picture: the name of its file, a line for the summary, and how it is drawn."""

    name: str
    about: str
    draw: Callable[[RunResults, Path], None]


def _stiffness(run: RunResults, path: Path) -> None:
    draw_stiffness(path, run.static, run.zones, run.label)


def _transmission_error(run: RunResults, path: Path) -> None:
    plot_static(run.static, path, run.zones, run.label)


def _spectrum(run: RunResults, path: Path) -> None:
    draw_spectra(path, {"DTE": run.record})


def _record(run: RunResults, path: Path) -> None:
    draw_record(path, run.record)


def _itf(run: RunResults, path: Path) -> None:
    draw_itf(path, run.responses, run.warning)


def _natural_frequencies(run: RunResults, path: Path) -> None:
    draw_natural_frequencies(path, {**run.responses, **run.modes}, run.zones, run.label, run.warning)


FIGURES = (
    RunFigure("transmission_error.png", "static transmission error over the mesh period", _transmission_error),
    RunFigure("stiffness.png", "mesh stiffness over the mesh period", _stiffness),
    RunFigure("record.png", "torque and DTE against time", _record),
    RunFigure("spectrum.png", "spectrum of the DTE", _spectrum),
    RunFigure("itf.png", "magnitude of the ITF over frequency and mesh phase", _itf),
    RunFigure("natural_frequency.png", "natural frequency against mesh phase", _natural_frequencies),
)

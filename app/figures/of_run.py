"""The pictures of a run, in the order of its summary: a new one costs a file beside this, a line here and a test."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from gearbench.figures.gears.static import plot_static
from gearbench.figures.records.record import draw_record, draw_spectra, draw_stiffness
from gearbench.figures.responses.distortion import draw_distortion
from gearbench.figures.responses.frf import draw_itf, draw_natural_frequencies
from gearbench.figures.responses.frf_quality import draw_branches, draw_quality, draw_uncertainty
from gearbench.figures.responses.of_identified import draw_record_orders
from gearbench.geometry.pair.zones import Span


class RunResults(NamedTuple):
    """What there is to draw of a run.

    responses: frequency responses (`identified` and, for lumped cases, `exact` and `frozen`); modes: natural
    frequencies from elsewhere; zones: mesh phases with the fewest pairs in contact, and their label; warning: what a
    picture of the identified response must say; distortion: what `identification.distortion` finds, if it can.
    """

    static: xr.Dataset
    record: xr.Dataset
    responses: Mapping[str, xr.Dataset]
    modes: Mapping[str, xr.Dataset]
    zones: Sequence[Span]
    label: str
    warning: str
    distortion: xr.Dataset | None = None


class RunFigure(NamedTuple):
    """A picture: the name of its file, a line for the summary, how it is drawn, and of which runs."""

    name: str
    about: str
    draw: Callable[[RunResults, Path], None]
    fits: Callable[[RunResults], bool] = lambda run: True


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


def _uncertainty(run: RunResults, path: Path) -> None:
    draw_uncertainty(path, run.responses["identified"])


def _branches(run: RunResults, path: Path) -> None:
    draw_branches(path, run.responses["identified"])


def _quality(run: RunResults, path: Path) -> None:
    draw_quality(path, run.responses["identified"])


def _orders(run: RunResults, path: Path) -> None:
    draw_record_orders(path, [run.record])


def _distortion(run: RunResults, path: Path) -> None:
    assert run.distortion is not None
    draw_distortion(path, run.distortion)


FIGURES = (
    RunFigure("transmission_error.png", "static transmission error over the mesh period", _transmission_error),
    RunFigure("stiffness.png", "mesh stiffness over the mesh period", _stiffness),
    RunFigure("record.png", "torque and DTE against time", _record),
    RunFigure("spectrum.png", "spectrum of the DTE", _spectrum),
    RunFigure("itf.png", "magnitude of the ITF over frequency and mesh phase", _itf),
    RunFigure("natural_frequency.png", "natural frequency against mesh phase", _natural_frequencies),
    RunFigure("uncertainty.png", "the identified ITF beside its standard deviation", _uncertainty),
    RunFigure("htf.png", "strongest branches of the identified HTF, with bands", _branches),
    RunFigure("quality.png", "residual and variance against frequency", _quality),
    RunFigure("orders.png", "amplitudes of the DTE by shaft order", _orders),
    RunFigure(
        "distortion.png",
        "response, noise, even and odd distortion, line by line",
        _distortion,
        lambda run: run.distortion is not None,
    ),
)

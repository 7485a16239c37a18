"""The local polynomial method at a speed that varies: branches, order, window and the operating response chosen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.lpm.estimate import LpmResult, local_polynomial
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.lpm.moving import HIGHEST_ORDER, MovingRegression, most_harmonics, prepare_moving
from gearbench.identification.lpm.regression import Window
from gearbench.identification.lpm.selection import LADDER, ORDERS, WIDEST, Choice, choose_among
from gearbench.identification.spectra.course import Course
from gearbench.identification.spectra.joint import Spectra


def polynomials_at_varying_speed(
    spectra: Spectra,
    course: Course,
    lines: NDArray[np.int64],
    *,
    harmonics: int | None,
    order: int | None,
    half_width: int | None,
    progress: Callable[[float, str], None] | None = None,
) -> tuple[LpmResult, Window, bool]:
    """Branches on the output `lines` at the mean speed; what was chosen, and whether the operating response was left
    free. Raises LpmError for what the record does not support."""
    if order is not None and order > HIGHEST_ORDER:
        raise LpmError(f"order = {order} must be at most {HIGHEST_ORDER} at a speed that varies")
    ladder = [harmonics] if harmonics is not None else _ladder(spectra, lines, order, half_width)
    widest = half_width or max(int(WIDEST * (lines[-1] - lines[0])), HIGHEST_ORDER + 1)
    free = prepare_moving(
        spectra, course, harmonics=max(ladder), order=HIGHEST_ORDER if order is None else order, half_width=widest,
        operating=True,
    )  # fmt: skip
    while True:
        choice, regression = _chosen(spectra, lines, free, ladder, order, half_width)
        try:
            result = local_polynomial(spectra, lines, choice.window, regression=regression, progress=progress)
        except LpmError:
            # What is chosen on a part of the lines need not suffice on all of them.
            ladder = [one for one in ladder if one < choice.window.harmonics]
            if harmonics is not None or not ladder:
                raise
            continue
        return result, choice.window, regression.operating


def _chosen(
    spectra: Spectra,
    lines: NDArray[np.int64],
    free: MovingRegression,
    ladder: list[int],
    order: int | None,
    half_width: int | None,
) -> tuple[Choice, MovingRegression]:
    """The choice that promises the least error, the operating response left free or not. Raises LpmError."""
    found: list[tuple[Choice, MovingRegression]] = []
    refused = ""
    for operating in (False, True):
        regression = replace(free, operating=operating)
        try:
            orders = tuple(one for one in ORDERS if one <= HIGHEST_ORDER)
            choice = choose_among(spectra, lines, regression, ladder, True, order, half_width, orders)
        except LpmError as error:
            refused = refused or str(error)
            continue
        found.append((choice, regression))
    if not found:
        raise LpmError(refused)
    return min(found, key=lambda one: one[0].error)


def _ladder(
    spectra: Spectra, lines: NDArray[np.int64], order: int | None, half_width: int | None
) -> list[int]:
    """Numbers of branches that the widest windows can tell, whose sidebands stay inside the spectra and that memory
    holds."""
    band = int(lines[-1] - lines[0])
    wide = 2 * (half_width or WIDEST * band) + 1
    told = int(spectra.realisations * wide / (1 + (1 if order is None else order)) / 2)
    inside = (spectra.highest - int(lines[-1])) // spectra.mesh_lines
    held = most_harmonics(spectra, spectra.realisations, HIGHEST_ORDER, int(wide))
    return [value for value in LADDER if value <= min(told, inside, held)] or [0]

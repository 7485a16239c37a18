"""Windows of a regression: of the kind that it is of, at constant or at varying speed."""

from __future__ import annotations

from gearbench.identification.lpm.moving import MovingRegression, MovingRows
from gearbench.identification.lpm.regression import Regression, Window
from gearbench.identification.lpm.rows import Lines, WindowRows


def rows_around(regression: Regression, centres: Lines, window: Window) -> WindowRows:
    """The rows of the windows around the `centres` (B,)."""
    if isinstance(regression, MovingRegression):
        return MovingRows(regression, centres, window)
    return WindowRows(regression, centres, window)

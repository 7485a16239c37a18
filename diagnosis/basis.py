"""Smooth functions of frequency, from which row filters and free forms are made."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KNOTS = (0.0, 150.0, 350.0, 600.0, 900.0, 1250.0, 1650.0, 2100.0, 2550.0, 3000.0)  # [Hz]


def hats(frequency: Array) -> Array:
    """Piecewise linear basis (knots, K) on KNOTS; constant beyond the last."""
    return np.stack([np.interp(frequency, KNOTS, column) for column in np.eye(len(KNOTS))])

"""Smooth functions of frequency, from which row filters and free forms are made."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Where the pieces meet, as parts of the band: denser at low frequencies, where the supports resonate.
KNOTS = (0.0, 0.05, 0.12, 0.2, 0.3, 0.42, 0.55, 0.7, 0.85, 1.0)


def hats(frequency: Array, band: float) -> Array:
    """Piecewise linear basis (knots, K) over frequencies [Hz] of 0 .. `band`; constant beyond the last knot."""
    return np.stack([np.interp(frequency, band * np.array(KNOTS), column) for column in np.eye(len(KNOTS))])

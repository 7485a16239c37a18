"""Size of a signal that comes in stretches."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray


class Tally:
    """Least and largest value, mean and standard deviation of what has been added. Mutable: it counts.

    Deviations of stretches are brought together without loss of digits (Chan, Golub & LeVeque, Am. Stat. 37, 1983).
    """

    def __init__(self) -> None:
        self.count, self.mean, self.least, self.most = 0, 0.0, inf, -inf
        self._squares = 0.0

    @property
    def deviation(self) -> float:
        """Standard deviation."""
        return sqrt(self._squares / self.count) if self.count else 0.0

    def add(self, values: NDArray[np.float64]) -> None:
        """Add a stretch (n,)."""
        count, mean = len(values), float(values.mean())
        total, apart = self.count + count, mean - self.mean
        self._squares += float(((values - mean) ** 2).sum()) + apart**2 * self.count * count / total
        self.mean += apart * count / total
        self.count, self.least, self.most = total, min(self.least, values.min()), max(self.most, values.max())

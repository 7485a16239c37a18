"""What limits an identified response, told from the identification itself: noise, missing branches, or its windows.

The residual is noise and missing response (branches beyond L, what polynomials do not follow). Variance comes from the
whole of it and divides as it does; what biases the response beside that is missing response alone. Of this the
branches beyond L hold what the outermost known ones foretell, if powers go on falling like 1/l^2; polynomials that do
not follow have the rest. What a prior leaves open, for lack of equations, is put down to the windows. On five rigs the
branches beyond L truly held half to nine tenths of what is told here.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Literal

import numpy as np

from gearbench.identification.lpm.accuracy import Accuracy
from gearbench.identification.lpm.estimate import LpmResult

Limit = Literal["noise", "branches", "window", "channels"]

# Outermost orders that foretell those beyond.
OUTER = 3


@dataclass(frozen=True)
class Limits:
    """Parts of the expected error, relative rms: `noise` of the record, missing `branches`, polynomials that do not
    follow in their `window`, doubtful `channels`."""

    noise: float
    branches: float
    window: float
    channels: float

    @property
    def largest(self) -> Limit:
        """Which of them is the largest."""
        parts: dict[Limit, float] = {
            "channels": self.channels, "noise": self.noise, "branches": self.branches, "window": self.window,
        }  # fmt: skip
        return max(parts, key=lambda name: parts[name])


def limits_of(result: LpmResult, accuracy: Accuracy) -> Limits:
    """The expected error of a result in parts; their squares add to its square."""
    share = min(result.missing / result.residual_missing, 1.0) if result.residual_missing > 0 else 0.0
    left_open = (result.open_share or 0.0) * accuracy.variance**2
    spread = accuracy.variance**2 - left_open
    noise = (1.0 - share) * spread
    missing = share * spread + accuracy.truncation**2
    power = float(np.sum(np.abs(result.htf) ** 2) - result.htf_variance.sum())
    beyond = min(_beyond(result) / max(power, np.finfo(float).tiny), missing)
    return Limits(sqrt(noise), sqrt(beyond), sqrt(missing - beyond + left_open), accuracy.record)


def _beyond(result: LpmResult) -> float:
    """Power of the branches beyond L by the law c/l^2 of the outermost known ones: sum over l > L is c/(L + 1/2)."""
    known = result.harmonics
    power = np.sum(np.abs(result.htf) ** 2 - result.htf_variance, axis=1)
    order = np.abs(np.arange(-known, known + 1))
    outer = order > max(known - OUTER, 0)
    if not outer.any():
        return float("inf")  # branch 0 alone: all the variation is missing
    return max(2.0 * float(np.mean(power[outer] * order[outer] ** 2)) / (known + 0.5), 0.0)

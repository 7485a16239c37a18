"""What comes once per revolution, from its cosine and sine to size and phase."""

from __future__ import annotations

from cmath import phase, rect
from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Estimate

Array = NDArray[np.float64]
NOTHING = 1e-15


class Once(NamedTuple):
    """Size in the unit of what it was made of, angle at which it is largest [rad], and standard deviation of the
    size."""

    size: float
    angle: float
    std: float

    def estimates(self, name: str, scale: float, unit: str) -> tuple[Estimate, Estimate]:
        """Size, times `scale` in `unit`, and angle as an effect's parameters."""
        off = min(self.std / max(self.size, NOTHING), pi)
        return (
            Estimate(name, scale * self.size, scale * self.std, unit),
            Estimate(f"{name}_phase", self.angle * 180 / pi, off * 180 / pi, "deg", sized=False),
        )


def once_of(size: float, angle: float, more: Array, std: Array) -> Once:
    """Of what has a size and an angle [rad], with cosine and sine `more` (2,) added that are known to `std` (2,)."""
    total = rect(size, angle) + complex(more[0], more[1])
    return Once(abs(total), phase(total), float(np.sqrt((std**2).mean())))

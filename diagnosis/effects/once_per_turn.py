"""What comes once per revolution, from its cosine and sine to size and phase."""

from __future__ import annotations

from cmath import phase, rect
from math import cos, hypot, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import SIDES, Estimate

Array = NDArray[np.float64]
NOTHING = 1e-15
# Groups of the encoders' run-out, by gear.
ENCODERS = {side: f"encoder-{side}" for side in SIDES}


class Once(NamedTuple):
    """Size in the unit of what it was made of, angle at which it is largest [rad], and standard deviation of the
    size."""

    size: float
    angle: float
    std: float

    def beside(self, other: Array) -> Once:
        """The same, known no better than by the part of what else comes once per revolution, with cosine and sine
        `other` (2,) of the same fit, that lies in its direction: faint sidebands alone tell the two apart."""
        along = float(other[0]) * cos(self.angle) + float(other[1]) * sin(self.angle)
        return self._replace(std=hypot(self.std, along))

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

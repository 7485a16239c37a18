"""What records show of a rig before any of it is simulated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.fitting.hidden_motion import Motion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shown:
    """`around`: from unknowns (size,) that are held, the same with the rig around the mesh, None where nothing shows
    it; `hidden`: the motion of a housing that sensors stand on, if one is seen."""

    around: Callable[[Array], Array | None]
    hidden: Callable[[], Motion | None] = lambda: None

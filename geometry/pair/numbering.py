"""Two ways of counting a gear's teeth: a case counts them in order of meshing, a mesh as sectors by polar angle.

Teeth and sectors share number 0. The driver turns counter-clockwise, so its teeth are counted clockwise; those of the
driven gear, which turns clockwise, counter-clockwise, as sectors are.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", int, NDArray[np.int64])

# Sense in which the teeth of driver and driven gear are counted; 1: counter-clockwise.
SENSE = (-1, 1)


def sector_of(tooth: Number, gear: int, teeth: int) -> Number:
    """Number of a tooth's sector on the driver (`gear` 0) or the driven gear (1); and the tooth of a sector, for the
    count is its own inverse."""
    return SENSE[gear] * tooth % teeth

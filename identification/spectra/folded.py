"""Lines onto which the operating response comes back from beyond half the sampling rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Harmonics of the mesh whose operating response may fold back to be felt.
OPERATING = 100


def folded_harmonics(samples: int, mesh_lines: int) -> NDArray[np.int64]:
    """Lines of a record of so many `samples`, 0 where nothing can have folded, onto which mesh harmonics beyond half
    the sampling rate may have come back from the operating response. Where a mesh period is a whole number of samples
    these are mesh harmonics again."""
    harmonics = np.arange(1, OPERATING + 1) * mesh_lines
    harmonics = harmonics[2 * harmonics > samples]
    if samples == 0 or samples % mesh_lines == 0:
        return np.empty(0, dtype=np.int64)
    back = harmonics - samples * np.round(harmonics / samples).astype(np.int64)
    return np.concatenate([back, -back])

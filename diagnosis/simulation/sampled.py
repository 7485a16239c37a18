"""A sample of the lines of a large block, which stands for all of them.

Where numbers of teeth have no common factor a repetition has thousands of lines that neither excitation, mesh nor
shafts have, and derivatives of all these by all unknowns are what fills the memory. A block's cost knows their mean
square alone, and counts them as a few independent ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Lines that a block is told by at most: the strongest each by itself, as a tone is; of the others a sample, whose mean
# square is off by 5 %.
MOST, STRONGEST = 640, 160
SEED = 0


def sampled(energies: Array, most: int = MOST, strongest: int = STRONGEST) -> tuple[Integers, Array]:
    """Numbers (n,) of the lines, in their order, that stand for a block whose lines have these `energies` (K,), and the
    square root (n,) of how many lines each stands for."""
    if energies.size <= most:
        return np.arange(energies.size), np.ones(energies.size)
    alone = np.argsort(-energies, kind="stable")[:strongest]
    others = np.delete(np.arange(energies.size), alone)
    drawn = np.random.default_rng(SEED).choice(others, most - strongest, replace=False)
    kept = np.concatenate([alone, drawn])
    stands_for = np.repeat([1.0, others.size / drawn.size], [alone.size, drawn.size])
    order = np.argsort(kept)
    return kept[order], np.sqrt(stands_for[order])

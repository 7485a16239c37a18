"""What a mesh law says of every pair, read off its table by a compiled loop: along a motion it is asked at hundreds of
thousands of instants."""

from __future__ import annotations

from math import floor, sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import compiled
from gearbench.lumped.nonlinear.law import MeshLaw

Array = NDArray[np.float64]


def read_pairs(law: MeshLaw, delta: Array, phase: Array) -> tuple[Array, Array]:
    """Force [N] and tangent stiffness [N/m] of every pair (..., n_o) at deflections (..., n_o) [m] of its own and
    phases (...) [cycles]; none where its working flanks are apart."""
    shape = delta.shape
    force, tangent = np.empty(shape), np.empty(shape)
    rows = (-1, shape[-1])
    at = np.broadcast_to(phase, shape[:-1]).ravel()
    _read(law.pair_secants, law.approach, delta.reshape(rows), at, force.reshape(rows), tangent.reshape(rows))
    return force, tangent


def over_pairs(values: Array) -> Array:
    """Sums (...) over the pairs of values (..., n_o): numpy's own sum is slow along so short an axis."""
    return np.asarray(np.einsum("...o->...", values))


@compiled
def _read(secants: Array, approach: Array, delta: Array, phase: Array, force: Array, tangent: Array) -> None:
    """Fill force and tangent (n, n_o) from secants (phases + 1, n_d, n_o) at an `approach_grid` (n_d,)."""
    phases, last = secants.shape[0] - 1, len(approach) - 1
    before, end = approach[last - 1], approach[last]
    for k in range(len(phase)):
        position = (phase[k] - floor(phase[k])) * phases
        row = min(int(position), phases - 1)
        weight = position - row
        for o in range(delta.shape[1]):
            depth = delta[k, o]
            if not depth > 0.0:
                force[k, o], tangent[k, o] = 0.0, 0.0
                continue
            root = last * sqrt(depth / end)
            node = min(int(root), last - 1)
            low = secants[row, node, o] + weight * (secants[row + 1, node, o] - secants[row, node, o])
            high = secants[row, node + 1, o] + weight * (secants[row + 1, node + 1, o] - secants[row, node + 1, o])
            if root > last:
                slope = max((end * high - before * low) / (end - before), 0.0)
                force[k, o], tangent[k, o] = end * high + slope * (depth - end), slope
            else:
                rise = high - low
                stiffness = low + (root - node) * rise
                force[k, o], tangent[k, o] = depth * stiffness, max(stiffness + 0.5 * root * rise, 0.0)

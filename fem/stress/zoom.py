"""Finer elements for showing fields: quadratic triangles divided where the half-plane's field changes fast."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.stress.recovery import shapes

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MOST_ROUNDS = 12
# The four children of a triangle: corners and middles in the parent's reference coordinates.
_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
_CHILDREN = [_CORNERS[list(c)] for c in ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))]
_SPLIT = np.array([shapes(np.concatenate([c, 0.5 * (c + np.roll(c, -1, axis=0))])) for c in _CHILDREN])


def divided(triangles: Indices, values: Array, size: Callable[[Array], Array]) -> tuple[Indices, Array]:
    """Divide quadratic triangles (m, 6) into four until none is longer than `size` at its middle.

    values (n, k): nodal values, their first two columns the nodes' places [m]; all are interpolated quadratically, so
    curved edges stay curved. Returns triangles and values of their nodes. Neighbours of different
    size do not share the nodes between them: good for showing, not for solving.
    """
    kept, cells = [triangles[:0]], values[triangles]
    old = triangles
    added: list[Array] = []
    count = len(values)
    for _ in range(MOST_ROUNDS):
        corners = cells[:, :3, :2]
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        large = longest > size(corners.mean(axis=1))
        kept.append(old[~large])
        if not large.any():
            break
        cells = np.einsum("cab,mbk->mcak", _SPLIT, cells[large]).reshape(-1, 6, values.shape[1])
        # Children of the same parents share their nodes.
        flat = cells.reshape(-1, values.shape[1])
        _, first, inverse = np.unique(np.round(flat[:, :2] * 1e12), axis=0, return_index=True, return_inverse=True)
        added.append(flat[first])
        old = count + inverse.reshape(-1, 6)
        count += len(first)
    else:
        kept.append(old)
    found = np.concatenate(kept)
    used, renumbered = np.unique(found, return_inverse=True)
    return renumbered.reshape(-1, 6), np.concatenate([values, *added])[used]

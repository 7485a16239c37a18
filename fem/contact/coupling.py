"""How tooth pairs feel one another through both gear bodies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.kernel import Place, crack_between, cross_between, grid_position, place_at
from gearbench.fem.contact.law import Law, Meetings
from gearbench.kernels.compiled import INNER, compiled

Array = NDArray[np.float64]
Places = NDArray[np.void]  # of PLACE

# Where a pair touches on the kernels' grids of driver and driven gear: the fields of a `Place` for each.
PLACE = np.dtype(
    [(f"{name}{gear}", np.int64 if name == "node" else np.float64) for gear in (1, 2) for name in Place._fields]
)


@compiled(forceinline=True, **INNER)
def find_places(law: Law, pairs: Meetings, n: int, places: Places) -> None:
    """Write where the first n pairs touch into `places` (n or more,)."""
    for p in range(n):
        one = place_at(grid_position(law.k1, pairs[p].s1))
        two = place_at(grid_position(law.k2, pairs[p].s2))
        at = places[p]
        at.node1, at.w01, at.w11, at.w21, at.w31 = one.node, one.w0, one.w1, one.w2, one.w3
        at.node2, at.w02, at.w12, at.w22, at.w32 = two.node, two.w0, two.w1, two.w2, two.w3


@compiled(forceinline=True, **INNER)
def on_driver(places: Places, p: int) -> Place:
    """Where pair p touches on the driver."""
    at = places[p]
    return Place(at.node1, at.w01, at.w11, at.w21, at.w31)


@compiled(forceinline=True, **INNER)
def on_driven(places: Places, p: int) -> Place:
    """Where pair p touches on the driven gear."""
    at = places[p]
    return Place(at.node2, at.w02, at.w12, at.w22, at.w32)


@compiled(forceinline=True, **INNER)
def couple(law: Law, pairs: Meetings, n: int, places: Places, q: int, out: Array) -> None:
    """Write the approach at the first n pairs per force on pair q [m/N] into column q of `out`; of the pair itself,
    besides its own curve, only what a crack adds, what all pairs share and what it has more towards the ends of its
    path, or towards one."""
    # Counter-clockwise: the driver's numbers run clockwise; back pairs join driven tooth number + 1.
    loaded, loaded1, loaded2 = pairs[q].side, -pairs[q].tooth, pairs[q].tooth + pairs[q].side
    push1, push2 = on_driver(places, q), on_driven(places, q)
    for p in range(n):
        at, tooth1, tooth2 = pairs[p].side, -pairs[p].tooth, pairs[p].tooth + pairs[p].side
        value = law.shared if at == loaded else -law.shared
        if p == q:
            place = min(max((pairs[q].xi1 - law.middle) / law.half, -1.0), 1.0)
            value += law.ends * (place * place - 1.0 / 3.0) + law.tilt * place
        else:
            value += cross_between(law.k1, loaded, push1, at, on_driver(places, p), tooth1 - loaded1)
            value += cross_between(law.k2, loaded, push2, at, on_driven(places, p), tooth2 - loaded2)
        # A push from behind closes the crack, and the tooth is sound.
        if law.k1.cracked >= 0 and loaded == 0 and at == 0:
            value += crack_between(law.k1, loaded, loaded1, push1, at, tooth1, on_driver(places, p))
        if law.k2.cracked >= 0 and loaded == 0 and at == 0:
            value += crack_between(law.k2, loaded, loaded2, push2, at, tooth2, on_driven(places, p))
        out[p, q] = value


@compiled
def coupling(law: Law, pairs: Meetings) -> Array:
    """Approach (n, n) at pair p per force on pair q [m/N], as `couple` writes it."""
    n = len(pairs)
    places = np.zeros(n, PLACE)
    find_places(law, pairs, n, places)
    out = np.empty((n, n))
    for q in range(n):
        couple(law, pairs, n, places, q, out)
    return out

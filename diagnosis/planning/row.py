"""What a plan tells of one effect at one place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

# Names of what is added to a plan, and of what several channels are left out by.
LONGER, BOTH = "four times the periods", "both displacements"


@dataclass(frozen=True)
class Cost:
    """What a plan without something (or with more) finds: smallest size over that of the plan (None: it finds none),
    and standard deviation over that of the plan."""

    size: float | None
    std: float


@dataclass(frozen=True)
class Row:
    """An effect at a place.

    `parameter` tells its size, in `unit`: the smallest that is `found` (None: none up to the `largest` looked for), its
    standard deviation `std` by the records alone, what a `good` rig has, the size `apart` from which no other effect
    explains the records as well (None: none), and the smallest that the `best` of plans would find. `over_good` and
    `over_best`: how many times those two the smallest size is, counted from the nominal rig. `rivals` at that size;
    `costs` by what is left out, or added.
    """

    effect: str
    name: str
    place: str
    on: tuple[str, ...]
    parameter: str
    unit: str
    found: float | None
    std: float
    good: float
    largest: float
    apart: float | None
    best: float | None
    over_good: float | None = None
    over_best: float | None = None
    rivals: tuple[str, ...] = ()
    costs: Mapping[str, Cost] = field(default_factory=dict)

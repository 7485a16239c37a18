"""How many tooth pairs the geometry has in contact at which mesh phase."""

from __future__ import annotations

from itertools import pairwise
from math import ceil, floor
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gearbench.geometry import Pair

Span = tuple[float, float]


def contact_span(meshing: Pair) -> Span:
    """Mesh phases [cycles] at which tooth pair 0 comes into contact and leaves it; 0 is the pitch point."""
    start, stop = meshing.active_driver
    return (start - meshing.rho_pitch[0]) / meshing.base_pitch, (stop - meshing.rho_pitch[0]) / meshing.base_pitch


def pairs_in_contact(span: Span, phase: float) -> int:
    """Number of tooth pairs in contact at a mesh phase; `span` as from `contact_span`."""
    return floor(phase - span[0]) - ceil(phase - span[1]) + 1


def fewest_pairs(span: Span) -> list[Span]:
    """Spans of [0, 1] with the fewest tooth pairs in contact: one for contact ratios of 1 to 2."""
    marks = sorted({0.0, 1.0, span[0] % 1.0, span[1] % 1.0})
    pieces = [(a, b) for a, b in pairwise(marks) if b > a]
    counts = [pairs_in_contact(span, (a + b) / 2) for a, b in pieces]
    if min(counts) == max(counts):
        return []
    return [piece for piece, count in zip(pieces, counts, strict=True) if count == min(counts)]


def zone_label(span: Span) -> str:
    """What the spans of `fewest_pairs` are, in words."""
    count = floor(span[1] - span[0])
    return f"{count} tooth pair{'s' if count > 1 else ''} in contact (geometry)"

"""Where a pair of ideal gears passes from the line of action to a tip edge."""

from __future__ import annotations

from collections.abc import Callable

from gearbench.fem.contact.kinematics import ON_LINE, pair_contact, teeth_of
from gearbench.geometry import Pair

Place = Callable[[float, float], tuple[float, float]]  # of the driven centre from the driver's, at both rotations


def last_on_line(meshing: Pair, place: Place, low: float, high: float) -> tuple[float, float]:
    """Rotations [rad] of driver and driven gear, between phases [cycles] of the latter on the line of action and on a
    tip edge, where the pair that is at the pitch point at phase 0 passes from one to the other as the driver touches
    it."""
    one, two = teeth_of(meshing)
    turn = 0.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        turn = middle * one.pitch
        for _ in range(8):
            k = pair_contact(one, two, 0, 0, turn, middle * two.pitch, *place(turn, middle * two.pitch))
            turn += k.gap / one.rb
        low, high = (middle, high) if k.slave == ON_LINE else (low, middle)
    return turn, low * two.pitch

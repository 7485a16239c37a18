"""Where flanks touch that depart from their involutes, and what they stand proud by there.

Flanks roll as circles of the radii rho1 and rho2 do: x beside the point where the involutes would touch they are apart
by x^2/(2 rho), 1/rho = 1/rho1 + 1/rho2 (Litvin and Fuentes 2004, ch. 8: relative curvature). An excess that grows along
the flank moves the contact to where both together close the mesh most; where an involute has ended, its edge touches:

    e = max over x of [e1(rho1'(x)) + e2(rho2'(-x)) - x^2/(2 rho)] - max over x of [-x^2/(2 rho)],

x on both flanks and rho'^2 = rho^2 + 2 rb x, as x is the length of an involute's arc. A linear relief of slope p gains
p^2 rho / 2: 1 um where 25 um are taken off a tip of module 3 mm within 1.3 mm, and nothing to speak of on good flanks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.pair.kinematics import Pair
from gearbench.geometry.tooth.micro import profile_excess
from gearbench.rig import Gear

Array = NDArray[np.float64]

PLACES = 400  # along the line of action, between which the excess is taken for straight
# Slope x/rho of the farthest place beside the involutes' contact that is tried, and number of places on either side.
STEEPEST, TRIALS = 0.2, 48
NEAREST = 0.05  # least of a roll length over the base pitch: near a base circle an involute is a point


class Touching(NamedTuple):
    """Where a pair of flanks touches: roll lengths [m] (places,) of the driver at which involutes without end would,
    the `excess` [m] there, and the roll lengths of `driver` and `driven` gear at which these flanks do."""

    involute: Array
    excess: Array
    driver: Array
    driven: Array


def touching(meshing: Pair, gears: tuple[Gear, Gear]) -> Touching:
    """That of flanks of driver and driven gear, all teeth alike, along the line of action."""
    least = NEAREST * meshing.base_pitch
    one = np.linspace(least, meshing.line_of_action - least, PLACES)
    two = meshing.line_of_action - one
    curvature = 1.0 / one + 1.0 / two
    # Closer to each other where flanks that slope little touch.
    side = np.linspace(-1.0, 1.0, 2 * TRIALS + 1)[:, None]
    slope = STEEPEST * side * np.abs(side)
    way, apart = slope / curvature, 0.5 * slope**2 / curvature
    excess, places = np.zeros_like(apart), []
    for shape, gear, at, turn in ((meshing.driver, gears[0], one, 1.0), (meshing.driven, gears[1], two, -1.0)):
        moved = np.sqrt(np.maximum(at**2 + 2.0 * turn * shape.base_radius * way, 0.0))
        places.append(np.clip(moved, shape.rho_form, shape.rho_end))
        excess += profile_excess(shape, gear, 0, places[-1])
        apart = np.where((moved < shape.rho_form) | (moved > shape.rho_end), np.inf, apart)
    ends = np.isfinite(apart).any(axis=0)
    closed = (excess - apart)[:, ends]
    here = (closed.argmax(axis=0), np.flatnonzero(ends))
    found = closed.max(axis=0) + apart[:, ends].min(axis=0)
    return Touching(one[ends], found, places[0][here], places[1][here])


def touching_excess(meshing: Pair, gears: tuple[Gear, Gear], rho: Array) -> Array:
    """Excess [m] of a pair of flanks of driver and driven gear, all teeth alike, that would touch at the driver's roll
    lengths `rho` (...) [m] were they involutes without end."""
    found = touching(meshing, gears)
    return np.interp(rho, found.involute, found.excess)

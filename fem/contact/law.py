"""The contact law of a gear pair: approach of every tooth pair against its force, coupled through both gear bodies."""

from __future__ import annotations

from math import ceil, floor, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.curve import Curve, Curves, edge_reach, tabulate
from gearbench.fem.contact.deviation import Flanks, about_axes, centres_of, deviate, flanks_of, ideal_flanks
from gearbench.fem.contact.kernel import Kernel, make_kernel
from gearbench.fem.contact.kinematics import (
    EDGE1,
    EDGE2,
    Contact,
    Facing,
    Tooth,
    facing,
    seen_contact,
    teeth_of,
    turned_over,
)
from gearbench.fem.gear.body import CondensedGear
from gearbench.fem.gear.elasticity import plane_moduli
from gearbench.fem.limits import EDGE_SEPARATION, LOAD_RANGE, elastic_pair
from gearbench.geometry.pair.kinematics import Pair
from gearbench.geometry.tooth.iso1328 import drawn_gear
from gearbench.geometry.tooth.micro import check_micro
from gearbench.kernels.compiled import INNER, compiled
from gearbench.rig import Gear, Material, sound_gear

__all__ = ["EDGE_SEPARATION", "LOAD_RANGE", "PAIRS", "Curve", "Law", "elastic_pair", "make_law"]

Array = NDArray[np.float64]
Meetings = NDArray[np.void]  # of MEETING

PAIRS = 8  # tooth pairs, both flank sides together, that may touch at once
# A tooth pair near contact: flank side (0 working, 1 back), driver tooth, and its `Contact`.
MEETING = np.dtype(
    [("side", np.int64), ("tooth", np.int64)]
    + [(name, np.int64 if name == "slave" else np.float64) for name in Contact._fields]
)
ROUNDED = 1e-9  # bound of the rounding of gaps [m]
NEAR = 0.25  # of the base pitch: how far beyond the path of contact tooth pairs are looked at


class Law(NamedTuple):
    """Contact law: both teeth, both kernels, centre distance [m], working pressure angle, 2/(pi E* b) [m/N], the
    load-approach curves, how far, in roll length, the tip edges of driver and driven gear reach [m], their flanks'
    excess material, and how much that moves a gap at most [m] (0: ideal flanks)."""

    driver: Tooth
    driven: Tooth
    k1: Kernel
    k2: Kernel
    centre: float
    alpha: float
    half_plane: float
    curves: Curves
    reach1: float
    reach2: float
    flanks1: Flanks
    flanks2: Flanks
    play: float
    shared: float  # compliance [m/N] that all pairs share beside the gears' own
    ends: float  # c [m/N] of what each pair yields more, c (x^2 - 1/3), by its place x on the path, -1 to 1
    tilt: float  # the same of c x
    middle: float  # roll length [m] of the driver in the middle of the path of contact
    half: float  # half of that path's length [m]


def make_law(
    meshing: Pair,
    driver: CondensedGear,
    driven: CondensedGear,
    material: Material,
    curves: tuple[Curve, Curve] | None = None,
    gears: tuple[Gear, Gear] | None = None,
) -> Law:
    """The contact law of an `elastic_pair` of condensed gears; the lines are solved here unless `curves` are given.

    `gears` bring their micro-geometry and errors; without them the flanks are ideal.
    """
    t1, t2 = teeth_of(meshing)
    moduli = plane_moduli(material)
    half_plane = 4.0 / (pi * moduli.modulus * min(driver.face_width, driven.face_width))
    a = meshing.centre_distance
    approach_max = EDGE_SEPARATION * meshing.driver.module
    # The driver's teeth are numbered clockwise, against its rotation.
    k1, k2 = make_kernel(driver, -1), make_kernel(driven)
    reach1, reach2 = (edge_reach(t1, t2, a, approach_max), edge_reach(t2, t1, a, approach_max))
    if curves is None:
        curves = (tabulate(t1, t2, k1, k2, half_plane, a, reach1), tabulate(t2, t1, k2, k1, half_plane, a, reach2))
    f1, f2 = _deviations(meshing, gears, reach1, reach2)
    every = Curves(*curves, t1.rho_end, t2.rho_end)
    alpha, play = meshing.working_pressure_angle, f1.largest + f2.largest
    start, stop = meshing.active_driver
    path = (0.5 * (start + stop), 0.5 * (stop - start))
    return Law(t1, t2, k1, k2, a, alpha, half_plane, every, reach1, reach2, f1, f2, play, 0.0, 0.0, 0.0, *path)


def _deviations(meshing: Pair, gears: tuple[Gear, Gear] | None, reach1: float, reach2: float) -> tuple[Flanks, Flanks]:
    """Excess material of the flanks of driver and driven gear. Raises GeometryError."""
    if gears is None or all(gear.model_copy(update={"crack": None}) == sound_gear(gear) for gear in gears):
        return ideal_flanks(meshing.driver.teeth), ideal_flanks(meshing.driven.teeth)
    line = meshing.line_of_action
    found = []
    sides = (("rig.driver", meshing.driver, reach1), ("rig.driven", meshing.driven, reach2))
    for gear, (name, shape, reach) in zip(gears, sides, strict=True):
        real = drawn_gear(gear, name)
        check_micro(shape, real, name)
        found.append(flanks_of(shape, real, line, reach))
    return found[0], found[1]


@compiled(forceinline=True, **INNER)
def near_teeth(t1: Tooth, t2: Tooth, reach1: float, reach2: float, side: int, theta1: float, at: Facing):
    """First and last driver tooth whose involute lies within NEAR of the path of contact; others touch nothing."""
    pitch = t1.rb * t1.pitch
    low = at.line - reach2 - NEAR * pitch
    high = reach1 + NEAR * pitch
    if side == 0:
        rho = t1.rb * (t1.psi + theta1 + t1.zero - at.bearing + at.alpha)
        return ceil((rho - high) / pitch), floor((rho - low) / pitch)
    rho = t1.rb * (t1.psi - theta1 - t1.zero - at.bearing + at.alpha)
    return ceil((low - rho) / pitch), floor((high - rho) / pitch)


@compiled(forceinline=True, **INNER)
def modelled(law: Law, k: Contact) -> bool:
    """Whether a contact lies on involutes, or on a tip edge as far as it is followed."""
    beyond = (k.slave == EDGE1 and k.xi1 > law.reach1) or (k.slave == EDGE2 and k.xi2 > law.reach2)
    return not beyond and k.s1 >= law.driver.s_form and k.s2 >= law.driven.s_form


@compiled(forceinline=True, **INNER)
def line_gap(t1: Tooth, t2: Tooth, side: int, theta1: float, theta2: float, front: Facing) -> float:
    """Gap [m] of ideal flanks of a side on the line of action, the same for all its teeth; none of them is closer.
    `front` is that of the working flanks."""
    turned1, turned2, phi = theta1 + t1.zero, t2.zero - theta2, front.phi
    if side == 1:
        turned1, turned2, phi = -turned1, -turned2 - t2.pitch, -front.bearing - front.alpha
    return front.line - t1.rb * (t1.psi + turned1 - phi) - t2.rb * (t2.psi + turned2 - phi)


@compiled(forceinline=True)
def meet(law: Law, theta1: float, theta2: float, dx: float, dy: float, margin: float, found: Meetings) -> int:
    """Write tooth pairs on the modelled flanks whose gap is below `margin` into `found` (PAIRS,); returns how many."""
    t1, t2 = law.driver, law.driven
    off = centres_of(law.flanks1, law.flanks2, law.alpha, theta1, theta2)
    dx, dy = dx + off.x2 - off.x1, dy + off.y2 - off.y1
    front, n = facing(t1, t2, dx, dy), 0
    for side in range(2):
        if line_gap(t1, t2, side, theta1, theta2, front) > margin + law.play + ROUNDED:
            continue
        at = turned_over(front) if side == 1 else front
        first, last = near_teeth(t1, t2, law.reach1, law.reach2, side, theta1, at)
        for j in range(first, last + 1):
            k = seen_contact(t1, t2, side, j, theta1, theta2, at)
            if not (k.gap < margin + law.play and n < PAIRS and modelled(law, k)):
                continue
            if law.play > 0.0:
                k = about_axes(deviate(t1, t2, law.flanks1, law.flanks2, side, j, dx, dy, k), side, off)
            if k.gap < margin:
                met = found[n]
                met.side, met.tooth = side, j
                met.gap, met.slave, met.xi1, met.xi2, met.s1, met.s2 = k.gap, k.slave, k.xi1, k.xi2, k.s1, k.s2
                met.lever1, met.lever2, met.nx, met.ny = k.lever1, k.lever2, k.nx, k.ny
                n += 1
    return n


@compiled
def find_pairs(law: Law, theta1: float, theta2: float, dx: float, dy: float, margin: float) -> Meetings:
    """Tooth pairs (n,) on the modelled flanks whose gap is below `margin`, at most PAIRS."""
    found = np.zeros(PAIRS, MEETING)
    n = meet(law, theta1, theta2, dx, dy, margin, found)
    return found[:n]


@compiled
def off_flanks(law: Law, theta1: float, theta2: float, dx: float, dy: float) -> bool:
    """Whether a tooth pair overlaps where its flanks are not modelled: beyond a tip edge's turn, or in a fillet."""
    t1, t2 = law.driver, law.driven
    off = centres_of(law.flanks1, law.flanks2, law.alpha, theta1, theta2)
    dx, dy = dx + off.x2 - off.x1, dy + off.y2 - off.y1
    front = facing(t1, t2, dx, dy)
    for side in range(2):
        if line_gap(t1, t2, side, theta1, theta2, front) > law.play + ROUNDED:
            continue
        at = turned_over(front) if side == 1 else front
        first, last = near_teeth(t1, t2, law.reach1, law.reach2, side, theta1, at)
        for j in range(first, last + 1):
            k = seen_contact(t1, t2, side, j, theta1, theta2, at)
            if k.gap < law.play and not modelled(law, k):
                if law.play > 0.0:
                    k = deviate(t1, t2, law.flanks1, law.flanks2, side, j, dx, dy, k)
                if k.gap < 0.0:
                    return True
    return False


@compiled(forceinline=True)
def contact_in(pairs: Meetings, p: int) -> Contact:
    """Contact of pair p."""
    k = pairs[p]
    return Contact(k.gap, k.slave, k.xi1, k.xi2, k.s1, k.s2, k.lever1, k.lever2, k.nx, k.ny)


@compiled
def overlaps(pairs: Meetings) -> Array:
    """Rigid overlap (n,) [m] of the pairs."""
    out = np.empty(len(pairs))
    for p in range(len(pairs)):
        out[p] = -pairs[p].gap
    return out

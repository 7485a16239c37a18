"""The contact law of a gear pair: approach of every tooth pair against its force, coupled through both gear bodies."""

from __future__ import annotations

from math import acos, atan2, ceil, floor, hypot, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.curve import EDGE_SEPARATION, LOAD_RANGE, Curve, Curves, edge_reach, lone_approach, tabulate
from gearbench.fem.contact.deviation import Flanks, deviate, flanks_of, ideal_flanks
from gearbench.fem.contact.kernel import Kernel, crack_flexibility, cross_flexibility, grid_position, make_kernel
from gearbench.fem.contact.kinematics import EDGE1, EDGE2, Contact, Tooth, pair_contact, teeth_of
from gearbench.fem.gear.body import CondensedGear, rounded
from gearbench.fem.gear.elasticity import plane_moduli
from gearbench.geometry.pair.kinematics import Pair, pair
from gearbench.geometry.tooth.iso1328 import drawn_gear
from gearbench.geometry.tooth.micro import check_micro
from gearbench.kernels.compiled import compiled
from gearbench.kernels.small import eliminate
from gearbench.rig import Gear, Material, Rig, sound_gear

__all__ = ["EDGE_SEPARATION", "LOAD_RANGE", "PAIRS", "Curve", "Law", "elastic_pair", "make_law"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Meetings = NDArray[np.void]  # of MEETING

PAIRS = 8  # tooth pairs, both flank sides together, that may touch at once
# A tooth pair near contact: flank side (0 working, 1 back), driver tooth, and its `Contact`.
MEETING = np.dtype(
    [("side", np.int64), ("tooth", np.int64)]
    + [(name, np.int64 if name == "slave" else np.float64) for name in Contact._fields]
)
NEAR = 0.25  # of the base pitch: how far beyond the path of contact tooth pairs are looked at


class Law(NamedTuple):
    """Contact law: both teeth, both kernels, centre distance [m], 2/(pi E* b) [m/N], the load-approach curves, how
    far, in roll length, the tip edges of driver and driven gear reach [m], what their flanks have too much, and how
    much that moves a gap at most [m] (0: ideal flanks)."""

    driver: Tooth
    driven: Tooth
    k1: Kernel
    k2: Kernel
    centre: float
    half_plane: float
    curves: Curves
    reach1: float
    reach2: float
    flanks1: Flanks
    flanks2: Flanks
    play: float


class Shared(NamedTuple):
    """How the pairs share a load: forces (n,) [N], flexibility (n, n) [m/N] tangent to that state, flags (n,) of the
    pairs that carry, and whether it was found."""

    force: Array
    flexibility: Array
    active: Flags
    converged: bool


def elastic_pair(rig: Rig) -> Pair:
    """The pair as the elastic gears see it: a tip edge sharper than elasticity can resolve is rounded."""
    return pair(rig.model_copy(update={"driver": rounded(rig.driver), "driven": rounded(rig.driven)}))


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
    # Before it passes the mate's undercut corner a tip edge lies on the mate's flank, felt as in that corner.
    if t2.corner >= 0.0:
        reach1 = max(reach1, t1.rho_end + approach_max)
    if t1.corner >= 0.0:
        reach2 = max(reach2, t2.rho_end + approach_max)
    f1, f2 = _deviations(meshing, gears, reach1, reach2)
    every = Curves(*curves, t1.rho_end, t2.rho_end)
    return Law(t1, t2, k1, k2, a, half_plane, every, reach1, reach2, f1, f2, f1.largest + f2.largest)


def _deviations(meshing: Pair, gears: tuple[Gear, Gear] | None, reach1: float, reach2: float) -> tuple[Flanks, Flanks]:
    """What the flanks of driver and driven gear have too much. Raises GeometryError."""
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


@compiled
def near_teeth(t1: Tooth, t2: Tooth, reach1: float, reach2: float, side: int, theta1: float, dx: float, dy: float):
    """First and last driver tooth whose involute lies within NEAR of the path of contact; others touch nothing."""
    a = hypot(dx, dy)
    alpha = acos((t1.rb + t2.rb) / a)
    pitch = t1.rb * t1.pitch
    low = a * sin(alpha) - reach2 - NEAR * pitch
    high = reach1 + NEAR * pitch
    if side == 0:
        rho = t1.rb * (t1.psi + theta1 + t1.zero - atan2(dy, dx) + alpha)
        return ceil((rho - high) / pitch), floor((rho - low) / pitch)
    rho = t1.rb * (t1.psi - theta1 - t1.zero + atan2(dy, dx) + alpha)
    return ceil((low - rho) / pitch), floor((high - rho) / pitch)


@compiled
def modelled(law: Law, k: Contact) -> bool:
    """Whether a contact lies on involutes, or on a tip edge as far as it is followed."""
    beyond = (k.slave == EDGE1 and k.xi1 > law.reach1) or (k.slave == EDGE2 and k.xi2 > law.reach2)
    return not beyond and k.s1 >= law.driver.s_form and k.s2 >= law.driven.s_form


@compiled
def find_pairs(law: Law, theta1: float, theta2: float, dx: float, dy: float, margin: float) -> Meetings:
    """Tooth pairs (n,) on the modelled flanks whose gap is below `margin`, at most PAIRS."""
    t1, t2 = law.driver, law.driven
    found = np.zeros(PAIRS, MEETING)
    n = 0
    for side in range(2):
        first, last = near_teeth(t1, t2, law.reach1, law.reach2, side, theta1, dx, dy)
        for j in range(first, last + 1):
            k = pair_contact(t1, t2, side, j, theta1, theta2, dx, dy)
            if not (k.gap < margin + law.play and n < PAIRS and modelled(law, k)):
                continue
            if law.play > 0.0:
                k = deviate(t1, t2, law.flanks1, law.flanks2, side, j, theta1, theta2, dx, dy, k)
            if k.gap < margin:
                met = found[n]
                met.side, met.tooth = side, j
                met.gap, met.slave, met.xi1, met.xi2, met.s1, met.s2 = k.gap, k.slave, k.xi1, k.xi2, k.s1, k.s2
                met.lever1, met.lever2, met.nx, met.ny = k.lever1, k.lever2, k.nx, k.ny
                n += 1
    return found[:n]


@compiled
def off_flanks(law: Law, theta1: float, theta2: float, dx: float, dy: float) -> bool:
    """Whether a tooth pair overlaps where its flanks are not modelled: beyond a tip edge's turn, or in a fillet."""
    t1, t2 = law.driver, law.driven
    for side in range(2):
        first, last = near_teeth(t1, t2, law.reach1, law.reach2, side, theta1, dx, dy)
        for j in range(first, last + 1):
            k = pair_contact(t1, t2, side, j, theta1, theta2, dx, dy)
            if k.gap < law.play and not modelled(law, k):
                if law.play > 0.0:
                    k = deviate(t1, t2, law.flanks1, law.flanks2, side, j, theta1, theta2, dx, dy, k)
                if k.gap < 0.0:
                    return True
    return False


@compiled
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


@compiled
def coupling(law: Law, pairs: Meetings) -> Array:
    """Approach (n, n) at pair p per force on pair q [m/N]; on the diagonal, besides the pair's own curve, only what a
    crack adds."""
    n = len(pairs)
    x1, x2 = np.empty(n), np.empty(n)
    tooth1, tooth2 = np.empty(n, np.int64), np.empty(n, np.int64)
    for p in range(n):
        k = pairs[p]
        x1[p], x2[p] = grid_position(law.k1, k.s1), grid_position(law.k2, k.s2)
        # Counter-clockwise: the driver's numbers run clockwise; back pairs join driven tooth number + 1.
        tooth1[p], tooth2[p] = -k.tooth, k.tooth + k.side
    out = np.zeros((n, n))
    for p in range(n):
        for q in range(n):
            loaded, at = pairs[q].side, pairs[p].side
            if p != q:
                apart1, apart2 = tooth1[p] - tooth1[q], tooth2[p] - tooth2[q]
                out[p, q] = cross_flexibility(law.k1, loaded, x1[q], at, x1[p], apart1)
                out[p, q] += cross_flexibility(law.k2, loaded, x2[q], at, x2[p], apart2)
            if law.k1.cracked >= 0:
                out[p, q] += crack_flexibility(law.k1, loaded, tooth1[q], x1[q], at, tooth1[p], x1[p])
            if law.k2.cracked >= 0:
                out[p, q] += crack_flexibility(law.k2, loaded, tooth2[q], x2[q], at, tooth2[p], x2[p])
    return out


@compiled
def imbalance(
    curves: Curves, pairs: Meetings, over: Array, flexibility: Array, gain: float, force: Array, active: Flags
) -> tuple[Array, Array]:
    """What the forces leave of the overlaps (n,), and the derivative (n, n) of what they take."""
    n = len(over)
    tangent = np.empty((n, n))
    left = np.empty(n)
    for p in range(n):
        left[p] = over[p]
        for q in range(n):
            tangent[p, q] = flexibility[p, q]
            left[p] -= flexibility[p, q] * force[q]
        if active[p]:
            u, slope = lone_approach(curves, contact_in(pairs, p), force[p])
            left[p] -= gain * u
            tangent[p, p] += gain * slope
    return left, tangent


@compiled
def newton_step(left: Array, tangent: Array, active: Flags) -> Array:
    """Change (n, 1) of the active forces that closes what is left, to first order; zero elsewhere."""
    n = len(left)
    system = np.zeros((n, n + 1))
    for p in range(n):
        if active[p]:
            system[p, n] = left[p]
            for q in range(n):
                if active[q]:
                    system[p, q] = tangent[p, q]
        else:
            system[p, p] = 1.0
    return eliminate(system)


@compiled
def share_load(
    curves: Curves, pairs: Meetings, over: Array, flexibility: Array, gain: float, guess: Array
) -> Shared:
    """Forces >= 0 with over = flexibility F + gain D(F) on loaded pairs and over <= flexibility F on the others, where
    D is each pair's own curve: Newton with an active set.

    over (n,) [m]; flexibility (n, n) [m/N]; guess (n,) [N].
    """
    n = len(over)
    force = np.zeros(n)
    active = np.zeros(n, np.bool_)
    for p in range(n):
        active[p] = guess[p] > 0.0 or over[p] > 0.0
        if active[p]:
            force[p] = guess[p] if guess[p] > 0.0 else max(over[p], 1e-9) * 1e8
    for _ in range(100):
        left, tangent = imbalance(curves, pairs, over, flexibility, gain, force, active)
        changed = False
        for p in range(n):
            if not active[p] and left[p] > 1e-15:
                active[p] = True
                force[p] = 1e-6
                changed = True
        if changed:
            continue
        step = newton_step(left, tangent, active)
        worst = 0.0
        for p in range(n):
            if not active[p]:
                continue
            new = force[p] + step[p, 0]
            if new <= 0.0:
                # The curve has a logarithm at zero: shrink first, leave only when even a tiny force overlaps.
                new = 0.1 * force[p]
                changed = True
                if new < 1e-9:
                    active[p] = False
                    new = 0.0
            worst = max(worst, abs(new - force[p]) / max(new, 1e-6))
            force[p] = new
        if not changed and worst < 1e-11:
            return Shared(force, tangent, active, True)
    return Shared(force, tangent, active, False)

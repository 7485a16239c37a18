"""Load-approach curves of a lone tooth pair: solved once by contact lines, then interpolated in the loops."""

from __future__ import annotations

from math import acos, exp, log, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gearbench.fem.contact.kernel import Kernel, lagrange
from gearbench.fem.contact.kinematics import CORNER1, CORNER2, CORNER_SEPARATION, EDGE1, EDGE2, Contact, Tooth
from gearbench.fem.contact.line import gap_to_master, line_contact, touching_point
from gearbench.fem.limits import LOAD_RANGE
from gearbench.kernels.compiled import INNER, compiled

Array = NDArray[np.float64]

LOADS = 15
BLEND = 0.1  # of the path of contact, on either side of its middle: where the slave changes
SMALLEST = 1e-30  # force [N] that counts as none
LAST0, LAST1, LAST2, LAST3 = -1 / 3, 3 / 2, -3.0, 11 / 6  # `lagrange_slopes` at the last of four nodes


class Curve(NamedTuple):
    """Tabulated approach per force [m/N] of a lone pair: cubic Hermite in the slave's roll length, Lagrange in ln F.

    xi (n,) [m]; value, slope (loads, n); log_low, log_step of the load grid; corner: roll length of the slave's
    undercut corner [m], from which contact then starts (-1: none).
    """

    xi: Array
    value: Array
    slope: Array
    log_low: float
    log_step: float
    corner: float = -1.0


class Curves(NamedTuple):
    """Load-approach curves of a pair, each gear as the slave, and the roll lengths where their involutes end [m]."""

    driver: Curve
    driven: Curve
    end1: float
    end2: float


def edge_reach(slave: Tooth, master: Tooth, a: float, separation: float) -> float:
    """Roll length to which the slave's tip edge is followed: there it has left the master's involute by `separation`,
    has turned over, or its foot passes the beginning of the master's flank; of a master that undercut ends, the corner
    touches there, and beyond it the foot of the edge rises again."""
    xi = slave.rho_end
    step = separation / 4
    while step > separation / 1000:
        if _follows(slave, master, a, xi + step, separation):
            xi += step
        else:
            step /= 2
    return xi


def _follows(slave: Tooth, master: Tooth, a: float, xi: float, separation: float) -> bool:
    """Whether contact of the slave's tip edge at this roll length still lies on both flanks."""
    alpha = acos((slave.rb + master.rb) / a)
    touch = touching_point(slave, master, xi, a)
    rho_m = a * sin(alpha) - xi
    left = touch.reference - (rho_m - master.rb * alpha)
    _, foot = gap_to_master(slave, master, touch.angle, a, touch.s)
    turned = touch.s >= slave.s_tip - 1e-12 and slave.edge_radius > 0
    if master.corner >= 0.0:
        return not (left > separation or turned)
    return not (left > separation or turned or foot**2 / (2 * master.rb) < master.s_form or rho_m <= separation / 4)


def tabulate(slave: Tooth, master: Tooth, ks: Kernel, km: Kernel, half_plane: float, a: float, reach: float) -> Curve:
    """The line's approach at every node of load and roll length.

    Where undercut limits the flanks, contact starts and ends on corners instead of tip edges. The gear with the corner
    is then the slave as far as the line reaches; a mate without one is so on its tip edge only.
    """
    width = min(ks.width, km.width)
    logs = np.linspace(log(LOAD_RANGE[0] * width), log(LOAD_RANGE[1] * width), LOADS)
    line = a * sin(acos((slave.rb + master.rb) / a))
    start = line - master.rho_end
    middle = 0.5 * (start + slave.rho_end) - BLEND * (slave.rho_end - start)
    if slave.corner >= 0.0:
        last = line - master.corner if master.corner >= 0.0 else reach
        xi = _corner_nodes(slave, master, a, last)
        if master.corner < 0.0:
            xi = np.unique(np.concatenate([xi[xi < middle], _curve_nodes(slave, middle, reach)]))
    elif master.corner >= 0.0:
        xi = _edge_nodes(slave, max(reach, slave.rho_end + 4e-6))
    else:
        xi = _curve_nodes(slave, middle, reach)
    value = np.array(
        [[line_contact(slave, master, ks, km, half_plane, a, x, exp(f)).approach / exp(f) for x in xi] for f in logs]
    )
    slope = np.array([CubicSpline(xi, v)(xi, 1) for v in value])
    return Curve(xi, value, slope, float(logs[0]), float(logs[1] - logs[0]), slave.corner)


def _corner_nodes(slave: Tooth, master: Tooth, a: float, last: float) -> Array:
    """Roll lengths up to `last`, dense around the slave's undercut corner, from where that has left the master."""
    corner = slave.corner
    step, below = 2e-6, [corner]
    largest = CORNER_SEPARATION * slave.rb * slave.pitch
    while len(below) < 100:
        touch = touching_point(slave, master, below[-1] - step, a)
        _, foot = gap_to_master(slave, master, touch.angle, a, touch.s)
        rolled = a * sin(acos((slave.rb + master.rb) / a)) - (below[-1] - step)
        below.append(below[-1] - step)
        if touch.reference - (rolled - master.rb * acos((slave.rb + master.rb) / a)) > largest or foot > master.rho_end:
            break
        step = min(step * 1.4, 0.02 * slave.rb * slave.pitch)
    step, above = 2e-6, [corner]
    while above[-1] + step < last:
        above.append(above[-1] + step)
        step = min(step * 1.4, (last - corner) / 24)
    return np.unique(np.concatenate([below, above, [last]]))


def _curve_nodes(slave: Tooth, middle: float, reach: float) -> Array:
    """Roll lengths, dense around the beginning of the tip edge."""
    end = slave.rho_end
    below = [end]
    step = _finest(slave)
    while below[-1] - step > middle:
        below.append(below[-1] - step)
        step = min(step * 1.25, (end - middle) / 12)
    return np.unique(np.concatenate([[middle], below, _edge_nodes(slave, reach)]))


def _edge_nodes(slave: Tooth, reach: float) -> Array:
    """Roll lengths on the tip edge, dense around its beginning."""
    end = slave.rho_end
    above = [end]
    step = _finest(slave)
    while above[-1] + step < reach:
        above.append(above[-1] + step)
        step = min(step * 1.25, (reach - end) / 6)
    return np.unique(np.concatenate([above, [reach]]))


def _finest(slave: Tooth) -> float:
    """Distance of roll lengths at the beginning of the tip edge [m]."""
    fine = 0.15 * slave.edge_radius * slave.rb / slave.rho_end
    return min(max(0.1 * fine, 1e-6), 2e-5)


@compiled(forceinline=True, **INNER)
def lagrange_slopes(t: float):
    """Derivatives of `lagrange`'s weights."""
    return (
        -((t - 2) * (t - 3) + (t - 1) * (t - 3) + (t - 1) * (t - 2)) / 6,
        ((t - 2) * (t - 3) + t * (t - 3) + t * (t - 2)) / 2,
        -((t - 1) * (t - 3) + t * (t - 3) + t * (t - 1)) / 2,
        ((t - 1) * (t - 2) + t * (t - 2) + t * (t - 1)) / 6,
    )


class Cut(NamedTuple):
    """A load-approach curve at one place: approach per force [m/N] at four successive loads from number `node` on."""

    node: int
    c0: float
    c1: float
    c2: float
    c3: float


class Interval(NamedTuple):
    """An interval between nodes of roll length: its first node, its length [m] and the fraction of it that lies behind.
    """

    node: int
    length: float
    part: float


@compiled(forceinline=True, **INNER)
def interval_of(nodes: Array, xi: float) -> Interval:
    """Where a roll length [m], clipped to the nodes, lies."""
    n = len(nodes)
    x = min(max(xi, nodes[0]), nodes[n - 1])
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if nodes[middle] < x:
            low = middle
        else:
            high = middle
    length = nodes[low + 1] - nodes[low]
    return Interval(low, length, (x - nodes[low]) / length)


@compiled(forceinline=True)
def largest_force(curve: Curve) -> float:
    """Force of a pair [N] up to which its curve is tabulated; beyond, approach per force goes on linearly in ln F."""
    return exp(curve.log_low + (curve.value.shape[0] - 1) * curve.log_step)


@compiled(forceinline=True, **INNER)
def load_node(curve: Curve, force: float) -> int:
    """First of the four loads between which the approach under a force [N] is read."""
    y = (log(max(force, SMALLEST)) - curve.log_low) / curve.log_step
    return min(max(int(y) - 1, 0), curve.value.shape[0] - 4)


@compiled(forceinline=True, **INNER)
def curve_cut(curve: Curve, xi: float, node: int) -> Cut:
    """The curve at a roll length [m], four loads from number `node` on."""
    at = interval_of(curve.xi, xi)
    t, u, i = at.part, 1 - at.part, at.node
    v0, v1 = (1 + 2 * t) * u * u, t * t * (3 - 2 * t)
    m0, m1 = t * u * u * at.length, -t * t * u * at.length
    value, slope = curve.value, curve.slope
    return Cut(
        node,
        v0 * value[node, i] + v1 * value[node, i + 1] + m0 * slope[node, i] + m1 * slope[node, i + 1],
        v0 * value[node + 1, i] + v1 * value[node + 1, i + 1] + m0 * slope[node + 1, i] + m1 * slope[node + 1, i + 1],
        v0 * value[node + 2, i] + v1 * value[node + 2, i + 1] + m0 * slope[node + 2, i] + m1 * slope[node + 2, i + 1],
        v0 * value[node + 3, i] + v1 * value[node + 3, i + 1] + m0 * slope[node + 3, i] + m1 * slope[node + 3, i + 1],
    )


@compiled(forceinline=True, **INNER)
def along_cut(curve: Curve, cut: Cut, force: float):
    """Approach [m] and slope [m/N] under a force [N] for which `cut` holds; beyond all loads linear in ln F."""
    f = max(force, SMALLEST)
    y = (log(f) - curve.log_low) / curve.log_step
    if y < 0.0:
        rise = cut.c1 - cut.c0
        c = cut.c0 + y * rise
        return c * f, c + rise / curve.log_step
    past = y - (curve.value.shape[0] - 1)
    if past > 0.0:
        rise = LAST0 * cut.c0 + LAST1 * cut.c1 + LAST2 * cut.c2 + LAST3 * cut.c3
        c = cut.c3 + past * rise
        return c * f, c + rise / curve.log_step
    w0, w1, w2, w3 = lagrange(y - cut.node)
    d0, d1, d2, d3 = lagrange_slopes(y - cut.node)
    c = w0 * cut.c0 + w1 * cut.c1 + w2 * cut.c2 + w3 * cut.c3
    rate = d0 * cut.c0 + d1 * cut.c1 + d2 * cut.c2 + d3 * cut.c3
    return c * f, c + rate / curve.log_step


@compiled
def curve_at(curve: Curve, xi: float, force: float):
    """Approach [m] and slope [m/N] from a tabulated curve."""
    return along_cut(curve, curve_cut(curve, xi, load_node(curve, force)), force)


@compiled(forceinline=True, **INNER)
def pair_cut(curves: Curves, k: Contact, node: int) -> Cut:
    """The curve of a lone pair where it touches, four loads from number `node` on.

    The gear nearer its tip is the slave; with undercut corners the gear that has one, or is nearer to its own, but for
    its mate's tip edge. Either choice gives the same to about 2e-5 in mid-path, where one passes smoothly into the
    other, so that not even that much of a step is left.
    """
    left1, left2 = curves.end1 - k.xi1, curves.end2 - k.xi2
    corner1, corner2 = curves.driver.corner, curves.driven.corner
    if corner1 >= 0.0 and corner2 >= 0.0:
        left1, left2 = k.xi1 - corner1, k.xi2 - corner2
    t = 0.5 + (left2 - left1) / (4 * BLEND * (left1 + left2))
    if k.slave == EDGE1 or k.slave == CORNER1:
        t = 1.0
    elif k.slave == EDGE2 or k.slave == CORNER2:
        t = 0.0
    if corner1 >= 0.0 and corner2 < 0.0:
        t = 0.0 if k.slave == EDGE2 else 1.0
    elif corner2 >= 0.0 and corner1 < 0.0:
        t = 1.0 if k.slave == EDGE1 else 0.0
    t = min(max(t, 0.0), 1.0)
    w = t * t * t * (10 - 15 * t + 6 * t * t)
    v = 1 - w
    if v == 0.0:
        return curve_cut(curves.driver, k.xi1, node)
    two = curve_cut(curves.driven, k.xi2, node)
    if w == 0.0:
        return two
    one = curve_cut(curves.driver, k.xi1, node)
    c0, c1, c2, c3 = w * one.c0 + v * two.c0, w * one.c1 + v * two.c1, w * one.c2 + v * two.c2, w * one.c3 + v * two.c3
    return Cut(node, c0, c1, c2, c3)


@compiled
def lone_approach(curves: Curves, k: Contact, force: float):
    """Approach [m] of a lone pair under a force [N], and its slope [m/N]."""
    return along_cut(curves.driver, pair_cut(curves, k, load_node(curves.driver, force)), force)

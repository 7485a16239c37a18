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
from gearbench.kernels.compiled import compiled

Array = NDArray[np.float64]

LOADS = 15
LOAD_RANGE = (1e1, 3e6)  # per unit of common face width [N/m]
BLEND = 0.1  # of the path of contact, on either side of its middle: where the slave changes
EDGE_SEPARATION = 0.05  # of the module: how far a tip edge is followed beyond the line of action


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
    has turned over, or its foot passes the beginning of the master's flank."""
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
    return not (left > separation or turned or foot**2 / (2 * master.rb) < master.s_form or rho_m <= separation / 4)


def tabulate(slave: Tooth, master: Tooth, ks: Kernel, km: Kernel, half_plane: float, a: float, reach: float) -> Curve:
    """The line's approach at every node of load and roll length.

    Where undercut limits the flanks, contact starts and ends on corners instead of tip edges. The gear with the corner
    is then the slave as far as the line reaches; a mate without one never is, and its curve stays empty.
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
        none = np.zeros((LOADS, 4))
        return Curve(np.arange(4.0), none, none.copy(), float(logs[0]), float(logs[1] - logs[0]), -1.0)
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
    fine = 0.15 * slave.edge_radius * slave.rb / slave.rho_end
    fine = min(max(0.1 * fine, 1e-6), 2e-5)
    below = [end]
    step = fine
    while below[-1] - step > middle:
        below.append(below[-1] - step)
        step = min(step * 1.25, (end - middle) / 12)
    above = [end]
    step = fine
    while above[-1] + step < reach:
        above.append(above[-1] + step)
        step = min(step * 1.25, (reach - end) / 6)
    return np.unique(np.concatenate([[middle], below, above, [reach]]))


@compiled
def lagrange_slopes(t: float):
    """Derivatives of `lagrange`'s weights."""
    return (
        -((t - 2) * (t - 3) + (t - 1) * (t - 3) + (t - 1) * (t - 2)) / 6,
        ((t - 2) * (t - 3) + t * (t - 3) + t * (t - 2)) / 2,
        -((t - 1) * (t - 3) + t * (t - 3) + t * (t - 1)) / 2,
        ((t - 1) * (t - 2) + t * (t - 2) + t * (t - 1)) / 6,
    )


@compiled
def hermite(curve: Curve, load: int, i: int, t: float) -> float:
    """Approach per force on one row of the load grid, at the fraction t of the interval after node i."""
    h = curve.xi[i + 1] - curve.xi[i]
    value, slope = curve.value[load], curve.slope[load]
    u = 1 - t
    return (
        (1 + 2 * t) * u * u * value[i]
        + t * t * (3 - 2 * t) * value[i + 1]
        + t * u * u * h * slope[i]
        - t * t * u * h * slope[i + 1]
    )


@compiled
def curve_at(curve: Curve, xi: float, force: float):
    """Approach [m] and slope [m/N] from a tabulated curve; below its loads linear in ln F."""
    nodes = curve.xi
    n = len(nodes)
    x = min(max(xi, nodes[0]), nodes[n - 1])
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if nodes[middle] < x:
            low = middle
        else:
            high = middle
    t = (x - nodes[low]) / (nodes[low + 1] - nodes[low])
    f = max(force, 1e-30)
    y = (log(f) - curve.log_low) / curve.log_step
    if y < 0.0:
        first = hermite(curve, 0, low, t)
        rise = hermite(curve, 1, low, t) - first
        c = first + y * rise
        return c * f, c + rise / curve.log_step
    j = min(max(int(y) - 1, 0), curve.value.shape[0] - 4)
    w0, w1, w2, w3 = lagrange(y - j)
    d0, d1, d2, d3 = lagrange_slopes(y - j)
    v0, v1 = hermite(curve, j, low, t), hermite(curve, j + 1, low, t)
    v2, v3 = hermite(curve, j + 2, low, t), hermite(curve, j + 3, low, t)
    c = w0 * v0 + w1 * v1 + w2 * v2 + w3 * v3
    rate = d0 * v0 + d1 * v1 + d2 * v2 + d3 * v3
    return c * f, c + rate / curve.log_step


@compiled
def lone_approach(curves: Curves, k: Contact, force: float):
    """Approach [m] of a lone pair under a force, and its slope [m/N].

    The gear nearer its tip is the slave; with undercut corners the gear that has one, or is nearer to its own. Either
    choice gives the same to about 2e-5 in mid-path, where one passes smoothly into the other, so that not even that
    much of a step is left.
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
        t = 1.0
    elif corner2 >= 0.0 and corner1 < 0.0:
        t = 0.0
    t = min(max(t, 0.0), 1.0)
    w = t * t * t * (10 - 15 * t + 6 * t * t)
    u, slope = 0.0, 0.0
    if w > 0.0:
        # A tip edge on its way to the mate's corner is felt as in that corner.
        xi = curves.driver.xi[0] if k.slave == EDGE2 and corner1 >= 0.0 else k.xi1
        u1, slope1 = curve_at(curves.driver, xi, force)
        u, slope = w * u1, w * slope1
    if w < 1.0:
        xi = curves.driven.xi[0] if k.slave == EDGE1 and corner2 >= 0.0 else k.xi2
        u2, slope2 = curve_at(curves.driven, xi, force)
        u, slope = u + (1 - w) * u2, slope + (1 - w) * slope2
    return u, slope

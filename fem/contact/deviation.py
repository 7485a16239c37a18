"""Micro-geometry and errors in the contact of a tooth pair: how they shift its gap, its place and its normal; and where
run-out holds the gears' geometric centres.

A flank that stands proud of its involute by a(rho) closes the gap by the largest a - t^2/(2 R) over the distance t
along the flank from the point that touches on ideal involutes, R being the relative radius of curvature there: a slope
moves the contact by t = R da/ds and gains R (da/ds)^2/2. That envelope is tabulated; its derivative tilts the common
normal, so that levers, moments and gaps stay derivatives of one another. Limits: the load-approach curves and the
flexibilities stay those of the sound flank at the shifted place, so a kink inside the Hertz width is felt as if it were
sharp, and excess must be far smaller than the radii of curvature.
"""

from __future__ import annotations

from math import asin, atan2, cos, hypot, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.kinematics import CORNER1, CORNER2, EDGE1, EDGE2, ON_LINE, Contact, Tooth
from gearbench.geometry.tooth.micro import profile_excess, relief, teeth_alike
from gearbench.geometry.tooth.profile import Profile
from gearbench.kernels.compiled import INNER, compiled
from gearbench.rig import Gear

Array = NDArray[np.float64]

NODES = 1001
WINDOW = 1.2  # search for the envelope's contact this much further than the steepest slope moves it
WIDEST = 0.2  # of the flank's arc length: bound of that search, where a slope is steep beside the base circle
LEAST_ROLL = 1e-4  # [m]: closer to the base circle the flank's curvature says nothing any more


class Flanks(NamedTuple):
    """Excess material of one gear's flanks.

    front, front_slope (rows, NODES): envelope [m] and its derivative by the roll length, of the working flanks; one row
    for all teeth, or one for each. back, back_slope (1, NODES): of the back flanks. start, step [m]: roll lengths.
    pitch (teeth,) [m]: excess of whole working flanks. eccentricity [m], phase [rad]: half of the run-out, and the
    rotation at which it adds most. largest [m]: bound of all together; 0: the flanks are those of the ideal gear.
    """

    front: Array
    front_slope: Array
    back: Array
    back_slope: Array
    start: float
    step: float
    pitch: Array
    eccentricity: float
    phase: float
    largest: float


class Centres(NamedTuple):
    """Where the geometric centres of driver (1) and driven gear (2) are from their axes [m]."""

    x1: float
    y1: float
    x2: float
    y2: float


class EdgeDeviation(NamedTuple):
    """A real tip edge in contact: what it adds to the gap, levers on slave and master, roll and arc length of the
    contact on the slave, and of its foot on the master; all [m]."""

    gap: float
    lever_slave: float
    lever_master: float
    xi: float
    s: float
    foot: float
    s_foot: float


def ideal_flanks(teeth: int) -> Flanks:
    """Flanks without any deviation."""
    none = np.zeros((1, 2))
    return Flanks(none, none.copy(), none.copy(), none.copy(), 0.0, 1.0, np.zeros(teeth), 0.0, 0.0, 0.0)


def flanks_of(shape: Profile, gear: Gear, line: float, reach: float) -> Flanks:
    """The deviations of a gear; line [m]: distance of the tangent points; reach [m]: roll length to which its tip edge
    is followed."""
    rho = np.linspace(shape.rho_form, max(reach, shape.rho_end + 1e-4), NODES)
    step = float(rho[1] - rho[0])
    count = 1 if teeth_alike(gear.model_copy(update={"pitch_error": (), "runout": 0.0})) else gear.teeth
    raw = np.array([profile_excess(shape, gear, tooth, rho) for tooth in range(count)])
    front, back = (_envelope(shape, rho, a, line) for a in (raw, relief(shape, gear, rho)[None]))
    pitch = np.array(gear.pitch_error) if gear.pitch_error else np.zeros(gear.teeth)
    largest = max(np.abs(front).max(), np.abs(back).max()) + np.abs(pitch).max() + gear.runout / 2
    return Flanks(
        front,
        np.gradient(front, step, axis=1),
        back,
        np.gradient(back, step, axis=1),
        float(rho[0]),
        step,
        pitch,
        gear.runout / 2,
        gear.runout_phase,
        float(largest),
    )


def _envelope(shape: Profile, rho: Array, raw: Array, line: float) -> Array:
    """Largest a - t^2/(2 R) around each roll length; rows (teeth, rho) of excess a.

    Nothing touches beyond the end of the involute but the tip edge, whose own gap already counts the way to it: there
    t^2/(2 R) from the end is added back.
    """
    rb, end = shape.base_radius, shape.rho_end
    if not raw.any():
        return np.zeros_like(raw)
    last = int(np.searchsorted(rho, end, side="right")) - 1
    s = rho**2 / (2 * rb)
    s_end = end**2 / (2 * rb)
    flat = np.clip(np.minimum(rho, end), LEAST_ROLL, line - LEAST_ROLL)
    curvature = flat * (line - flat) / line
    slope = np.abs(np.gradient(raw[:, : last + 1], s[: last + 1], axis=1)).max() if last else 0.0
    tip = raw[:, last] + (end - rho[last]) / (rho[1] - rho[0]) * (raw[:, min(last + 1, len(rho) - 1)] - raw[:, last])
    width = min(WINDOW * slope * curvature.max(), WIDEST * s_end) + 2 * (s[last] - s[max(last - 1, 0)])
    out = np.empty_like(raw)
    for i in range(len(rho)):
        low, high = np.searchsorted(s, (s[i] - width, s[i] + width))
        low, high = min(int(low), last), min(int(high), last + 1)
        candidates = raw[:, low:high] - (s[low:high] - s[i]) ** 2 / (2 * curvature[i])
        best = _vertex(s[low:high], candidates)
        if high == last + 1:
            best = np.maximum(best, tip - (s_end - s[i]) ** 2 / (2 * curvature[i]))
        beyond = max(s[i] - s_end, 0.0)
        out[:, i] = best + beyond**2 / (2 * curvature[i])
    return out


def _vertex(places: Array, values: Array) -> Array:
    """Largest value of each row, between its samples by the parabola through the best three."""
    rows = np.arange(len(values))
    best = np.argmax(values, axis=1)
    highest = values[rows, best]
    if values.shape[1] < 3:
        return np.asarray(highest)
    at = np.clip(best, 1, values.shape[1] - 2)
    x0, x1, x2 = places[at - 1], places[at], places[at + 1]
    f0, f1, f2 = values[rows, at - 1], values[rows, at], values[rows, at + 1]
    rise = (f1 - f0) / (x1 - x0)
    bend = ((f2 - f1) / (x2 - x1) - rise) / (x2 - x0)
    inner = (at == best) & (bend < 0)
    top = 0.5 * (x0 + x1) - rise / np.where(inner, 2 * bend, 1.0)
    return np.asarray(np.where(inner, f0 + rise * (top - x0) + bend * (top - x0) * (top - x1), highest))


@compiled(**INNER)
def deviation(flanks: Flanks, side: int, tooth: int, rho: float):
    """Excess [m] of a tooth's flank (0: working, 1: back) at a roll length, and its derivative; cubic Hermite."""
    n = flanks.front.shape[1]
    x = (rho - flanks.start) / flanks.step
    inside = 1.0
    if x < 0.0 or x > n - 1.0:
        inside = 0.0
        x = min(max(x, 0.0), n - 1.0)
    i = min(int(x), n - 2)
    t = x - i
    if side == 0:
        row = tooth % flanks.front.shape[0]
        v0, v1 = flanks.front[row, i], flanks.front[row, i + 1]
        m0, m1 = flanks.front_slope[row, i] * flanks.step, flanks.front_slope[row, i + 1] * flanks.step
        whole = flanks.pitch[tooth]
    else:
        v0, v1 = flanks.back[0, i], flanks.back[0, i + 1]
        m0, m1 = flanks.back_slope[0, i] * flanks.step, flanks.back_slope[0, i + 1] * flanks.step
        whole = 0.0
    u = 1.0 - t
    value = (1 + 2 * t) * u * u * v0 + t * t * (3 - 2 * t) * v1 + t * u * u * m0 - t * t * u * m1
    slope = 6 * t * u * (v1 - v0) + u * (1 - 3 * t) * m0 + t * (3 * t - 2) * m1
    return value + whole, inside * slope / flanks.step


@compiled(**INNER)
def edge_deviation(
    slave: Tooth, master: Tooth, flanks: Flanks, side: int, tooth: int, line: float, rho: float, slope: float,
    lever: float, xi: float, s: float, foot: float, s_foot: float,
) -> EdgeDeviation:  # fmt: skip
    """Contact of a real tip edge with a master flank whose excess has the derivative `slope` at the foot.

    rho: rigid roll length of the slave. The edge has been moved with the end of its involute, from whose normal the
    contact has turned, and stays there: the tilt of the master's normal turns the slave's lever too. Slopes of both
    flanks delay the turn over the edge: until then contact is still on the flank, `late` behind, and gains as there.
    """
    own, own_slope = deviation(flanks, side, tooth, rho)
    _, at_end = deviation(flanks, side, tooth, slave.rho_end - 0.5 * flanks.step)
    end, foot_ = slave.rho_end, max(foot, LEAST_ROLL)
    curvature = end * max(line - end, LEAST_ROLL) / line
    beyond = (rho - end) * end / slave.rb
    tilt = slope * master.rb / foot_
    alone = -curvature * at_end * slave.rb / end
    late = max(alone + curvature * tilt, 0.0)
    left, left_alone = max(late - beyond, 0.0), max(alone - beyond, 0.0)
    # The tables hold the delay by the slave's own slope, and the master's envelope instead of its flank.
    gain = (left * left - left_alone * left_alone) / (2.0 * curvature) - 0.5 * curvature * tilt * tilt
    turned = (s - slave.s_end) / max(slave.edge_radius, 1e-9)
    along = sqrt(max(slave.edge_r**2 - lever**2, 0.0)) / foot_
    here = lever + slope * master.rb * along + own_slope * slave.rb - own * sin(turned) * (1.0 + along)
    here -= (left - left_alone) / curvature * end
    moved = xi - late * slave.rb / end
    if left > 0.0:
        s = slave.s_end - left
        foot, s_foot = min(foot + left * master.rb / foot_, master.rho_end), min(s_foot + left, master.s_end)
    elif beyond > 0.0:
        s = slave.s_end + (s - slave.s_end) * (1.0 - late / beyond)
    return EdgeDeviation(own * (1.0 - cos(turned)) - gain, here, master.rb * (1.0 + slope), moved, s, foot, s_foot)


@compiled
def deviate(
    t1: Tooth, t2: Tooth, f1: Flanks, f2: Flanks, side: int, tooth: int, dx: float, dy: float, k: Contact
) -> Contact:
    """The contact of a pair on real flanks, from that on ideal ones; (dx, dy) from driver's to driven gear's geometric
    centre."""
    a = hypot(dx, dy)
    line = sqrt(a * a - (t1.rb + t2.rb) ** 2)
    shift = 0.5 * min(k.gap, 0.0)
    # Rigid roll lengths: those without elastic approach, which follow the rotation of one gear alone.
    rho1 = k.xi1 if k.slave == EDGE2 or k.slave == CORNER2 else k.xi1 - shift
    rho2 = k.xi2 if k.slave == EDGE1 or k.slave == CORNER1 else k.xi2 - shift
    # Teeth differ on their working flanks only, where both numbers are the same.
    i1, i2 = tooth % len(f1.pitch), tooth % len(f2.pitch)
    v1, e1 = deviation(f1, side, i1, rho1)
    v2, e2 = deviation(f2, side, i2, rho2)
    gap = k.gap - v1 - v2
    xi1, xi2, s1, s2, lever1, lever2 = k.xi1, k.xi2, k.s1, k.s2, k.lever1, k.lever2
    if k.slave == ON_LINE:
        # Slopes of both flanks at once gain more than each alone.
        gap += e1 * e2 * t1.rb * t2.rb / line
        r1, r2 = max(rho1, LEAST_ROLL), max(rho2, LEAST_ROLL)
        t = (e1 * t1.rb * r2 - e2 * t2.rb * r1) / line
        t = max(min(t, t1.s_end - s1, s2 - t2.s_form), s2 - t2.s_end, t1.s_form - s1)
        xi1, xi2, s1, s2 = xi1 + t * t1.rb / r1, xi2 - t * t2.rb / r2, s1 + t, s2 - t
        lever1, lever2 = lever1 + t1.rb * e1, lever2 + t2.rb * e2
    elif k.slave == EDGE1:
        e = edge_deviation(t1, t2, f1, side, i1, line, rho1, e2, lever1, xi1, s1, xi2, s2)
        gap, lever1, lever2, xi1, s1, xi2, s2 = gap + e.gap, e.lever_slave, e.lever_master, e.xi, e.s, e.foot, e.s_foot
    elif k.slave == EDGE2:
        e = edge_deviation(t2, t1, f2, side, i2, line, rho2, e1, lever2, xi2, s2, xi1, s1)
        gap, lever2, lever1, xi2, s2, xi1, s1 = gap + e.gap, e.lever_slave, e.lever_master, e.xi, e.s, e.foot, e.s_foot
    elif k.slave == CORNER1:  # the mate's slope tilts the normal in the driver's corner
        lever1 += e2 * t2.rb * sqrt(max(t1.rb**2 + t1.corner**2 - lever1**2, 0.0)) / max(xi2, LEAST_ROLL)
        lever2 += t2.rb * e2
    else:
        lever2 += e1 * t1.rb * sqrt(max(t2.rb**2 + t2.corner**2 - lever2**2, 0.0)) / max(xi1, LEAST_ROLL)
        lever1 += t1.rb * e1
    # The direction that balances the moments about both centres.
    psi = atan2(dy, dx) + asin((1.0 - 2.0 * side) * (lever1 + lever2) / a)
    return Contact(gap, k.slave, xi1, xi2, s1, s2, lever1, lever2, cos(psi), sin(psi))


@compiled(forceinline=True)
def centres_of(f1: Flanks, f2: Flanks, alpha: float, theta1: float, theta2: float) -> Centres:
    """Geometric centres of gears that run out, at their rotations; alpha: working pressure angle at rest."""
    if f1.eccentricity == 0.0 and f2.eccentricity == 0.0:
        return Centres(0.0, 0.0, 0.0, 0.0)
    # At the phase of the run-out a centre stands on its axis' line along the normal, towards the mate's flank.
    one, two = 0.5 * pi - alpha + theta1 - f1.phase, -0.5 * pi - alpha - theta2 + f2.phase
    return Centres(
        f1.eccentricity * cos(one), f1.eccentricity * sin(one), f2.eccentricity * cos(two), f2.eccentricity * sin(two)
    )


@compiled(forceinline=True)
def about_axes(k: Contact, side: int, off: Centres) -> Contact:
    """A contact between gears about their geometric centres, about their axes."""
    sign = 1.0 - 2.0 * side
    lever1 = k.lever1 + sign * (off.x1 * k.ny - off.y1 * k.nx)
    lever2 = k.lever2 - sign * (off.x2 * k.ny - off.y2 * k.nx)
    return Contact(k.gap, k.slave, k.xi1, k.xi2, k.s1, k.s2, lever1, lever2, k.nx, k.ny)

"""The contact law of a gear pair: approach of every tooth pair against its force, coupled through both gear bodies."""

from __future__ import annotations

from math import acos, exp, log, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gearbench.fem.body import CondensedGear, rounded
from gearbench.fem.compiled import compiled
from gearbench.fem.elasticity import plane_moduli
from gearbench.fem.kernel import Kernel, cross_flexibility, lagrange, make_kernel
from gearbench.fem.kinematics import Contact, Tooth, pair_contact, teeth_of
from gearbench.fem.line import gap_to_master, line_contact, touching_point
from gearbench.geometry.pair import Pair, pair
from gearbench.rig import Material, Rig

Array = NDArray[np.float64]

LOADS = 15
LOAD_RANGE = (1e1, 3e6)  # per unit of common face width [N/m]
BLEND = 0.1  # of the path of contact, on either side of its middle: where the slave changes
EDGE_SEPARATION = 0.05  # of the module: how far a tip edge is followed beyond the line of action
PAIRS = 8  # tooth pairs, both flank sides together, that may touch at once


class Curve(NamedTuple):
    """Tabulated approach per force [m/N] of a lone pair: cubic Hermite in the slave's roll length, Lagrange in ln F.

    xi (n,) [m]; value, slope (loads, n); log_low, log_step of the load grid; xi_max: end of the tip edge's reach.
    """

    xi: Array
    value: Array
    slope: Array
    log_low: float
    log_step: float


class Law(NamedTuple):
    """Contact law: both teeth, both kernels, centre distance [m], 2/(pi E* b) [m/N], and the two load-approach
    curves (driver as slave, driven gear as slave) and how far, in roll length, their tip edges reach [m]."""

    driver: Tooth
    driven: Tooth
    k1: Kernel
    k2: Kernel
    centre: float
    half_plane: float
    curve1: Curve
    curve2: Curve
    reach1: float
    reach2: float


def elastic_pair(rig: Rig) -> Pair:
    """The pair as the elastic gears see it: a tip edge sharper than elasticity can resolve is rounded."""
    return pair(rig.model_copy(update={"driver": rounded(rig.driver), "driven": rounded(rig.driven)}))


def make_law(
    meshing: Pair,
    driver: CondensedGear,
    driven: CondensedGear,
    material: Material,
    curves: tuple[Curve, Curve] | None = None,
) -> Law:
    """The contact law of an `elastic_pair` of condensed gears; the lines are solved here unless `curves` are given."""
    t1, t2 = teeth_of(meshing)
    moduli = plane_moduli(material)
    half_plane = 4.0 / (pi * moduli.modulus * min(driver.face_width, driven.face_width))
    a = meshing.centre_distance
    approach_max = EDGE_SEPARATION * meshing.driver.module
    k1, k2 = make_kernel(driver), make_kernel(driven)
    reach1, reach2 = _edge_reach(t1, t2, a, approach_max), _edge_reach(t2, t1, a, approach_max)
    if curves is None:
        curves = (
            _tabulate(t1, t2, k1, k2, half_plane, a, reach1),
            _tabulate(t2, t1, k2, k1, half_plane, a, reach2),
        )
    return Law(t1, t2, k1, k2, a, half_plane, *curves, reach1, reach2)


def _edge_reach(slave: Tooth, master: Tooth, a: float, separation: float) -> float:
    """Roll length at which the slave's tip edge has left the master's involute by `separation` or turned over."""
    alpha = acos((slave.rb + master.rb) / a)
    xi = slave.rho_end
    step = separation / 4
    while True:
        xi += step
        c, s, reference = touching_point(slave, master, xi, a)
        rho_m = a * sin(alpha) - xi
        conjugate = rho_m - master.rb * alpha
        left = reference - conjugate
        _, foot = gap_to_master(slave, master, c, a, s)
        turned = s >= slave.s_tip - 1e-12 and slave.edge_radius > 0
        if left > separation or turned or foot**2 / (2 * master.rb) < master.s_form or rho_m <= step:
            return xi - step


def _tabulate(
    slave: Tooth, master: Tooth, ks: Kernel, km: Kernel, half_plane: float, a: float, reach: float
) -> Curve:
    """The line's approach at every node of load and roll length."""
    width = min(ks.width, km.width)
    logs = np.linspace(log(LOAD_RANGE[0] * width), log(LOAD_RANGE[1] * width), LOADS)
    line = a * sin(acos((slave.rb + master.rb) / a))
    start = line - master.rho_end
    middle = 0.5 * (start + slave.rho_end) - BLEND * (slave.rho_end - start)
    xi = _curve_nodes(slave, middle, reach)
    value = np.array(
        [
            [line_contact(slave, master, ks, km, half_plane, a, x, exp(f))[0] / exp(f) for x in xi]
            for f in logs
        ]
    )
    slope = np.array([CubicSpline(xi, v)(xi, 1) for v in value])
    return Curve(xi, value, slope, float(logs[0]), float(logs[1] - logs[0]))


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
def curve_at(curve: Curve, xi: float, force: float):  # type: ignore[no-untyped-def]
    """Approach [m] and slope [m/N] from a tabulated curve."""
    nodes = curve.xi
    n = len(nodes)
    x = min(max(xi, nodes[0]), nodes[n - 1])
    i = min(max(np.searchsorted(nodes, x) - 1, 0), n - 2)
    h = nodes[i + 1] - nodes[i]
    t = (x - nodes[i]) / h
    h00 = (1 + 2 * t) * (1 - t) * (1 - t)
    h10 = t * (1 - t) * (1 - t) * h
    h01 = t * t * (3 - 2 * t)
    h11 = t * t * (t - 1) * h
    loads = curve.value.shape[0]
    f = max(force, 1e-30)
    y = (log(f) - curve.log_low) / curve.log_step
    if y < 0.0:
        first = (
            h00 * curve.value[0, i]
            + h01 * curve.value[0, i + 1]
            + h10 * curve.slope[0, i]
            + h11 * curve.slope[0, i + 1]
        )
        second = (
            h00 * curve.value[1, i]
            + h01 * curve.value[1, i + 1]
            + h10 * curve.slope[1, i]
            + h11 * curve.slope[1, i + 1]
        )
        c = first + y * (second - first)
        return c * f, c + (second - first) / curve.log_step
    j = min(max(int(y) - 1, 0), loads - 4)
    s = y - j
    weights = lagrange(s)
    d0 = -((s - 2) * (s - 3) + (s - 1) * (s - 3) + (s - 1) * (s - 2)) / 6
    d1 = ((s - 2) * (s - 3) + s * (s - 3) + s * (s - 2)) / 2
    d2 = -((s - 1) * (s - 3) + s * (s - 3) + s * (s - 1)) / 2
    d3 = ((s - 1) * (s - 2) + s * (s - 2) + s * (s - 1)) / 6
    rates = (d0, d1, d2, d3)
    c = 0.0
    dc = 0.0
    for p in range(4):
        v = (
            h00 * curve.value[j + p, i]
            + h01 * curve.value[j + p, i + 1]
            + h10 * curve.slope[j + p, i]
            + h11 * curve.slope[j + p, i + 1]
        )
        c += weights[p] * v
        dc += rates[p] * v
    return c * f, c + dc / curve.log_step


@compiled
def lone_approach(law: Law, k: Contact, force: float):
    """Approach [m] of a lone pair under a force, and its slope [m/N].

    The gear nearer its tip is the slave. Either choice gives the same to about 2e-5 in mid-path, where one passes
    smoothly into the other, so that not even that much of a step is left.
    """
    if k.slave == 1:
        return curve_at(law.curve1, k.xi1, force)
    if k.slave == 2:
        return curve_at(law.curve2, k.xi2, force)
    left1, left2 = law.driver.rho_end - k.xi1, law.driven.rho_end - k.xi2
    t = 0.5 + (left2 - left1) / (4 * BLEND * (left1 + left2))
    if t <= 0.0:
        return curve_at(law.curve2, k.xi2, force)
    u1, slope1 = curve_at(law.curve1, k.xi1, force)
    if t >= 1.0:
        return u1, slope1
    u2, slope2 = curve_at(law.curve2, k.xi2, force)
    w = t * t * t * (10 - 15 * t + 6 * t * t)
    return u2 + w * (u1 - u2), slope2 + w * (slope1 - slope2)


@compiled
def reachable(law: Law, k: Contact) -> bool:
    """Whether both contact points lie on the modelled flanks."""
    if k.slave == 1 and k.xi1 > law.reach1:
        return False
    if k.slave == 2 and k.xi2 > law.reach2:
        return False
    return k.s1 >= law.driver.s_form and k.s2 >= law.driven.s_form


@compiled
def find_pairs(law: Law, theta1: float, theta2: float, dx: float, dy: float, margin: float):  # type: ignore[no-untyped-def]
    """Tooth pairs whose gap is below `margin`: sides, driver teeth, contacts (arrays of PAIRS) and their number.

    A negative number: a pair overlaps beyond the modelled flank.
    """
    sides = np.zeros(PAIRS, np.int64)
    teeth = np.zeros(PAIRS, np.int64)
    found = [pair_contact(law.driver, law.driven, 0, 0, theta1, theta2, dx, dy)] * PAIRS
    n = 0
    middle = int(round(theta1 / law.driver.pitch))
    for side in range(2):
        for j in range(middle - 3, middle + 4):
            k = pair_contact(law.driver, law.driven, side, j, theta1, theta2, dx, dy)
            if k.gap < margin and reachable(law, k) and n < PAIRS:
                sides[n] = side
                teeth[n] = j
                found[n] = k
                n += 1
    return sides, teeth, found, n


@compiled
def coupling(law: Law, sides, teeth, found, n: int) -> Array:  # type: ignore[no-untyped-def]
    """Approach at pair p per force on pair q [m/N]; zero diagonal (that is the pair's own curve)."""
    out = np.zeros((n, n))
    for p in range(n):
        for q in range(n):
            if p == q:
                continue
            # Teeth counter-clockwise from the loaded one: the driver's numbers run clockwise, the driven gear's
            # counter-clockwise, and back pairs join driven tooth number + 1.
            apart1 = -(teeth[p] - teeth[q])
            apart2 = teeth[p] + sides[p] - teeth[q] - sides[q]
            out[p, q] = cross_flexibility(
                law.k1, sides[q], found[q].s1, sides[p], found[p].s1, apart1
            ) + cross_flexibility(law.k2, sides[q], found[q].s2, sides[p], found[p].s2, apart2)
    return out


@compiled
def share_load(law: Law, found, c: Array, n: int, guess: Array):  # type: ignore[no-untyped-def]
    """Forces >= 0 of n pairs whose overlaps are given by their gaps: Newton with an active set.

    Returns forces (n,), tangent flexibility matrix (n, n), and whether it converged.
    """
    force = np.maximum(guess, 0.0)
    active = np.zeros(n, np.bool_)
    for p in range(n):
        active[p] = found[p].gap < 0.0
        if active[p] and force[p] <= 0.0:
            force[p] = max(-found[p].gap, 1e-9) * 1e8
    flex = np.zeros((n, n))
    for _ in range(60):
        residual = np.zeros(n)
        for p in range(n):
            over = -found[p].gap
            for q in range(n):
                over -= c[p, q] * force[q]
                flex[p, q] = c[p, q]
            if active[p]:
                u, slope = lone_approach(law, found[p], force[p])
                flex[p, p] = slope
                residual[p] = over - u
            else:
                flex[p, p] = 1.0
                residual[p] = over
        system = np.zeros((n, n))
        rhs = np.zeros(n)
        for p in range(n):
            if active[p]:
                rhs[p] = residual[p]
                for q in range(n):
                    if active[q]:
                        system[p, q] = flex[p, q]
            else:
                system[p, p] = 1.0
        step = np.linalg.solve(system, rhs)
        changed = False
        worst = 0.0
        for p in range(n):
            if active[p]:
                new = force[p] + step[p]
                if new <= 0.0:
                    # The curve has a logarithm at zero: shrink first, leave only when even a tiny force overlaps.
                    new = 0.1 * force[p]
                    if new < 1e-9:
                        active[p] = False
                        new = 0.0
                    changed = True
                worst = max(worst, abs(new - force[p]) / max(new, 1e-6))
                force[p] = new
            elif residual[p] > 1e-15:
                active[p] = True
                force[p] = 1e-6
                changed = True
        if not changed and worst < 1e-11:
            return force, flex, active, True
    return force, flex, active, False

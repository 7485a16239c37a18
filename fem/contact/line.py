"""One tooth pair's contact line: boundary elements with complementarity, and the load-approach curve it gives.

The pressure is piecewise constant on cells along the slave's boundary. Its displacement is the half-plane's response
to that pressure (exact integrals of the logarithm) plus the smooth kernels of both gears, so neither the mesh nor the
position of the cells enters the result.
"""

from __future__ import annotations

from math import acos, atan2, cos, hypot, log, pi, sin, sqrt, tan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.kernel import Kernel, grid_position, place_at, table_at, table_between
from gearbench.fem.contact.kinematics import Tooth, edge_contact
from gearbench.kernels.compiled import INNER, compiled
from gearbench.kernels.small import eliminate

Array = NDArray[np.float64]

CELLS = 32
CELLS_EDGE = 64
REFITS = 4
OUT_OF_REACH = 1.0  # [m]


class Touch(NamedTuple):
    """A touching point: angle and arc length [m] of the slave, and the gap [m] that counts as none."""

    angle: float
    s: float
    reference: float


class Window(NamedTuple):
    """A stretch of the slave's boundary by its arc lengths [m]; whether it reaches the tip edge or a corner."""

    low: float
    high: float
    edge: bool


class Pressing(NamedTuple):
    """Cell forces (n,) [N], their common approach [m] and its slope [m/N] by the sum of the forces."""

    force: Array
    approach: float
    slope: float


class Line(NamedTuple):
    """A loaded contact line: approach [m], its slope [m/N], cell edges (n + 1,) [m] and cell forces (n,) [N]."""

    approach: float
    slope: float
    edges: Array
    force: Array


@compiled(**INNER)
def boundary_point(tooth: Tooth, s: float):
    """Point (x, y) of the working boundary at arc length s, in the tooth's frame (tooth centre at polar angle 0)."""
    if s <= tooth.s_end:
        rho = sqrt(2 * tooth.rb * max(s, 0.0))
        phi = tooth.psi - rho / tooth.rb
        return tooth.rb * cos(phi) - rho * sin(phi), tooth.rb * sin(phi) + rho * cos(phi)
    phi = tooth.psi - tooth.rho_end / tooth.rb - (s - tooth.s_end) / max(tooth.edge_radius, 1e-12)
    x = tooth.edge_r * cos(tooth.edge_angle) - tooth.edge_radius * sin(phi)
    return x, tooth.edge_r * sin(tooth.edge_angle) + tooth.edge_radius * cos(phi)


@compiled
def gap_to_master(slave: Tooth, master: Tooth, c: float, a: float, s: float):
    """Gap of the slave's boundary point s to the master's involute (up to the master's rotation) and its foot."""
    x, y = boundary_point(slave, s)
    vx = a - (x * cos(c) - y * sin(c))
    vy = -(x * sin(c) + y * cos(c))
    v = hypot(vx, vy)
    if v <= master.rb:
        # Inside the base circle there is no involute to touch; no load that gears carry reaches that far.
        return OUT_OF_REACH, 0.0
    alpha = acos(master.rb / v)
    return master.rb * (atan2(vy, vx) + tan(alpha) - alpha), sqrt(v * v - master.rb**2)


@compiled
def touching_point(slave: Tooth, master: Tooth, xi: float, a: float) -> Touch:
    """The point that touches when the slave's roll length is xi."""
    phi = -acos((slave.rb + master.rb) / a)
    c = xi / slave.rb + phi - slave.psi
    if xi < slave.corner:
        s = slave.s_form
    elif xi < slave.rho_end or (xi == slave.rho_end and master.corner < 0.0):
        s = xi * xi / (2 * slave.rb)
    else:
        # Below a master's undercut the line of action may have ended before: the edge then touches beside it.
        moved = edge_contact(slave, master, c, 0.0, a, 0.0).moved
        s = min(slave.s_end + slave.edge_radius * max(moved, 0.0), slave.s_tip)
    reference, _ = gap_to_master(slave, master, c, a, s)
    return Touch(c, s, reference)


@compiled(**INNER)
def window(slave: Tooth, master: Tooth, xi: float, a: float, force: float, compliance: float) -> Window:
    """First guess of the loaded stretch of the slave's boundary.

    compliance: 4/(pi E* b) [m/N], so that the Hertz half-width is sqrt(compliance R force).
    """
    s0 = touching_point(slave, master, xi, a).s
    rho_s = min(max(xi, slave.corner), slave.rho_end)
    rho_m = max(a * sin(acos((slave.rb + master.rb) / a)) - max(xi, slave.corner), 1e-4)
    half = sqrt(compliance * force * rho_s * rho_m / (rho_s + rho_m))
    low = s0 - 1.25 * half
    high = s0 + 1.25 * half
    edge = high > slave.s_end
    if edge:
        narrow = sqrt(compliance * force * max(slave.edge_radius, 1e-6))
        low = min(s0, slave.s_end) - 2.0 * half
        high = min(s0 + 2.5 * narrow, slave.s_tip) if s0 > slave.s_end else min(slave.s_end + 2.5 * narrow, slave.s_tip)
    if slave.corner >= 0.0 and low < slave.s_form:
        # Cut short by the corner, the loaded stretch reaches further to the other side.
        high = min(s0 + 2.5 * half, slave.s_tip)
        edge = True
    return Window(max(low, slave.s_form), high, edge)


@compiled
def cell_edges(low: float, high: float, n: int) -> Array:
    """Cells that shrink towards both ends, where the pressure changes fastest."""
    out = np.empty(n + 1)
    for i in range(n + 1):
        x = -cos(pi * i / n)
        out[i] = low + (high - low) * 0.5 * (1 + 0.5 * x + 0.5 * (-1 + 2 * i / n))
    return out


@compiled(forceinline=True, **INNER)
def log_antiderivative(t: float) -> float:
    """t ln|t|: an integral of ln|t| but for -t."""
    return t * log(abs(t)) if t != 0.0 else 0.0


@compiled
def log_integral(a: float, b: float) -> float:
    """Integral of ln|t| from a to b."""
    return log_antiderivative(b) - log_antiderivative(a) - (b - a)


@compiled(**INNER)
def flexibility_matrix(
    k_slave: Kernel, k_master: Kernel, edges: Array, centres: Array, feet: Array, s0: float, half_plane: float
) -> Array:
    """Approach at cell centres per force on each cell [m/N]; half_plane: 2/(pi E* b).

    The force has one direction, the common normal at the touching point s0. On the tip edge the slave's own normal
    turns away from it, so there the structure answers as at the end of the involute, corrected by how the
    flexibility at s0 differs from the one at that end.
    """
    n = len(centres)
    a = np.empty((n, n))
    own_s = k_slave.front[k_slave.reach]
    own_m = k_master.front[k_master.reach]
    turned = 0.0
    if s0 > k_slave.s_end:
        x0, x1 = grid_position(k_slave, s0), grid_position(k_slave, k_slave.s_end)
        turned = table_at(own_s, x0, x0) - table_at(own_s, x1, x1)
    # Places are found once for each cell, integrals once for each edge.
    on_slave = [place_at(grid_position(k_slave, min(centres[i], k_slave.s_end))) for i in range(n)]
    on_master = [place_at(grid_position(k_master, feet[i])) for i in range(n)]
    before = np.empty(n)
    for i in range(n):
        before[i] = log_antiderivative(edges[0] - centres[i])
    for j in range(n):
        width = edges[j + 1] - edges[j]
        for i in range(n):
            low, high = edges[j] - centres[i], edges[j + 1] - centres[i]
            behind = log_antiderivative(high)
            singular = (behind - before[i] - (high - low)) / width
            before[i] = behind
            smooth = table_between(own_s, on_slave[j], on_slave[i]) + turned
            a[i, j] = smooth + table_between(own_m, on_master[j], on_master[i]) - half_plane * singular
    return a


@compiled
def complementarity(a: Array, h: Array, force: float) -> Pressing:
    """Cell forces q >= 0 with sum `force` and common approach u: u <= h + A q, equal where q > 0."""
    n = len(h)
    active = np.ones(n, np.bool_)
    q = np.zeros(n)
    u = 0.0
    slope = 0.0
    for _ in range(60):
        idx = np.nonzero(active)[0]
        m = len(idx)
        # Unknowns: the loaded cells' forces and the approach; right-hand sides: the gaps, and one unit of force.
        system = np.zeros((m + 1, m + 3))
        for p in range(m):
            for r in range(m):
                system[p, r] = a[idx[p], idx[r]]
            system[p, m] = -1.0
            system[m, p] = 1.0
            system[p, m + 1] = -h[idx[p]]
        system[m, m + 1] = force
        system[m, m + 2] = 1.0
        solution = eliminate(system)
        u = solution[m, 0]
        slope = solution[m, 1]
        q[:] = 0.0
        changed = False
        for p in range(m):
            q[idx[p]] = solution[p, 0]
            if solution[p, 0] < 0.0:
                active[idx[p]] = False
                q[idx[p]] = 0.0
                changed = True
        if not changed:
            for i in range(n):
                if not active[i]:
                    over = u - h[i]
                    for p in range(m):
                        over -= a[i, idx[p]] * q[idx[p]]
                    if over > 1e-9 * abs(u):
                        active[i] = True
                        changed = True
            if not changed:
                break
    return Pressing(q, u, slope)


@compiled
def line_contact(
    slave: Tooth, master: Tooth, k_slave: Kernel, k_master: Kernel, half_plane: float, a: float, xi: float, force: float
) -> Line:
    """Elastic approach of one pair under a force, neighbours unloaded.

    half_plane: 2/(pi E* b) [m/N]; a: centre distance; xi: roll length of the contact on the slave (beyond rho_end on
    its tip edge, short of `corner` on its undercut corner).
    """
    touch = touching_point(slave, master, xi, a)
    loaded = window(slave, master, xi, a, force, 2 * half_plane)
    low, high = loaded.low, loaded.high
    n = CELLS_EDGE if loaded.edge else CELLS
    rounds = REFITS if loaded.edge else 1
    edges = cell_edges(low, high, n)
    found = Pressing(np.zeros(n), 0.0, 0.0)
    for turn in range(rounds):
        edges = cell_edges(low, high, n)
        centres = 0.5 * (edges[1:] + edges[:-1])
        h = np.empty(n)
        feet = np.empty(n)
        for i in range(n):
            h[i], foot = gap_to_master(slave, master, touch.angle, a, centres[i])
            feet[i] = foot * foot / (2 * master.rb)
            h[i] -= touch.reference
        matrix = flexibility_matrix(k_slave, k_master, edges, centres, feet, touch.s, half_plane)
        found = complementarity(matrix, h, force)
        if turn == rounds - 1:
            break
        pressed = np.nonzero(found.force > 0.0)[0]
        first, last = pressed[0], pressed[-1]
        span = edges[last + 1] - edges[first]
        low = max(edges[first] - (0.02 if first > 0 else 0.4) * span, slave.s_form)
        high = min(edges[last + 1] + (0.02 if last < n - 1 else 0.4) * span, slave.s_tip)
    return Line(found.approach, found.slope, edges, found.force)

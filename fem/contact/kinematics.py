"""Where two flanks meet: exact gap, common normal and contact points of one tooth pair, tip edges included.

Each gear has a frame in which its working flank faces counter-clockwise; the driven gear's frame is turned by pi, so
that both gears look alike (docs/physics.md, "Axes, signs, zeros"). A back-flank contact is the mirror image of a
working one.
"""

from __future__ import annotations

from math import acos, atan2, cos, hypot, inf, pi, sin, sqrt, tan
from typing import NamedTuple

import numpy as np

from gearbench.geometry.pair.kinematics import Pair
from gearbench.geometry.tooth.profile import Profile
from gearbench.kernels.compiled import INNER, compiled

# Where a pair touches, `Contact.slave`: on the line of action, or with a tip edge or an undercut corner, of the driver
# (1) or of the driven gear (2).
ON_LINE, EDGE1, EDGE2, CORNER1, CORNER2 = range(5)
APART = 1.0  # gap of a pair that cannot touch [m]
CORNER_SEPARATION = 0.017  # of the base pitch (0.05 modules): how far a corner is followed beyond the line of action


class Tooth(NamedTuple):
    """What contact needs of one gear: base radius [m], involute origin angle, tooth pitch angle, angle of tooth 0 at
    mesh phase 0, roll length at the end of the involute [m], polar coordinates of the tip-edge centre, edge radius
    and the arc lengths of form point, end of involute and tip [m], and the roll length of the outward corner in which
    undercut ends the flank, where the mate reaches it (-1: it does not, or there is none) [m]."""

    rb: float
    psi: float
    pitch: float
    zero: float
    rho_end: float
    edge_r: float
    edge_angle: float
    edge_radius: float
    s_form: float
    s_end: float
    s_tip: float
    corner: float = -1.0


class Contact(NamedTuple):
    """Contact of one tooth pair in a given rigid configuration.

    gap [m] (negative: overlap); slave: ON_LINE, EDGE1, EDGE2, CORNER1 or CORNER2;
    xi1, xi2: roll lengths of the contact point, elastic approach shared equally, beyond rho_end on a tip edge, short of
    the corner on a corner [m];
    s1, s2: arc lengths of the contact points [m]; lever1, lever2 [m]; nx, ny: direction of the force on the driven.
    """

    gap: float
    slave: int
    xi1: float
    xi2: float
    s1: float
    s2: float
    lever1: float
    lever2: float
    nx: float
    ny: float


class Facing(NamedTuple):
    """One flank side of a pair whose centres stand dx, dy [m] apart, in the world in which its flanks look like working
    ones (the back flanks' is turned over): line of centres' direction, pressure angle, tangent angle of the flanks'
    normal on the line of action and that normal, and the length of that line between the base circles [m]."""

    dx: float
    dy: float
    bearing: float
    alpha: float
    phi: float
    nx: float
    ny: float
    line: float


class EdgeContact(NamedTuple):
    """The slave's tip edge at the master's involute: gap [m], tangent angle of the master's normal, roll length of the
    master's foot [m], lever on the slave [m], and the angle that the contact has moved along the edge arc (negative:
    still on the involute)."""

    gap: float
    tangent: float
    foot: float
    lever: float
    moved: float


class CornerContact(NamedTuple):
    """The slave's undercut corner at the master's involute or tip edge: gap [m], tangent angle of the master's normal,
    roll length of the master's foot, or of its involute's end [m], its arc length [m], levers on both [m]."""

    gap: float
    tangent: float
    foot: float
    s_foot: float
    lever_slave: float
    lever_master: float


def tooth_of(shape: Profile, working_pressure_angle: float, least: float = inf) -> Tooth:
    """Contact constants of a gear; tooth 0 passes the pitch point at mesh phase 0. `least`: roll length to which the
    mate's tip reaches down on it [m]."""
    centre = shape.edge_centre
    return Tooth(
        rb=shape.base_radius,
        psi=shape.psi_b,
        pitch=2 * pi / shape.teeth,
        zero=tan(working_pressure_angle) - working_pressure_angle - shape.psi_b,
        rho_end=shape.rho_end,
        edge_r=float(np.hypot(*centre)),
        edge_angle=float(np.arctan2(centre[1], centre[0])),
        edge_radius=shape.edge_radius,
        s_form=shape.s_form,
        s_end=shape.rho_end**2 / (2 * shape.base_radius),
        s_tip=shape.s_tip,
        corner=shape.rho_form if shape.undercut and least < shape.rho_form else -1.0,
    )


def teeth_of(pair: Pair) -> tuple[Tooth, Tooth]:
    """Contact constants of driver and driven gear."""
    alpha = pair.working_pressure_angle
    line = pair.line_of_action
    return tooth_of(pair.driver, alpha, line - pair.driven.rho_end), tooth_of(
        pair.driven, alpha, line - pair.driver.rho_end
    )


@compiled
def edge_contact(
    slave: Tooth, master: Tooth, c_slave: float, c_master: float, dx: float, dy: float
) -> EdgeContact:
    """Gap of the slave's tip edge to the master's involute: rb (angle + inv(alpha) - psi_b) - radius (docs/physics.md,
    "Contact law")."""
    angle = c_slave + slave.edge_angle
    wx = slave.edge_r * cos(angle)
    wy = slave.edge_r * sin(angle)
    vx, vy = dx - wx, dy - wy
    v = hypot(vx, vy)
    alpha = acos(master.rb / v)
    polar = atan2(vy, vx)
    to_centre = master.rb * (polar + tan(alpha) - alpha - master.psi - c_master)
    phi = polar - alpha
    ex, ey = -sin(phi), cos(phi)
    lever = wx * ey - wy * ex
    # Outward normals of slave and master are opposite in the world, equal in the two frames turned by pi.
    start = slave.psi + c_slave - slave.rho_end / slave.rb
    moved = start - phi
    foot = sqrt(v * v - master.rb**2) - to_centre
    return EdgeContact(to_centre - slave.edge_radius, phi, foot, lever, moved)


@compiled(**INNER)
def corner_contact(
    slave: Tooth, master: Tooth, c_slave: float, c_master: float, dx: float, dy: float
) -> CornerContact:
    """Gap of the slave's undercut corner to the master's involute, or to its tip edge beyond: as `edge_contact` with a
    point instead of the slave's arc."""
    angle = slave.psi + c_slave - slave.corner / slave.rb
    wx = slave.rb * cos(angle) - slave.corner * sin(angle)
    wy = slave.rb * sin(angle) + slave.corner * cos(angle)
    vx, vy = dx - wx, dy - wy
    v = hypot(vx, vy)
    if v <= master.rb:
        return CornerContact(APART, 0.0, 0.0, 0.0, slave.rb, master.rb)
    alpha = acos(master.rb / v)
    polar = atan2(vy, vx)
    gap = master.rb * (polar + tan(alpha) - alpha - master.psi - c_master)
    foot = sqrt(v * v - master.rb**2) - gap
    phi = polar - alpha
    at = foot * foot / (2 * master.rb)
    if foot > master.rho_end:
        # The corner, in the master's frame, before the arc of the tip edge.
        angle = c_master + master.edge_angle
        ex, ey = vx - master.edge_r * cos(angle), vy - master.edge_r * sin(angle)
        gap = hypot(ex, ey) - master.edge_radius
        phi = atan2(-ex, ey)
        turned = master.psi + c_master - master.rho_end / master.rb - phi
        foot, at = master.rho_end, master.s_end + master.edge_radius * max(turned, 0.0)
        if at > master.s_tip:
            gap = APART
    if foot <= 0.0 or gap > CORNER_SEPARATION * slave.rb * slave.pitch:
        gap = APART
    nx, ny = -sin(phi), cos(phi)
    return CornerContact(gap, phi, foot, at, wx * ny - wy * nx, vx * ny - vy * nx)


@compiled(forceinline=True, **INNER)
def on_edge(tooth: Tooth, moved: float) -> float:
    """Arc length [m] of the tip edge's point by whose angle `moved` the contact has moved along it."""
    return min(tooth.s_end + tooth.edge_radius * min(max(moved, 0.0), 1.5), tooth.s_tip)


@compiled(forceinline=True)
def facing(t1: Tooth, t2: Tooth, dx: float, dy: float) -> Facing:
    """What all contacts of the working flanks share; (dx, dy) from driver to driven centre."""
    a = hypot(dx, dy)
    alpha = acos((t1.rb + t2.rb) / a)
    bearing = atan2(dy, dx)
    phi = bearing - alpha
    return Facing(dx, dy, bearing, alpha, phi, -sin(phi), cos(phi), a * sin(alpha))


@compiled(forceinline=True)
def turned_over(at: Facing) -> Facing:
    """What all contacts of the back flanks share."""
    phi = -at.bearing - at.alpha
    return Facing(at.dx, -at.dy, -at.bearing, at.alpha, phi, -sin(phi), cos(phi), at.line)


@compiled(forceinline=True)
def contact(t1: Tooth, t2: Tooth, c1: float, c2: float, at: Facing) -> Contact:
    """Contact of one pair: c1, c2 are the teeth's angles in their frames, in the world of `at`."""
    dx, dy = at.dx, at.dy
    rho1 = t1.rb * (t1.psi + c1 - at.phi)
    rho2 = t2.rb * (t2.psi + c2 - at.phi)
    gap = at.line - rho1 - rho2
    over1, over2 = rho1 - t1.rho_end, rho2 - t2.rho_end
    before = False  # a tip edge that has not yet passed the mate's corner still faces the flank beyond it
    if rho1 < t1.corner:
        k = corner_contact(t1, t2, c1, c2, dx, dy)
        before = k.s_foot > t2.s_end and edge_contact(t2, t1, c2, c1, dx, dy).foot >= t1.corner
        if not before:
            xi1, nx, ny = rho1 + 0.5 * min(k.gap, 0.0), -sin(k.tangent), cos(k.tangent)
            return Contact(k.gap, CORNER1, xi1, k.foot, t1.s_form, k.s_foot, k.lever_slave, k.lever_master, nx, ny)
    if rho2 < t2.corner:
        k = corner_contact(t2, t1, c2, c1, dx, dy)
        before = k.s_foot > t1.s_end and edge_contact(t1, t2, c1, c2, dx, dy).foot >= t2.corner
        if not before:
            xi2, nx, ny = rho2 + 0.5 * min(k.gap, 0.0), -sin(k.tangent), cos(k.tangent)
            return Contact(k.gap, CORNER2, k.foot, xi2, k.s_foot, t2.s_form, k.lever_master, k.lever_slave, nx, ny)
    if not before and over1 <= 0.0 and over2 <= 0.0:
        shift = 0.5 * min(gap, 0.0)
        xi1, xi2 = max(rho1 + shift, t1.corner), max(rho2 + shift, t2.corner)
        s1 = xi1 * xi1 / (2 * t1.rb)
        s2 = xi2 * xi2 / (2 * t2.rb)
        return Contact(gap, ON_LINE, xi1, xi2, s1, s2, t1.rb, t2.rb, at.nx, at.ny)
    if over2 >= over1:
        e = edge_contact(t2, t1, c2, c1, dx, dy)
        foot, s2 = max(e.foot, 0.0), on_edge(t2, e.moved)
        xi2, s1, nx, ny = rho2 + 0.5 * min(e.gap, 0.0), foot * foot / (2 * t1.rb), -sin(e.tangent), cos(e.tangent)
        return Contact(e.gap, EDGE2, foot, xi2, s1, s2, t1.rb, e.lever, nx, ny)
    e = edge_contact(t1, t2, c1, c2, dx, dy)
    foot, s1 = max(e.foot, 0.0), on_edge(t1, e.moved)
    xi1, s2, nx, ny = rho1 + 0.5 * min(e.gap, 0.0), foot * foot / (2 * t2.rb), -sin(e.tangent), cos(e.tangent)
    return Contact(e.gap, EDGE1, xi1, foot, s1, s2, e.lever, t2.rb, nx, ny)


@compiled(forceinline=True)
def seen_contact(t1: Tooth, t2: Tooth, side: int, tooth: int, theta1: float, theta2: float, at: Facing) -> Contact:
    """`pair_contact` where what its flank side shares is known."""
    c1 = theta1 + t1.zero - tooth * t1.pitch
    if side == 0:
        return contact(t1, t2, c1, t2.zero - theta2 + tooth * t2.pitch, at)
    c2 = t2.zero - theta2 + (tooth + 1) * t2.pitch
    k = contact(t1, t2, -c1, -c2, at)
    return Contact(k.gap, k.slave, k.xi1, k.xi2, k.s1, k.s2, k.lever1, k.lever2, k.nx, -k.ny)


@compiled
def pair_contact(
    t1: Tooth, t2: Tooth, side: int, tooth: int, theta1: float, theta2: float, dx: float, dy: float
) -> Contact:
    """Contact of driver tooth `tooth` with its partner; side 0: working flanks, 1: back flanks.

    The partner is the driven tooth of the same number on the working side, of the next one on the back side.
    """
    at = facing(t1, t2, dx, dy)
    return seen_contact(t1, t2, side, tooth, theta1, theta2, turned_over(at) if side == 1 else at)

"""Flank kernels of one gear, resampled for fast interpolation."""

from __future__ import annotations

from math import log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline, make_interp_spline

from gearbench.fem.gear.body import CondensedGear
from gearbench.kernels.compiled import INNER, compiled

Array = NDArray[np.float64]

FLANK_POINTS = 81
ARC_POINTS = 16
POINTS = FLANK_POINTS + ARC_POINTS
EDGE_SCALE = 15e-6  # distance to the tip edge below which the flank's stretched coordinate becomes linear [m]


class Kernel(NamedTuple):
    """Flexibility of one gear's flanks for total forces [m/N], on a grid of two uniform pieces.

    Nodes 0 .. ARC_POINTS-1 lie on the tip edge from s_end to s_tip; the rest on the involute, uniform in
    zeta = ln(1 + (s_end - s)/EDGE_SCALE) up to zeta_max. The flank's normal turns on the tip edge, so tables have a
    kink between the pieces and are never interpolated across it.
    front, back: (2 reach + 1, n, n) as in `CondensedGear`, divided by the face width; width [m];
    modes_front, modes_back: (modes, teeth, n) modal displacement along the inward normal [kg^-1/2].
    extra: what a crack adds, as in `CrackedTooth`, divided by the face width; no rows where all teeth are sound.
    cracked: the cracked tooth's number, counter-clockwise.
    """

    front: Array
    back: Array
    s_end: float
    s_tip: float
    zeta_max: float
    reach: int
    width: float
    modes_front: Array
    modes_back: Array
    extra: Array
    cracked: int


def make_kernel(gear: CondensedGear, order: int = 1) -> Kernel:
    """Resample a condensed gear's kernels by splines, piece by piece.

    order: 1 where the teeth of the case are numbered counter-clockwise, -1 where clockwise.
    """
    s_end, s_tip = float(gear.s[gear.last]), float(gear.s[-1])
    arc_from = np.arange(gear.last, len(gear.s))
    flank_from = np.arange(gear.last, -1, -1)
    arc_to = np.linspace(s_end, s_tip, ARC_POINTS)
    zeta = np.log1p((s_end - gear.s[flank_from]) / EDGE_SCALE)
    zeta_to = np.linspace(0.0, zeta[-1], FLANK_POINTS)
    pieces = [(arc_from, gear.s[arc_from], arc_to), (flank_from, zeta, zeta_to)]

    def resample(table: Array) -> Array:
        return (
            np.array(
                [
                    np.block(
                        [
                            [
                                RectBivariateSpline(xi, xj, k[np.ix_(i, j)], kx=3, ky=3, s=0)(ti, tj)
                                for j, xj, tj in pieces
                            ]
                            for i, xi, ti in pieces
                        ]
                    )
                    for k in table
                ]
            )
            / gear.face_width
        )

    def resample_modes(table: Array) -> Array:
        if not len(table):
            return np.zeros((0, gear.teeth, POINTS))
        parts = [make_interp_spline(x, table[:, :, i], k=3, axis=2)(t) for i, x, t in pieces]
        # Of one layout whatever the splines return: loops are compiled anew for every other one.
        return np.ascontiguousarray(np.concatenate(parts, axis=2))

    def resample_crack(table: Array) -> Array:
        splines = np.zeros((POINTS, len(gear.s)))
        rows = np.split(np.arange(POINTS), [ARC_POINTS])
        for to, (i, x, t) in zip(rows, pieces, strict=True):
            splines[np.ix_(to, i)] += make_interp_spline(x, np.eye(len(i)), k=3)(t)
        return np.ascontiguousarray(splines @ table @ splines.T / gear.face_width)

    return Kernel(
        resample(gear.front),
        resample(gear.back),
        s_end,
        s_tip,
        float(zeta[-1]),
        gear.reach,
        gear.face_width,
        resample_modes(gear.mode_front),
        resample_modes(gear.mode_back),
        resample_crack(gear.crack.extra) if gear.crack else np.zeros((0, 0, 2, 2, 0, 0)),
        (order * gear.crack.tooth) % gear.teeth if gear.crack else -1,
    )


@compiled(forceinline=True)
def grid_position(kernel: Kernel, s: float) -> float:
    """Position of arc length s on the grid, in grid steps, clipped to the grid."""
    if s > kernel.s_end:
        return min((s - kernel.s_end) / (kernel.s_tip - kernel.s_end), 1.0) * (ARC_POINTS - 1)
    zeta = log(1.0 + (kernel.s_end - s) / EDGE_SCALE)
    return ARC_POINTS + min(zeta / kernel.zeta_max, 1.0) * (FLANK_POINTS - 1)


@compiled(forceinline=True, **INNER)
def lagrange(t: float):
    """Cubic Lagrange weights at t for nodes 0, 1, 2, 3."""
    return (
        -(t - 1) * (t - 2) * (t - 3) / 6,
        t * (t - 2) * (t - 3) / 2,
        -t * (t - 1) * (t - 3) / 2,
        t * (t - 1) * (t - 2) / 6,
    )


@compiled(forceinline=True, **INNER)
def first_node(x: float) -> int:
    """First of the four nodes of the piece that holds grid position x."""
    if x < ARC_POINTS:
        return min(max(int(x) - 1, 0), ARC_POINTS - 4)
    return min(max(int(x) - 1, ARC_POINTS), POINTS - 4)


class Place(NamedTuple):
    """Where a value is read from a grid: the first of four nodes and their cubic weights."""

    node: int
    w0: float
    w1: float
    w2: float
    w3: float


@compiled(forceinline=True, **INNER)
def place_at(x: float) -> Place:
    """Place of grid position x."""
    node = first_node(x)
    w0, w1, w2, w3 = lagrange(x - node)
    return Place(node, w0, w1, w2, w3)


@compiled(forceinline=True, **INNER)
def row_between(table: Array, n: int, at: Place) -> float:
    """Cubic value along row n of a table (n, n)."""
    j = at.node
    return at.w0 * table[n, j] + at.w1 * table[n, j + 1] + at.w2 * table[n, j + 2] + at.w3 * table[n, j + 3]


@compiled(forceinline=True, **INNER)
def table_between(table: Array, one: Place, two: Place) -> float:
    """Bicubic value of a (n, n) table."""
    i = one.node
    total = one.w0 * row_between(table, i, two)
    total += one.w1 * row_between(table, i + 1, two)
    total += one.w2 * row_between(table, i + 2, two)
    return total + one.w3 * row_between(table, i + 3, two)


@compiled
def table_at(table: Array, x: float, y: float) -> float:
    """Bicubic value of a (n, n) table at grid positions x, y."""
    return table_between(table, place_at(x), place_at(y))


@compiled(forceinline=True, **INNER)
def cross_between(kernel: Kernel, side_load: int, load: Place, side: int, at: Place, teeth_apart: int) -> float:
    """Inward displacement at a place of one flank per total force at another, `teeth_apart` teeth ccw [m/N].

    Only for different flanks; a back-flank load is the mirror image of a working-flank one.
    """
    m = teeth_apart if side_load == 0 else -teeth_apart
    if m < -kernel.reach or m > kernel.reach:
        return 0.0
    if side == side_load:
        return table_between(kernel.front[m + kernel.reach], load, at)
    return table_between(kernel.back[m + kernel.reach], load, at)


@compiled
def cross_flexibility(kernel: Kernel, side_load: int, x_load: float, side: int, x: float, teeth_apart: int) -> float:
    """`cross_between` grid positions."""
    return cross_between(kernel, side_load, place_at(x_load), side, place_at(x), teeth_apart)


@compiled(forceinline=True, **INNER)
def crack_between(kernel: Kernel, side_load: int, load: int, at_load: Place, side: int, tooth: int, at: Place):
    """What a crack adds to the inward displacement at a place of one flank per total force at one of another, or of the
    same [m/N]; teeth `load` and `tooth` by their numbers counter-clockwise."""
    reach = len(kernel.extra) // 2
    teeth = kernel.modes_front.shape[1]
    # Teeth from the cracked one, to whichever side is nearer.
    a = (load - kernel.cracked + teeth // 2) % teeth - teeth // 2
    b = (tooth - kernel.cracked + teeth // 2) % teeth - teeth // 2
    if kernel.cracked < 0 or abs(a) > reach or abs(b) > reach:
        return 0.0
    return table_between(kernel.extra[a + reach, b + reach, side_load, side], at_load, at)

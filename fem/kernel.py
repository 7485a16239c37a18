"""Flank kernels of one gear, resampled for fast interpolation."""

from __future__ import annotations

from math import log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline, make_interp_spline

from gearbench.fem.body import CondensedGear
from gearbench.fem.compiled import compiled

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


def make_kernel(gear: CondensedGear) -> Kernel:
    """Resample a condensed gear's kernels by splines, piece by piece."""
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
        return np.concatenate([make_interp_spline(x, table[:, :, i], k=3, axis=2)(t) for i, x, t in pieces], axis=2)

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
    )


@compiled
def grid_position(kernel: Kernel, s: float) -> float:
    """Position of arc length s on the grid, in grid steps, clipped to the grid."""
    if s > kernel.s_end:
        return min((s - kernel.s_end) / (kernel.s_tip - kernel.s_end), 1.0) * (ARC_POINTS - 1)
    zeta = log(1.0 + (kernel.s_end - s) / EDGE_SCALE)
    return ARC_POINTS + min(zeta / kernel.zeta_max, 1.0) * (FLANK_POINTS - 1)


@compiled
def lagrange(t: float):
    """Cubic Lagrange weights at t for nodes 0, 1, 2, 3."""
    return (
        -(t - 1) * (t - 2) * (t - 3) / 6,
        t * (t - 2) * (t - 3) / 2,
        -t * (t - 1) * (t - 3) / 2,
        t * (t - 1) * (t - 2) / 6,
    )


@compiled
def first_node(x: float) -> int:
    """First of the four nodes of the piece that holds grid position x."""
    if x < ARC_POINTS:
        return min(max(int(x) - 1, 0), ARC_POINTS - 4)
    return min(max(int(x) - 1, ARC_POINTS), POINTS - 4)


@compiled
def table_at(table: Array, x: float, y: float) -> float:
    """Bicubic value of a (n, n) table at grid positions x, y."""
    i, j = first_node(x), first_node(y)
    b0, b1, b2, b3 = lagrange(y - j)
    total = 0.0
    for p, a in enumerate(lagrange(x - i)):
        n = i + p
        total += a * (b0 * table[n, j] + b1 * table[n, j + 1] + b2 * table[n, j + 2] + b3 * table[n, j + 3])
    return total


@compiled
def row_at(row: Array, x: float) -> float:
    """Cubic value of a (n,) row at grid position x."""
    j = first_node(x)
    b0, b1, b2, b3 = lagrange(x - j)
    return b0 * row[j] + b1 * row[j + 1] + b2 * row[j + 2] + b3 * row[j + 3]


@compiled
def cross_flexibility(kernel: Kernel, side_load: int, x_load: float, side: int, x: float, teeth_apart: int) -> float:
    """Inward displacement at grid position x of one flank per total force at x_load on another, `teeth_apart` teeth
    ccw [m/N].

    Only for different flanks; a back-flank load is the mirror image of a working-flank one.
    """
    m = teeth_apart if side_load == 0 else -teeth_apart
    if m < -kernel.reach or m > kernel.reach:
        return 0.0
    if side == side_load:
        return table_at(kernel.front[m + kernel.reach], x_load, x)
    return table_at(kernel.back[m + kernel.reach], x_load, x)

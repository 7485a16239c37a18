"""Sizes of the elements along the boundary of half a tooth sector, and the nodes that follow from them."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, pi, sin

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from gearbench.geometry.outline import Segment, half_outline
from gearbench.geometry.profile import Profile, radial

Array = NDArray[np.float64]

# Largest rise of element size per distance: neighbours differ by at most about (1 + g/2)/(1 - g/2) = 1.3.
GROWTH = 0.26
# Elements span at most this angle of a curved boundary [rad].
BEND = 0.35
# Size at a sharp tip corner [m]; a rounded tip edge has a quarter of its radius.
CORNER_SIZE = 4e-6
# Quadratic edges along a radial cut, at least.
CUT_EDGES = 12


@dataclass(frozen=True)
class Chain:
    """Nodes along one side of the half sector: corners (n + 1, 2), and mid-side nodes (n, 2) between them."""

    corners: Array
    mids: Array


@dataclass(frozen=True)
class HalfBoundary:
    """The four sides of the half sector, each from its own start: `outline` from the tooth's axis over tip and flank
    to the middle of the root land, `cut` from there down to the hub circle, `hub` from the cut back to the axis,
    `axis` from the hub out to the tip."""

    outline: Chain
    cut: Chain
    hub: Chain
    axis: Chain


@dataclass(frozen=True)
class _Cloud:
    """Points with element sizes; between them the size may grow by GROWTH per distance."""

    points: Array
    sizes: Array

    def at(self, points: Array) -> Array:
        """The largest size allowed at each of `points` (n, 2)."""
        return np.min(self.sizes + GROWTH * cdist(points, self.points), axis=1)


def _nodes(length: float, size: Array, at_least: int = 1) -> tuple[Array, Array]:
    """Positions of corners and mid-sides on [0, length] whose spacing follows `size`, sampled equidistantly."""
    t = np.linspace(0.0, length, len(size))
    density = 1 / size
    count = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(t))))
    edges = max(at_least, ceil(count[-1] - 1e-9))
    corners = np.interp(np.linspace(0.0, count[-1], edges + 1), count, t)
    corners[[0, -1]] = 0.0, length
    return corners, 0.5 * (corners[1:] + corners[:-1])


def _samples(length: float, size: float) -> Array:
    """Sampling of [0, length], a few points per smallest element."""
    return np.linspace(0.0, length, int(np.clip(4 * length / size, 9, 2000)))


def tip_size(tooth: Profile, element_size: float) -> float:
    """Element size on the tip edge [m]."""
    return min(element_size, max(tooth.edge_radius / 4, CORNER_SIZE))


def _outline_cloud(tooth: Profile, pieces: tuple[Segment, ...], element_size: float) -> _Cloud:
    """Element sizes on the outline: `element_size`, less where it bends sharply and near the tip edge."""
    points, sizes = [], []
    finest = tip_size(tooth, element_size)
    for piece in pieces:
        t = _samples(piece.length, finest if piece.name == "tip edge" else element_size / 4)
        bent = np.maximum(BEND / piece.curvature(t), finest if piece.name == "tip edge" else element_size / 16)
        points.append(piece.points(t))
        sizes.append(np.minimum(element_size, bent))
    points.append(tooth.edge_centre[None] + tooth.edge_radius * tooth.normals(np.array([tooth.s_end, tooth.s_tip])))
    sizes.append(np.full(2, finest))
    return _Cloud(np.concatenate(points), np.concatenate(sizes))


def half_boundary(tooth: Profile, hub_radius: float, element_size: float) -> HalfBoundary:
    """Nodes around the half sector between the tooth's axis and the middle of the next tooth space.

    Outline nodes, mid-sides included, lie on the exact profile at the middle of the arc length; hub nodes on the hub
    circle. `element_size` [m] holds on flank and fillet.
    """
    half = pi / tooth.teeth
    rim = tooth.root_radius - hub_radius
    pieces = half_outline(tooth)
    cloud = _outline_cloud(tooth, pieces, element_size)
    coarsest = max(element_size, min(0.7 * tooth.module, rim / 6))

    def size_on_ray(radius: Array, angle: float) -> Array:
        # The sector narrows inwards: no element longer than half a sector is wide.
        width = np.maximum(2 * radius * sin(half / 2), 1e-3 * hub_radius)
        return np.minimum(np.minimum(coarsest, width), cloud.at(radius[:, None] * radial(angle)))

    depth = _samples(rim, element_size)
    along = size_on_ray(tooth.root_radius - depth, half)
    wanted = float(np.sum(0.5 * (1 / along[1:] + 1 / along[:-1]) * np.diff(depth)))
    if wanted < CUT_EDGES:
        # A thin rim: refine what lies beside it too, or the triangles there would be flat.
        along = along * (wanted / CUT_EDGES)
        ends = (tooth.root_radius - depth)[:, None] * radial(half)
        cloud = _Cloud(np.concatenate((cloud.points, ends)), np.concatenate((cloud.sizes, along)))
    corners, mids = _nodes(rim, along, CUT_EDGES)
    cut = Chain(
        (tooth.root_radius - corners)[:, None] * radial(half), (tooth.root_radius - mids)[:, None] * radial(half)
    )

    t = _samples(tooth.tip_radius - hub_radius, element_size)
    corners, mids = (hub_radius + part for part in _nodes(t[-1], size_on_ray(hub_radius + t, 0.0)))
    axis = Chain(corners[:, None] * radial(0.0), mids[:, None] * radial(0.0))
    return HalfBoundary(_outline(pieces, cloud), cut, _hub(cloud, hub_radius, half, coarsest), axis)


def _outline(pieces: tuple[Segment, ...], cloud: _Cloud) -> Chain:
    """Nodes of the outline; every joint of two pieces is a corner."""
    corners, mids = [], []
    for piece in pieces:
        t = _samples(piece.length, float(cloud.sizes.min()))
        nodes, between = _nodes(piece.length, cloud.at(piece.points(t)))
        corners.append(piece.points(nodes)[:-1])
        mids.append(piece.points(between))
    last = pieces[-1]
    corners.append(last.points(np.array([last.length])))
    return Chain(np.concatenate(corners), np.concatenate(mids))


def _hub(cloud: _Cloud, radius: float, half: float, coarsest: float) -> Chain:
    """Nodes of the hub circle from the cut back to the axis."""
    t = _samples(half, 0.05 * half)
    size = np.minimum(min(coarsest, BEND * radius), cloud.at(radius * radial(half - t)))
    corners, mids = _nodes(half, size / radius)
    return Chain(radius * radial(half - corners), radius * radial(half - mids))

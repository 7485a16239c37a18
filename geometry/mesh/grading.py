"""Sizes of the elements along the boundary of half a tooth sector, and the nodes that follow from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, pi, sin

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.mesh.element_size import default_size
from gearbench.geometry.tooth.outline import Segment, half_outline, joined
from gearbench.geometry.tooth.profile import Profile, radial

Array = NDArray[np.float64]

# Smallest size that a sharp bend may ask for, in modules.
SMALLEST = 1e-4
# A fillet shorter than this, relative to the elements, is meshed as a corner.
CORNER = 5e-3
# Size at a sharp tip corner [m]; a rounded tip edge has a quarter of its radius.
CORNER_SIZE = 4e-6
# Largest elements, towards the hub, relative to those of the flank: 0.7 modules by default.
COARSE = 8.4


@dataclass(frozen=True)
class Grading:
    """How sizes vary. growth: largest rise of element size per distance (neighbours differ by at most about
    (1 + g/2)/(1 - g/2) = 1.3); bend: largest angle of a curved boundary that an element spans [rad]; cut_edges:
    quadratic edges along a radial cut, at least; fine_tips: whether tip edges are resolved for contact; even: whether
    every piece of a side has an even number of edges."""

    growth: float = 0.26
    bend: float = 0.35
    cut_edges: int = 12
    fine_tips: bool = True
    even: bool = False


DEFAULT = Grading()


@dataclass(frozen=True)
class Chain:
    """Nodes along one side of the half sector: corners (n + 1, 2), and mid-side nodes (n, 2) between them."""

    corners: Array
    mids: Array


@dataclass(frozen=True)
class HalfBoundary:
    """The four sides of the half sector, each from its own start: `outline` from the tooth's axis over tip
    and flank to the middle of the root land, `cut` from there down to the hub circle, `hub` from the cut back
    to the axis, `axis` from the hub out to the tip."""

    outline: Chain
    cut: Chain
    hub: Chain
    axis: Chain

    @property
    def sides(self) -> tuple[Chain, Chain, Chain, Chain]:
        """The sides in order around the half sector."""
        return self.outline, self.cut, self.hub, self.axis


@dataclass(frozen=True)
class Cloud:
    """Points (n, 2) with element sizes (n,); between them the size may grow by `growth` per distance."""

    points: Array
    sizes: Array
    growth: float

    def at(self, points: Array) -> Array:
        """The largest size allowed at each of `points` (n, 2)."""
        # Imported on use: what is not meshed need not wait for it.
        from scipy.spatial.distance import cdist

        return np.min(self.sizes + self.growth * cdist(points, self.points), axis=1)

    def and_at(self, points: Array, sizes: Array) -> Cloud:
        """With more points."""
        return Cloud(np.concatenate((self.points, points)), np.concatenate((self.sizes, sizes)), self.growth)


def spaced_nodes(t: Array, size: Array, at_least: int = 1, *, even: bool = False) -> tuple[Array, Array]:
    """Corners and mid-sides on [0, t[-1]], spaced as `size` (n,) at the rising samples `t` (n,) asks for; `even`: an
    even number of edges."""
    density = 1 / size
    count = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(t))))
    edges = max(at_least, ceil(count[-1] - 0.25))
    edges += edges % 2 if even else 0
    corners = np.interp(np.linspace(0.0, count[-1], edges + 1), count, t)
    corners[[0, -1]] = 0.0, t[-1]
    return corners, 0.5 * (corners[1:] + corners[:-1])


def size_samples(length: float, size: Callable[[Array], Array]) -> tuple[Array, Array]:
    """Rising samples of [0, length], a quarter of the size there apart, and the sizes."""
    t, found = [0.0], [float(size(np.zeros(1))[0])]
    while t[-1] < length:
        t.append(min(length, t[-1] + 0.25 * found[-1]))
        found.append(float(size(np.array(t[-1:]))[0]))
    return np.array(t), np.array(found)


def tip_size(tooth: Profile, element_size: float) -> float:
    """Element size on the tip edge [m]; it shrinks with the elements of a mesh finer than the default one."""
    finer = min(1.0, element_size / default_size(tooth.module))
    return min(element_size, finer * max(tooth.edge_radius / 4, CORNER_SIZE))


def _pieces(tooth: Profile, element_size: float, finest: float) -> list[Segment]:
    """The outline's pieces; a land much shorter than its neighbour's elements is no piece of its own, and the
    fillet of a sharp rack tip may be so short that a corner stands for it."""
    pieces = [p for p in half_outline(tooth) if p.name != "fillet" or p.length > CORNER * element_size]
    if pieces[-1].name == "root land" and pieces[-1].length < element_size / 8:
        pieces[-2:] = [joined(*pieces[-2:])]
    rounded = pieces[0].name == "tip land" and pieces[1].name == "tip edge"
    if rounded and pieces[0].length < finest / 4:
        pieces[:2] = [joined(*pieces[:2])]
    return pieces


def _outline_cloud(
    tooth: Profile, pieces: list[Segment], element_size: float, finest: float, grading: Grading
) -> Cloud:
    """Sizes on the outline: `element_size`, less on short or sharply bent pieces and near the tip edge."""
    points, sizes = [], []
    for piece in pieces:
        largest = finest if piece.name == "tip edge" else element_size
        points.append(piece.points(piece.samples))
        bent = np.maximum(grading.bend / piece.curvature(piece.samples), SMALLEST * tooth.module)
        sizes.append(np.minimum(min(largest, piece.length), bent))
    if tooth.edge_radius == 0.0:
        points.append(tooth.edge_centre[None])
        sizes.append(np.array([finest]))
    return Cloud(np.concatenate(points), np.concatenate(sizes), grading.growth)


@dataclass(frozen=True)
class _Rays:
    """Sizes along the two straight sides of the half sector: the cloud's, but no more than `coarsest` [m] and half the
    width of the sector, which narrows inwards."""

    cloud: Cloud
    half: float  # angle of the half sector [rad]
    coarsest: float
    even: bool

    def size(self, radius: Array, angle: float) -> Array:
        width = 2 * radius * sin(self.half / 2)
        return np.minimum(np.minimum(self.coarsest, width), self.cloud.at(radius[:, None] * radial(angle)))

    def axis(self, hub_radius: float, tip_radius: float) -> Chain:
        """Nodes of the tooth's axis, from the hub outwards."""
        reach = size_samples(tip_radius - hub_radius, lambda t: self.size(hub_radius + t, 0.0))
        corners, mids = (hub_radius + part for part in spaced_nodes(*reach, even=self.even))
        return Chain(corners[:, None] * radial(0.0), mids[:, None] * radial(0.0))


def half_boundary(tooth: Profile, hub_radius: float, element_size: float, grading: Grading = DEFAULT) -> HalfBoundary:
    """Nodes around the half sector between the tooth's axis and the middle of the next tooth space.

    Outline nodes, mid-sides included, lie on the exact profile at the middle of the arc length; hub nodes on
    the hub circle. `element_size` [m] holds on flank and fillet.
    """
    half = pi / tooth.teeth
    rim = tooth.root_radius - hub_radius
    pieces, cloud = graded_outline(tooth, element_size, grading)
    rays = _Rays(cloud, half, max(element_size, min(COARSE * element_size, rim / 6)), grading.even)
    depth, along = size_samples(rim, lambda t: rays.size(tooth.root_radius - t, half))
    wanted = float(np.sum(0.5 * (1 / along[1:] + 1 / along[:-1]) * np.diff(depth)))
    if wanted < grading.cut_edges:
        # A thin rim: refine what lies beside it too, or the triangles there would be flat.
        along = along * (wanted / grading.cut_edges)
        cloud = cloud.and_at((tooth.root_radius - depth)[:, None] * radial(half), along)
        rays = replace(rays, cloud=cloud)
    spaced = spaced_nodes(depth, along, grading.cut_edges, even=grading.even)
    corners, mids = (tooth.root_radius - part for part in spaced)
    cut = Chain(corners[:, None] * radial(half), mids[:, None] * radial(half))
    axis = rays.axis(hub_radius, tooth.tip_radius)
    return HalfBoundary(outline_nodes(pieces, cloud, grading.even), cut, _hub(cloud, hub_radius, rays, grading), axis)


def refined_boundary(
    tooth: Profile, beside: HalfBoundary, element_size: float, at: Array, sizes: Array, grading: Grading = DEFAULT
) -> HalfBoundary:
    """Half a sector that shares cut and hub circle with the sectors `beside` it, but has elements of `element_size` on
    its outline and of `sizes` (n,) at the points `at` (n, 2)."""
    pieces, cloud = graded_outline(tooth, element_size, grading)
    lengths = [np.linalg.norm(np.diff(chain.corners, axis=0), axis=1) for chain in (beside.cut, beside.hub)]
    cloud = cloud.and_at(at, sizes)
    for chain, length in zip((beside.cut, beside.hub), lengths, strict=True):
        cloud = cloud.and_at(chain.mids, length)
    rays = _Rays(cloud, pi / tooth.teeth, max(float(length.max()) for length in lengths), grading.even)
    axis = rays.axis(float(np.hypot(*beside.hub.corners[-1])), tooth.tip_radius)
    return HalfBoundary(outline_nodes(pieces, cloud, grading.even), beside.cut, beside.hub, axis)


def graded_outline(tooth: Profile, element_size: float, grading: Grading) -> tuple[list[Segment], Cloud]:
    """The outline's pieces and the sizes on them."""
    finest = tip_size(tooth, element_size) if grading.fine_tips else element_size
    pieces = _pieces(tooth, element_size, finest)
    return pieces, _outline_cloud(tooth, pieces, element_size, finest, grading)


def _size_on(piece: Segment, cloud: Cloud, t: Array) -> Array:
    return cloud.at(piece.points(t))


def outline_nodes(pieces: list[Segment], cloud: Cloud, even: bool = False) -> Chain:
    """Nodes of the outline; every joint of two pieces is a corner."""
    corners, mids = [], []
    for piece in pieces:
        reach = size_samples(piece.length, partial(_size_on, piece, cloud))
        nodes, between = spaced_nodes(*reach, 2 if piece.name == "tip edge" else 1, even=even)
        corners.append(piece.points(nodes)[:-1])
        mids.append(piece.points(between))
    last = pieces[-1]
    corners.append(last.points(np.array([last.length])))
    return Chain(np.concatenate(corners), np.concatenate(mids))


def _hub(cloud: Cloud, radius: float, rays: _Rays, grading: Grading) -> Chain:
    """Nodes of the hub circle from the cut back to the axis."""
    half = rays.half

    def size(t: Array) -> Array:
        return np.minimum(min(rays.coarsest, grading.bend * radius), cloud.at(radius * radial(half - t / radius)))

    corners, mids = (half - part / radius for part in spaced_nodes(*size_samples(radius * half, size), even=rays.even))
    return Chain(radius * radial(corners), radius * radial(mids))

"""The inside of a sector: gmsh fills a closed polygon with triangles or quadrilaterals, the middles of their sides
follow. The only user of gmsh.

gmsh sees straight boundary edges; order two is raised here, so that every boundary node, mid-side nodes included, lies
on the exact profile.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.mesh.grading import DEFAULT, Chain

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_GMSH = threading.Lock()  # gmsh keeps global state
_OPTIONS = (
    ("General.Terminal", 0),
    ("General.NumThreads", 1),  # hence the same mesh every time
    ("Mesh.Algorithm", 6),  # frontal Delaunay
    ("Mesh.MeshSizeExtendFromBoundary", 1),
    ("Mesh.MeshSizeFromPoints", 0),
    ("Mesh.MeshSizeFromCurvature", 0),
    ("Mesh.Smoothing", 10),
)


class MeshingUnavailable(ImportError):
    """gmsh cannot be loaded; the sentence says what to install."""


def _import_gmsh() -> Any:
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise MeshingUnavailable(
            f"gmsh cannot be loaded ({error}); on Debian it needs the packages libgl1 libegl1 libglu1-mesa"
            " libxcursor1 libxft2 libxinerama1 libgomp1"
        ) from error
    return gmsh


def _initialize(gmsh: Any) -> None:
    """Begin gmsh's session. It lets a write to a closed pipe kill the process; here that stays an error."""
    before = signal.getsignal(signal.SIGPIPE) if hasattr(signal, "SIGPIPE") else None
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    if before is not None:
        with suppress(ValueError):  # only the main thread may set it
            signal.signal(signal.SIGPIPE, before)


@contextmanager
def gmsh_session() -> Iterator[Any]:
    """gmsh, for one thread at a time; someone else's session is left as it was. Raises MeshingUnavailable."""
    gmsh = _import_gmsh()
    with _GMSH:
        ours = not gmsh.isInitialized()
        if ours:
            _initialize(gmsh)
        before = [] if ours else [(option, gmsh.option.getNumber(option)) for option, _ in _OPTIONS]
        current = "" if ours else gmsh.model.getCurrent()
        try:
            for option, value in _OPTIONS:
                gmsh.option.setNumber(option, value)
            yield gmsh
        finally:
            if ours:
                gmsh.finalize()
            else:
                for option, value in before:
                    gmsh.option.setNumber(option, value)
                gmsh.model.setCurrent(current)


class Branch(NamedTuple):
    """An open polygon inside the ring along which elements have edges: from the ring's corner number `start` over the
    `points` (m, 2)."""

    start: int
    points: Array


def fill(ring: Array, *, recombine: bool = False, branch: Branch | None = None) -> tuple[Array, Index, Index]:
    """Triangulate inside the closed polygon `ring` (n, 2) without adding nodes to it.

    Returns corners (m, 2), the first of which are the ring and then the branch's points, triangles (k, 3),
    counter-clockwise, and, where `recombine` makes as many of them as it can, quadrilaterals (l, 4) of either sense.
    Sizes inside follow the ring's and, more strictly, the branch's. Raises MeshingUnavailable.
    """
    given = ring if branch is None else np.concatenate((ring, branch.points))
    scale = 1 / np.ptp(ring, axis=0).max()  # gmsh's tolerances are absolute
    with gmsh_session() as gmsh:
        gmsh.model.add("gearbench tooth sector")
        try:
            nodes = _geometry(gmsh, scale * given, len(ring), branch)
            if branch is None:
                gmsh.model.mesh.generate(2)
            else:
                gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
                gmsh.model.mesh.setSizeCallback(_sizes_from(_edges(given, len(ring), branch.start), scale))
                gmsh.model.mesh.generate(2)
                gmsh.model.mesh.removeSizeCallback()
            if recombine:
                gmsh.model.mesh.recombine()
            corners, triangles, quads = _found(gmsh, nodes, scale)
        finally:
            gmsh.model.remove()
    corners[: len(given)] = given
    return corners, _ccw(corners, triangles), quads


def _geometry(gmsh: Any, given: Array, count: int, branch: Branch | None) -> list[int]:
    """Hand the polygons' points to gmsh, the first `count` of them the ring's, every edge one element long; their
    tags."""
    geo, mesh = gmsh.model.geo, gmsh.model.mesh
    nodes = [geo.addPoint(x, y, 0.0) for x, y in given]
    lines = [geo.addLine(nodes[i], nodes[(i + 1) % count]) for i in range(count)]
    inner = [] if branch is None else [geo.addLine(a, b) for a, b in pairwise([nodes[branch.start], *nodes[count:]])]
    surface = geo.addPlaneSurface([geo.addCurveLoop(lines)])
    geo.synchronize()
    if inner:
        mesh.embed(1, inner, 2, surface)
    for line in (*lines, *inner):
        mesh.setTransfiniteCurve(line, 2)
    return nodes


def _edges(given: Array, count: int, start: int) -> Array:
    """Ends (m, 4) of the edges of ring and branch."""
    ring, along = given[:count], np.concatenate((given[start][None], given[count:]))
    return np.concatenate(
        (np.column_stack((ring, np.roll(ring, -1, axis=0))), np.column_stack((along[:-1], along[1:])))
    )


def _sizes_from(ends: Array, scale: float) -> Callable[[int, int, float, float, float, float], float]:
    """gmsh's callback, in its own scale, for sizes that grow from those of given edges (m, 4)."""
    middles = 0.5 * scale * (ends[:, :2] + ends[:, 2:])
    lengths = scale * np.hypot(*(ends[:, 2:] - ends[:, :2]).T)

    def size(dim: int, tag: int, x: float, y: float, z: float, before: float) -> float:
        away = np.hypot(middles[:, 0] - x, middles[:, 1] - y)
        return float(np.min(lengths + DEFAULT.growth * np.maximum(away - 0.5 * lengths, 0.0)))

    return size


def _found(gmsh: Any, nodes: Sequence[int], scale: float) -> tuple[Array, Index, Index]:
    """Corners, the given ones first, triangles and quadrilaterals of gmsh's mesh."""
    tags, flat, _ = gmsh.model.mesh.getNodes()
    elements = [gmsh.model.mesh.getElementsByType(kind)[1] for kind in (2, 3)]
    order = {int(gmsh.model.mesh.getNodes(0, node)[0][0]): i for i, node in enumerate(nodes)}
    for tag in tags:
        order.setdefault(int(tag), len(order))
    corners = np.empty((len(order), 2))
    for tag, point in zip(tags, flat.reshape(-1, 3), strict=True):
        corners[order[int(tag)]] = point[:2] / scale
    triangles, quads = (
        np.array([order[int(tag)] for tag in found], dtype=np.int64).reshape(-1, sides)
        for found, sides in zip(elements, (3, 4), strict=True)
    )
    return corners, triangles, quads


def _ccw(points: Array, triangles: Index) -> Index:
    """The triangles (m, 3) with their corners counter-clockwise."""
    one, two = (
        points[triangles[:, 1]] - points[triangles[:, 0]],
        points[triangles[:, 2]] - points[triangles[:, 0]],
    )
    swap = one[:, 0] * two[:, 1] < one[:, 1] * two[:, 0]
    turned = triangles.copy()
    turned[swap] = turned[swap][:, [0, 2, 1]]
    return turned


def raise_order(
    corners: Array, cells: Index, sides: Sequence[Chain], lines: Sequence[Index] = ()
) -> tuple[Array, Index, list[Index]]:
    """Mid-side nodes of cells (m, k): straight inside, the given ones on the `sides` around them.

    Returns points, cells (m, 2 k) and the edges (n, 3) corner, corner, middle of each side, then of each of the inner
    `lines`, which are given by their corners.
    """
    k = cells.shape[1]
    edges = np.sort(cells[:, [[i, (i + 1) % k] for i in range(k)]].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middles = 0.5 * (corners[unique[:, 0]] + corners[unique[:, 1]])
    number = {(int(a), int(b)): i for i, (a, b) in enumerate(unique)}

    def walked(nodes: Index) -> Index:
        index = np.array([number[min(a, b), max(a, b)] for a, b in pairwise(nodes.tolist())])
        return np.column_stack((nodes[:-1], nodes[1:], len(corners) + index))

    found, start = [], 0
    ring = sum(len(chain.mids) for chain in sides)
    for chain in sides:
        found.append(walked((start + np.arange(len(chain.corners))) % ring))
        middles[found[-1][:, 2] - len(corners)] = chain.mids
        start += len(chain.mids)
    return (
        np.concatenate((corners, middles)),
        np.column_stack((cells, len(corners) + inverse.reshape(-1, k))),
        found + [walked(line) for line in lines],
    )


def ring_of(sides: Sequence[Chain]) -> Array:
    """The corners (n, 2) of the closed polygon of several sides, each starting where the one before ends."""
    return np.concatenate([chain.corners[:-1] for chain in sides])


def walk(edges: Index) -> Index:
    """Node numbers along a chain of edges (k, 3), middles included."""
    return np.append(edges[:, [0, 2]].ravel(), edges[-1, 1])

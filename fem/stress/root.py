"""Root stress: what a force on a flank does to the fillets of its own and the neighbouring teeth.

A fillet is free, so its stress has one component, along the boundary; where that is tension it is the largest principal
stress. It follows from the strain of the boundary itself, sigma = E' eps + nu' sigma_n, which quadratic elements give
best at the two Gauss points of an edge: no extrapolation from inside, hence errors of a higher order.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gearbench.fem.gear.flamant import LineLoad
from gearbench.fem.gear.flexibility import REACH, flank_loads, kernel_samples, regular_forces, regular_motion
from gearbench.fem.gear.ring import ring_response
from gearbench.fem.stress.fields import ElasticGear
from gearbench.fem.stress.loaded import PairLoad
from gearbench.geometry.pair.numbering import sector_of

Array = NDArray[np.float64]

GAUSS = np.array([0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5])


@dataclass(frozen=True)
class RootKernel:
    """Stress along the working side's root per force per unit thickness [1/m].

    s (n,), last: arc lengths of the loads on the working flank, as in `CondensedGear`; levers (n,) of these loads [m];
    points (k, 2) [m] of the root, from the flank to the middle of the tooth space, in the tooth's frame; angle (k,)
    [rad] between the root's tangent and the tooth's axis; front, back (2 reach + 1, n, k): stress in the root of the
    tooth that lies m - reach teeth counter-clockwise of the one loaded on its working (back) flank; width: thickness of
    the gear [m].
    """

    s: Array
    last: int
    levers: Array
    points: Array
    angle: Array
    front: Array
    back: Array
    width: float

    @property
    def reach(self) -> int:
        """Number of neighbouring teeth kept on either side."""
        return (len(self.front) - 1) // 2

    @cached_property
    def _splines(self) -> tuple[tuple[CubicSpline, CubicSpline], tuple[CubicSpline, CubicSpline]]:
        """Of working and back flank: on the involute, and on the tip edge, where the flank's normal turns."""
        def pieces(table: Array) -> tuple[CubicSpline, CubicSpline]:
            i = self.last
            return (
                CubicSpline(self.s[: i + 1], table[:, : i + 1], axis=1),
                CubicSpline(self.s[i:], table[:, i:], axis=1),
            )

        return pieces(self.front), pieces(self.back)

    def of_moment(self, side: int, s: float, apart: int) -> Array:
        """Stress (k,) in the root of the tooth `apart` teeth counter-clockwise of the one loaded at s, per moment of
        the force about the gear's axis and unit thickness [1/m^2]."""
        if abs(apart) > self.reach:
            return np.zeros(len(self.angle))
        flank, edge = self._splines[side]
        at = min(max(s, float(self.s[0])), float(self.s[-1]))
        # Forces are known by their levers, and the own normal of the flank may be off. Its lever vanishes towards the
        # end of the tip edge: what is interpolated is the stress, never its ratio to that.
        i = self.last
        lever = CubicSpline(self.s[i:], self.levers[i:])(at) if at > self.s[i] else self.levers[i]
        return np.asarray((edge if at > self.s[i] else flank)(at)[apart + self.reach] / lever)


@dataclass(frozen=True)
class RootEdges:
    """The Gauss points of the root's boundary edges on the working side, two an edge: nodes (k, 3) of their edges,
    derivatives of the three shape functions by arc length (k, 3) [1/m], points, unit tangents and outward normals
    (k, 2)."""

    nodes: NDArray[np.int64]
    slopes: Array
    points: Array
    tangents: Array
    normals: Array


def root_edges(gear: ElasticGear) -> RootEdges:
    """Fillet and root land on the working side, from the flank on."""
    edges, points = gear.mesh.boundary_edges, gear.mesh.points
    radius = np.hypot(*points.T)
    below = np.all(radius[edges] <= gear.shape.form_radius * (1 + 1e-9), axis=1)
    own = edges[below & (points[edges[:, 2], 1] > 0.0)]
    own = np.repeat(own, 2, axis=0)
    xi = np.tile(GAUSS, len(own) // 2)[:, None]
    shape = np.hstack([(1 - xi) * (1 - 2 * xi), xi * (2 * xi - 1), 4 * xi * (1 - xi)])
    slope = np.hstack([4 * xi - 3, 4 * xi - 1, 4 - 8 * xi])
    at = np.einsum("ka,kac->kc", shape, points[own])
    tangent = np.einsum("ka,kac->kc", slope, points[own])
    length = np.hypot(*tangent.T)[:, None]
    tangent = tangent / length
    # Edges run counter-clockwise, the material on their left.
    return RootEdges(own, slope / length, at, tangent, np.column_stack([tangent[:, 1], -tangent[:, 0]]))


def root_kernel(gear: ElasticGear, width: float, spacing: float | None = None) -> RootKernel:
    """Solve for unit loads along the working flank of a gear of thickness `width` [m].

    spacing [m]: largest distance of the loads on the involute (None: module / 4).
    """
    shape = gear.shape
    s, last = kernel_samples(shape, spacing or shape.module / 4)
    root = root_edges(gear)
    reach = min(REACH, (gear.ring.teeth - 1) // 2)
    offsets = np.arange(-reach, reach + 1)
    loads = flank_loads(shape, s)

    def forces(j: int) -> Array:
        return regular_forces(gear.quadrature, loads.seen_from(j))

    hub_points = gear.mesh.points[gear.mesh.hub]

    def hub(j: int) -> Array:
        return regular_motion(hub_points, loads.seen_from(j), gear.moduli)

    found = ring_response(gear.ring, forces, hub, offsets % shape.teeth)
    front = np.empty((len(offsets), len(s), len(root.nodes)))
    back = np.empty_like(front)
    flip, mirror = np.array([1.0, -1.0]), gear.mesh.mirror
    assert mirror is not None  # stress is that of sound sectors
    for m, offset in enumerate(offsets):
        u = found[m].T.reshape(len(s), -1, 2)
        seen = loads.seen_from(int(offset))
        front[m] = _boundary_stress(gear, root, u, seen)
        # A load on the back flank is the mirror image: seen there, this root is on the other side.
        mirrored = RootEdges(
            mirror[root.nodes], root.slopes, root.points * flip, root.tangents * flip, root.normals * flip
        )
        back[len(offsets) - 1 - m] = _boundary_stress(gear, mirrored, u, seen)
    angle = np.arctan2(np.abs(root.tangents[:, 1]), np.abs(root.tangents[:, 0]))
    at, normal = shape.points(s), shape.normals(s)
    levers = at[:, 0] * normal[:, 1] - at[:, 1] * normal[:, 0]
    return RootKernel(s, last, levers, root.points, angle, front, back, width)


def _boundary_stress(gear: ElasticGear, root: RootEdges, regular: Array, loads: list[LineLoad]) -> Array:
    """Stress along a free boundary (loads, k) from the regular displacement (loads, n, 2) and the line loads' own."""
    slope = np.einsum("ka,lkac->lkc", root.slopes, regular[:, root.nodes])
    strain = np.einsum("lkc,kc->lk", slope, root.tangents)
    along = np.array([np.sum(one.traction(root.points, root.tangents) * root.tangents, axis=1) for one in loads])
    across = np.array([np.sum(one.traction(root.points, root.normals) * root.normals, axis=1) for one in loads])
    # The regular part's normal stress takes the line load's away.
    return np.asarray(gear.moduli.modulus * strain - gear.moduli.poisson * across + along)


def root_stress(kernel: RootKernel, pairs: list[PairLoad], teeth: int, gear: int, tooth: int) -> Array:
    """Stress (k,) [Pa] along the working root of one tooth (of gear 0: driver, 1: driven) under the loaded pairs."""
    own = sector_of(tooth, gear, teeth)
    total = np.zeros(len(kernel.angle))
    for one in pairs:
        k = one.contact
        s, lever = (k.s1, k.lever1) if gear == 0 else (k.s2, k.lever2)
        apart = (own - one.sector(gear, teeth) + teeth // 2) % teeth - teeth // 2
        total += one.force * lever / kernel.width * kernel.of_moment(one.side, s, apart)
    return total


def peak(kernel: RootKernel, stress: Array) -> tuple[float, float, float]:
    """Largest tension [Pa] along a root, the radius [m] where it is and the angle [rad] between its tangent and the
    tooth's axis; between the samples by a parabola."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(kernel.points, axis=0).T))])
    i = int(np.clip(np.argmax(stress), 1, len(stress) - 2))
    window = slice(i - 1, i + 2)
    a, b, c = np.polyfit(along[window] - along[i], stress[window], 2)
    x = float(np.clip(-b / (2 * a), along[i - 1] - along[i], along[i + 1] - along[i])) if a < 0 else 0.0
    place = along[i] + x
    at = np.array([np.interp(place, along, kernel.points[:, n]) for n in (0, 1)])
    return float(c + x * (b + a * x)), float(np.hypot(*at)), float(np.interp(place, along, kernel.angle))

"""The condensed gear: reciprocity, convergence, and the separated kernel against plain, finely resolved elements."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.fem.contact.kernel import cross_flexibility, grid_position, make_kernel, table_at
from gearbench.fem.gear.body import CondensedGear, _rigid_shapes, condense
from gearbench.fem.gear.elasticity import assemble, plane_moduli
from gearbench.fem.gear.flamant import LineLoad
from gearbench.fem.gear.flank import boundary_quadrature, flank_coordinate, flank_trace
from gearbench.fem.gear.flexibility import flank_kernels, kernel_samples
from gearbench.fem.gear.ring import make_ring, ring_response
from gearbench.geometry.mesh.sector_mesh import sector_mesh
from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.profile import profile
from gearbench.rig import Material

STEEL = Material()


def log_moment(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Integral of ln|t| from a to b."""
    return b * np.log(np.abs(b)) - a * np.log(np.abs(a)) - (b - a)


def test_flank_kernels_are_reciprocal(small: CondensedGear) -> None:
    """Maxwell and Betti: the field at s' of a load at s is that at s of a load at s', neighbours included."""
    centre = small.reach
    scale = np.abs(small.front[centre]).max()
    for m in range(small.reach + 1):
        difference = small.front[centre + m] - small.front[centre - m].T
        assert np.abs(difference).max() < 2e-4 * scale
        assert np.abs(difference).max() < 5e-4 * np.abs(small.front[centre + m]).max()
    for m in range(2 * small.reach + 1):
        # A back-flank load is the mirror image of a working-flank one, so these tables are symmetric.
        assert np.abs(small.back[m] - small.back[m].T).max() < 5e-4 * np.abs(small.back[m]).max()


# Element size (of the module) and the reach of the largest error of the kernel, over its largest value.
REFINEMENT = [(1 / 4, 5e-4), (1 / 8, 2.5e-4), (1 / 12, 1.5e-4)]


@pytest.mark.validation
def test_the_kernel_converges_with_the_mesh(gear: Any) -> None:
    wheel = gear()
    fine = condense(wheel, STEEL, wheel.module / 20, 0)
    errors = []
    for size, reach in REFINEMENT:
        found = condense(wheel, STEEL, size * wheel.module, 0)
        error = max(
            np.abs(found.front - fine.front).max() / np.abs(fine.front).max(),
            np.abs(found.back - fine.back).max() / np.abs(fine.back).max(),
        )
        assert error < reach
        errors.append(error)
    assert errors[2] < errors[1] < errors[0]


def test_kernel_and_half_plane_equal_a_resolved_pressure_patch(gear: Any, small: CondensedGear) -> None:
    """Plain elements, seven to a pressure patch of 0.4 mm, without any separation of the singularity."""
    wheel = gear()
    shape, moduli = profile(wheel), plane_moduli(STEEL)
    mesh = sector_mesh(shape, wheel, 6e-5)
    ring = make_ring(mesh, *assemble(mesh, moduli))
    quadrature = boundary_quadrature(shape, mesh)
    at = flank_coordinate(shape, quadrature.points)
    half = 2e-4
    middles = np.array([0.5 * (shape.s_form + shape.s_end), shape.s_end - 3e-4])

    def pressure(t: np.ndarray) -> np.ndarray:
        return np.where(np.abs(t) < 1, (1 - t**2) ** 2, 0.0)

    loads = [
        quadrature.load @ (-np.nan_to_num(pressure((at - s0) / half))[:, None] * quadrature.normals).ravel()
        for s0 in middles
    ]
    force = np.array(loads).T
    none, held = np.zeros_like(force), np.zeros((len(ring.hub), 2))
    u = ring_response(ring, lambda j: force if j == 0 else none, lambda j: held, np.array([0, 1]))
    kernel = make_kernel(small)
    for k, s0 in enumerate(middles):
        s = s0 + np.array([-5e-4, -2e-4, -1e-4, 0.0, 1e-4, 1.5e-4])
        edges = np.linspace(s0 - half, s0 + half, 201) + 1e-9
        cell = 0.5 * (edges[1:] + edges[:-1])
        weight = pressure((cell - s0) / half)
        x, y = ([grid_position(kernel, v) for v in points] for points in (cell, s))

        def summed(table: np.ndarray, x: list = x, y: list = y, weight: np.ndarray = weight) -> np.ndarray:
            values = np.array([[table_at(table, a, b) for a in x] for b in y]) * kernel.width
            return values @ weight * (2 * half / 200)

        singular = np.array([weight @ log_moment(edges[:-1] - v, edges[1:] - v) for v in s])
        own = summed(kernel.front[kernel.reach]) - 2 / (np.pi * moduli.modulus) * singular
        for expected, side, tooth in (
            (own, 0, 0),
            (summed(kernel.back[kernel.reach]), 1, 0),
            (summed(kernel.front[kernel.reach + 1]), 0, 1),
        ):
            trace = flank_trace(shape, mesh, s, side)
            np.testing.assert_allclose(trace @ u[tooth][:, k], expected, rtol=2e-3)


def test_the_hub_balances_a_flank_load(coarse: Any) -> None:
    """Reaction of the regular field and of Flamant's stress on the hub circle against the unit load itself.

    The nodal forces are in balance to rounding (test_ring); what remains is the quadrature of Flamant's stress.
    """
    ring, mesh, shape = coarse.ring, coarse.sector, coarse.shape
    teeth = ring.teeth
    s0 = 0.6 * shape.s_form + 0.4 * shape.s_end
    point, normal = shape.points(s0), shape.normals(s0)
    quadrature = boundary_quadrature(shape, mesh)
    rigid = _rigid_shapes(mesh.points, teeth)
    applied = np.array([-normal[0], -normal[1], -(point[0] * normal[1] - point[1] * normal[0])])

    def load(j: int) -> LineLoad:
        c, s = np.cos(2 * np.pi * j / teeth), np.sin(2 * np.pi * j / teeth)
        back = np.array([[c, s], [-s, c]])
        space = np.array([np.cos(np.pi / teeth), np.sin(np.pi / teeth)])
        return LineLoad(back @ point, -(back @ normal), back @ space)

    def forces(j: int) -> np.ndarray:
        t = -load(j).traction(quadrature.points, quadrature.normals).ravel()
        return (quadrature.load @ t)[:, None]

    hub_points = mesh.points[mesh.hub]

    def hub(j: int) -> np.ndarray:
        return -load(j).displacement(hub_points, coarse.moduli.modulus, coarse.moduli.poisson).ravel()[:, None]

    u = ring_response(ring, forces, hub, np.arange(teeth))
    reaction = np.zeros(3)
    for j in range(teeth):
        nodal = (ring.stiffness[ring.hub] @ u[j] - forces(j)[ring.hub])[:, 0]
        reaction += rigid[:, j][:, ring.hub] @ nodal
    x, w = np.polynomial.legendre.leggauss(400)
    radius = coarse.gear.hub_radius
    around = radius * np.column_stack([np.cos(np.pi * x), np.sin(np.pi * x)])
    traction = load(0).traction(around, -around / radius)
    line = w * np.pi * radius
    reaction += [
        line @ traction[:, 0],
        line @ traction[:, 1],
        line @ (around[:, 0] * traction[:, 1] - around[:, 1] * traction[:, 0]),
    ]
    np.testing.assert_allclose(reaction[:2], -applied[:2], atol=1e-6)
    assert reaction[2] == pytest.approx(-applied[2], rel=1e-5)


def refined(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every P2 triangle cut into four on its own curved map, nodes merged."""
    lattice = np.array([(i / 4, j / 4) for j in range(5) for i in range(5 - j)])
    r, s = lattice.T
    t = 1 - r - s
    n = np.column_stack([t * (2 * t - 1), r * (2 * r - 1), s * (2 * s - 1), 4 * t * r, 4 * r * s, 4 * s * t])
    number = {(round(4 * a), round(4 * b)): k for k, (a, b) in enumerate(lattice)}

    def child(a: tuple, b: tuple, c: tuple) -> list[int]:
        middle = [((p[0] + q[0]) // 2, (p[1] + q[1]) // 2) for p, q in ((a, b), (b, c), (c, a))]
        return [number[v] for v in (a, b, c, *middle)]

    children = [
        child((0, 0), (2, 0), (0, 2)),
        child((2, 0), (4, 0), (2, 2)),
        child((0, 2), (2, 2), (0, 4)),
        child((2, 2), (0, 2), (2, 0)),
    ]
    every = np.einsum("la,mac->mlc", n, points[triangles])
    _, first, inverse = np.unique(
        np.round(every.reshape(-1, 2) * 1e10).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    node = inverse.reshape(len(triangles), len(lattice))
    return every.reshape(-1, 2)[first], node[:, children].reshape(-1, 6)


def cut_sector(points: np.ndarray, triangles: np.ndarray, teeth: int, hub_radius: float) -> SectorMesh:
    """What the ring needs of a refined sector."""
    radius, angle = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    by_radius = np.argsort(radius, kind="stable")
    low, high = (by_radius[np.abs(angle[by_radius] + sign * np.pi / teeth) < 1e-9] for sign in (1, -1))
    hub = np.nonzero(radius < hub_radius * (1 + 1e-5))[0]
    return SectorMesh(points, triangles, teeth, low, high, hub, np.empty((0, 3), dtype=np.int64))


@pytest.mark.validation
def test_the_energy_of_a_loaded_tooth_converges_at_order_four(gear: Any) -> None:
    """A smooth body load on one tooth; quadratic elements halve twice on the same curved geometry.

    The energy error of quadratic elements falls with h^4 where the field is smooth.
    """
    wheel = gear(12, profile_shift=0.4, tip_edge_radius=4e-4, hub_radius=9e-3)
    shape, moduli = profile(wheel), plane_moduli(STEEL)
    mesh = sector_mesh(shape, wheel, wheel.module / 2.2)
    points, triangles = mesh.points, mesh.cells
    centre = np.array([shape.reference_radius, 0.0])
    energy = []
    for level in range(3):
        if level:
            points, triangles = refined(points, triangles)
        cut = cut_sector(points, triangles, wheel.teeth, wheel.hub_radius)
        stiffness, mass = assemble(cut, moduli)
        ring = make_ring(cut, stiffness, mass)
        bump = np.exp(-np.sum(((points - centre) / wheel.module) ** 2, axis=1))
        force = (mass @ np.column_stack([0.3 * bump, -bump]).ravel())[:, None]
        none, held = np.zeros_like(force), np.zeros((len(ring.hub), 1))
        u = ring_response(ring, lambda j, f=force, n=none: n if j else f, lambda j, h=held: h, np.array([0]))
        energy.append(float(np.sum(force * u[0])))
    first, second = np.diff(energy)
    order = np.log2(first / second)
    assert 3.3 < order < 4.5
    assert abs(second) < 3e-5 * energy[-1]


def test_kernel_samples_cover_flank_and_tip_edge(gear: Any) -> None:
    shape = profile(gear())
    s, last = kernel_samples(shape, 4e-4)
    assert np.all(np.diff(s) > 0)
    assert s[0] == pytest.approx(shape.s_form, abs=2e-9)
    assert s[last] == pytest.approx(shape.s_end, abs=1e-15)
    assert s[-1] == pytest.approx(shape.s_tip, abs=1e-15)
    assert np.diff(s[: last + 1]).max() <= 1.01 * 4e-4


def test_resampling_keeps_the_kernel(small: CondensedGear) -> None:
    """Interpolated values at the samples themselves, both pieces, front and back."""
    kernel = make_kernel(small)
    scale = np.abs(small.front).max() / small.face_width
    for i in range(1, len(small.s), 3):
        x = grid_position(kernel, small.s[i])
        for j in range(1, len(small.s), 3):
            y = grid_position(kernel, small.s[j])
            own = table_at(kernel.front[kernel.reach], x, y)
            assert own == pytest.approx(small.front[small.reach, i, j] / small.face_width, abs=5e-4 * scale)
            for apart in (-1, 1):
                expected = small.front[small.reach + apart, i, j] / small.face_width
                got = cross_flexibility(kernel, 0, x, 0, y, apart)
                assert got == pytest.approx(expected, abs=2e-4 * scale)
                expected = small.back[small.reach + apart, i, j] / small.face_width
                got = cross_flexibility(kernel, 0, x, 1, y, apart)
                assert got == pytest.approx(expected, abs=2e-4 * scale)
    assert cross_flexibility(kernel, 0, x, 0, x, small.reach + 1) == 0.0


def test_back_loads_mirror_front_loads(small: CondensedGear) -> None:
    """A load on the back flank moves the working flank m teeth on as the reverse does m teeth back (Betti)."""
    kernel = make_kernel(small)
    a, b = grid_position(kernel, small.s[4]), grid_position(kernel, small.s[12])
    for apart in (-2, -1, 0, 1, 2):
        there = cross_flexibility(kernel, 1, a, 0, b, apart)
        back = cross_flexibility(kernel, 0, b, 1, a, -apart)
        assert there == pytest.approx(back, rel=1e-3)


def test_hub_coupling_and_mode_traces_belong_to_the_same_modes(small: CondensedGear) -> None:
    """A mode without nodal diameters moves every tooth alike; with one, teeth follow a full cosine."""
    assert np.all(np.diff(small.omega) > -1e-6 * small.omega[0])
    torsion = int(np.argmax(np.abs(small.mode_hub[:, 2])))
    front = small.mode_front[torsion]
    np.testing.assert_allclose(front, np.broadcast_to(front[0], front.shape), atol=1e-9 * np.abs(front).max())
    shaking = int(np.argmax(np.abs(small.mode_hub[:, 0])))
    spectrum = np.abs(np.fft.rfft(small.mode_front[shaking], axis=0))
    assert spectrum[1].min() > 1e6 * np.delete(spectrum, 1, axis=0).max()


def test_flank_kernels_scale_with_one_over_modulus(coarse: Any) -> None:
    """Twice as stiff a material halves G, but for the constant that the logarithm's unit leaves: none here."""
    s = np.linspace(coarse.shape.s_form + 1e-6, coarse.shape.s_end - 1e-6, 4)
    front, _ = flank_kernels(coarse.ring, coarse.sector, coarse.shape, coarse.moduli, s)
    stiffer = plane_moduli(Material(youngs_modulus=2 * STEEL.youngs_modulus))
    ring = make_ring(coarse.sector, *assemble(coarse.sector, stiffer))
    half, _ = flank_kernels(ring, coarse.sector, coarse.shape, stiffer, s)
    np.testing.assert_allclose(2 * half, front, rtol=1e-9)

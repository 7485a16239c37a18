"""Fields inside a loaded gear: the whole gear solved directly, equilibrium of parts, Hertz below a contact."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from gearbench.fem.contact.static import ContactError, position, solve_torque
from gearbench.fem.stress import loaded as loaded_module
from gearbench.fem.stress.fields import (
    ElasticGear,
    GearField,
    elastic_gear,
    gear_field,
    loaded_sectors,
    regular_loads,
)
from gearbench.fem.stress.loaded import PairLoad, all_strips, pair_loads, pressed_teeth
from gearbench.fem.stress.recovery import principal
from gearbench.geometry.tooth.fillet import rotation
from gearbench.rig import Material

Array = NDArray[np.float64]

TORQUE = 120.0
STEEL = Material()


@pytest.fixture(scope="module")
def wheel(unequal: Any) -> ElasticGear:
    return elastic_gear(unequal.rig.driver, STEEL, 0.5e-3)


def loaded(unequal: Any, phase: float) -> list[PairLoad]:
    return pair_loads(unequal.law, phase, solve_torque(unequal.law, phase, TORQUE))


@pytest.fixture(scope="module")
def field(unequal: Any, wheel: ElasticGear) -> GearField:
    """All sectors of the driver where two pairs carry."""
    pressed, _ = pressed_teeth(unequal.law, (unequal.pair.driver, unequal.pair.driven), loaded(unequal, -0.5))
    assert len(pressed) == 2
    return gear_field(wheel, all_strips(20, pressed), range(20))


def total_stress(field: GearField, sector: int, at: Array, regular: Array) -> Array:
    return field.strips_in(sector).stress(at) + regular


@pytest.mark.parametrize("phase", [-0.5, 0.0, 0.2, 0.35])
def test_pressures_carry_the_static_solutions_moments(unequal: Any, phase: float) -> None:
    pairs = loaded(unequal, phase)
    both = pressed_teeth(unequal.law, (unequal.pair.driver, unequal.pair.driven), pairs)
    for gear, (teeth, pressed) in enumerate(zip((20, 30), both, strict=True)):
        moment = -sum(p.strips.moment.sum() for p in pressed) * 0.02
        levers = [p.contact.lever1 if gear == 0 else p.contact.lever2 for p in pairs]
        assert moment == pytest.approx(sum(p.force * x for p, x in zip(pairs, levers, strict=True)), rel=1e-12)
        assert all_strips(teeth, pressed).moment.sum() * 0.02 == pytest.approx(-moment, rel=1e-12)
        # Scaling to that moment leaves action and reaction equal to a few in ten thousand.
        for one, p in zip(pairs, pressed, strict=True):
            assert np.hypot(*p.strips.force) * 0.02 == pytest.approx(one.force, rel=2e-3)


@pytest.mark.validation
def test_sectors_equal_the_whole_gear_solved_at_once(coarse: Any, unequal: Any) -> None:
    """Same loads on the full mesh, assembled by scikit-fem and solved directly."""
    gear = elastic_gear(coarse.gear, STEEL, coarse.gear.module / 3)
    pressed, _ = pressed_teeth(unequal.law, (unequal.pair.driver, unequal.pair.driven), loaded(unequal, -0.5))
    strips = all_strips(20, pressed)
    found = gear_field(gear, strips, (19, 0, 1, 7))
    full, size = coarse.full, 2 * len(coarse.full.points)
    force, held = np.zeros((size // 2, 2)), np.zeros((size // 2, 2))
    for j in range(20):
        f, hub = regular_loads(gear, strips, j)
        turn = rotation(2 * pi * j / 20)
        np.add.at(force, full.node_of[j], f.reshape(-1, 2) @ turn.T)
        held[full.node_of[j][gear.mesh.hub]] = hub.reshape(-1, 2) @ turn.T
    fixed = (2 * full.hub[:, None] + np.arange(2)).ravel()
    free = np.setdiff1d(np.arange(size), fixed)
    u = held.ravel()
    k = coarse.stiffness
    u[free] = splu(k[free][:, free].tocsc()).solve(force.ravel()[free] - k[free][:, fixed] @ u[fixed])
    for j, own in zip(found.sectors, found.displacement, strict=True):
        exact = u.reshape(-1, 2)[full.node_of[j]] @ rotation(2 * pi * j / 20)
        assert np.abs(own - exact).max() < 1e-8 * np.abs(u).max()


def test_the_hub_takes_the_load(field: GearField, wheel: ElasticGear) -> None:
    """Reactions of the regular part's mesh, and the half-plane's traction on the hub circle."""
    force, moment = np.zeros(2), 0.0
    ring, hub = wheel.ring, wheel.mesh.points[wheel.mesh.hub]
    angle = np.linspace(-pi, pi, 4001)[:-1] + pi / 4000
    around = np.column_stack([np.cos(angle), np.sin(angle)])
    # From the gear's material outwards is towards the centre.
    pull = field.strips.traction(0.35 * 60e-3 * around, -around) * 0.35 * 60e-3 * (angle[1] - angle[0])
    force += pull.sum(axis=0)
    moment += 0.35 * 60e-3 * float(np.sum(around[:, 0] * pull[:, 1] - around[:, 1] * pull[:, 0]))
    for j, u in zip(field.sectors, field.displacement, strict=True):
        own = (ring.stiffness[ring.hub] @ u.ravel()).reshape(-1, 2)
        force += rotation(2 * pi * j / 20) @ own.sum(axis=0)
        moment += float(np.sum(hub[:, 0] * own[:, 1] - hub[:, 1] * own[:, 0]))
    applied = field.strips
    np.testing.assert_allclose(force, -applied.force, atol=1e-5 * np.hypot(*applied.force))
    assert moment == pytest.approx(-float(applied.moment.sum()), rel=1e-5)
    assert moment * 0.02 == pytest.approx(TORQUE, rel=1e-5)


def simpson(at: Array, values: Array) -> Array:
    """Integral over a line of quadratic edges: corner, middle, corner, middle ... (n, c)."""
    length = np.hypot(*(at[2::2] - at[:-2:2]).T)
    return np.asarray(length / 6 @ (values[:-2:2] + 4 * values[1::2] + values[2::2]))


@pytest.mark.parametrize("sector", [0, 1])
def test_recovered_stress_balances_each_loaded_sector(field: GearField, wheel: ElasticGear, sector: int) -> None:
    """Traction over both cuts and the hub arc against the pressure on the tooth between them."""
    mesh = wheel.mesh
    stress = total_stress(field, sector, mesh.points, field.stress[sector])
    taken = np.zeros(2)
    for nodes, normal in (
        (mesh.cut_low, np.array([-np.sin(pi / 20), -np.cos(pi / 20)])),
        (mesh.cut_high, np.array([-np.sin(pi / 20), np.cos(pi / 20)])),
        (mesh.hub, None),
    ):
        at = mesh.points[nodes]
        n = -at / np.hypot(*at.T)[:, None] if normal is None else np.tile(normal, (len(nodes), 1))
        s = stress[nodes]
        traction = np.column_stack([s[:, 0] * n[:, 0] + s[:, 2] * n[:, 1], s[:, 2] * n[:, 0] + s[:, 1] * n[:, 1]])
        taken += simpson(at, traction)
    own = field.strips_in(sector)
    here = np.abs(np.arctan2(own.middle[:, 1], own.middle[:, 0])) < pi / 20
    applied = (2 * own.half * own.mean * here) @ own.into
    if sector == 0:
        assert np.hypot(*applied) > 1e4
    np.testing.assert_allclose(taken, -applied, atol=4e-3 * np.hypot(*field.strips.force))


def test_free_surfaces_are_free(field: GearField, wheel: ElasticGear) -> None:
    """Traction on both fillets and the back flank of a loaded tooth, over the largest stress of its root."""
    mesh, stress = wheel.mesh, total_stress(field, 0, wheel.mesh.points, field.stress[0])
    radius = np.hypot(*mesh.points.T)
    end = radius[mesh.boundary_edges].max(axis=1)
    fillet = end < wheel.shape.form_radius
    back = (end < wheel.shape.end_radius) & (mesh.points[mesh.boundary_edges[:, 2], 1] < 0)
    root = np.abs(principal(stress[mesh.boundary_edges[fillet, 2]])).max()
    for first, last, middle in mesh.boundary_edges[fillet | back]:
        chord = mesh.points[last] - mesh.points[first]
        n = np.array([chord[1], -chord[0]]) / np.hypot(*chord)
        xx, yy, xy = stress[middle]
        assert np.hypot(xx * n[0] + xy * n[1], xy * n[0] + yy * n[1]) < 0.04 * root


def test_the_contact_stress_is_hertzs(unequal: Any, wheel: ElasticGear) -> None:
    """At the pitch point one pair carries: 0.300 p0 at a depth of 0.786 b, with elements 25 times as large as b.

    The tooth's own bending adds to that, in proportion to the load and not to its root: 7 % at 120 N m, so little here.
    """
    light = TORQUE / 60
    (one,) = pairs = pair_loads(unequal.law, 0.0, solve_torque(unequal.law, 0.0, light))
    pressed, _ = pressed_teeth(unequal.law, (unequal.pair.driver, unequal.pair.driven), pairs)
    field = gear_field(wheel, all_strips(20, pressed), (0,))
    rho = unequal.pair.driver.base_radius * np.tan(unequal.pair.working_pressure_angle)
    other = unequal.pair.line_of_action - rho
    load, modulus = one.force / 0.02, STEEL.youngs_modulus / 2
    half = np.sqrt(4 * load * rho * other / (rho + other) / (pi * modulus))
    p0 = 2 * load / (pi * half)
    shape = wheel.shape
    at, into = shape.points(one.contact.s1), -shape.normals(one.contact.s1)
    depth = np.linspace(0.02, 2.0, 100)
    x = at + half * depth[:, None] * into
    regular = field.stress[0][int(np.argmin(np.hypot(*(wheel.mesh.points - at).T)))]
    shear = -0.5 * np.diff(principal(total_stress(field, 0, x, regular)), axis=1)[:, 0]
    assert half < 0.5e-3 / 20
    assert shear.max() == pytest.approx(0.300 * p0, rel=0.015)
    assert depth[shear.argmax()] == pytest.approx(0.786, abs=0.05)


def test_displacement_joins_across_the_cut_and_closes_the_gap(unequal: Any, wheel: ElasticGear) -> None:
    """Where one pair carries, both flanks together give way by the DTE along the line of action."""
    pairs = loaded(unequal, 0.0)
    dte = solve_torque(unequal.law, 0.0, TORQUE)
    shapes = (unequal.pair.driver, unequal.pair.driven)
    both = pressed_teeth(unequal.law, shapes, pairs)
    gears = (wheel, elastic_gear(unequal.rig.driven, STEEL, 0.5e-3))
    yielded = 0.0
    for gear, pressed, s in zip(gears, both, (pairs[0].contact.s1, pairs[0].contact.s2), strict=True):
        found = gear_field(gear, all_strips(gear.shape.teeth, pressed), (0, 1))
        strips = found.strips_in(0)
        at, into = gear.shape.points(s)[None], -gear.shape.normals(s)
        i = int(np.argmin(np.hypot(*(gear.mesh.points - at).T)))
        # The regular part is smooth: that of the nearest node of a flank will do.
        u = strips.displacement(at, gear.moduli)[0] + found.displacement[0][i]
        yielded += float(u @ into)
        low = found.displacement[1][gear.mesh.cut_low] @ rotation(2 * pi / gear.shape.teeth).T
        np.testing.assert_allclose(low, found.displacement[0][gear.mesh.cut_high], atol=1e-14)
    assert yielded == pytest.approx(dte, rel=0.02)


def test_which_sectors() -> None:
    assert loaded_sectors([0, 19], 20, 2) == (0, 1, 2, 17, 18, 19)
    assert loaded_sectors([3], 20, None) == tuple(range(20))


def test_without_equilibrium_there_is_no_field(unequal: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    assert pair_loads(unequal.law, 0.0, -1e-6) == []
    monkeypatch.setattr(loaded_module, "position", lambda *given: position(*given)._replace(converged=False))
    with pytest.raises(ContactError, match="no static equilibrium at mesh phase 0 and DTE 1e-05 m"):
        pair_loads(unequal.law, 0.0, 1e-5)

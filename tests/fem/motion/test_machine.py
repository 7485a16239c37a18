"""Equations of motion: where modes, hubs and tooth pairs meet."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numba
import numpy as np
import pytest

from gearbench.fem.contact.coupling import coupling
from gearbench.fem.contact.kernel import cross_flexibility, grid_position
from gearbench.fem.contact.law import find_pairs, make_law
from gearbench.fem.gear.body import CondensedGear, condense
from gearbench.fem.motion.machine import contact_rows, make_machine, mass_matrix, modal_flexibility
from gearbench.geometry.tooth.body import body
from gearbench.rig import Load


def machine_of(elastic: Any, boundary: str = "torque") -> Any:
    rig = elastic.rig.model_copy(update={"load": Load(boundary=boundary)})
    pair, density = elastic.pair, rig.material.density
    bodies = (body(pair.driver, rig.driver, density), body(pair.driven, rig.driven, density))
    return make_machine(rig, pair, elastic.law, elastic.gears, bodies, 10.0), bodies


def test_contact_rows_are_the_gaps_derivatives(unequal: Any) -> None:
    machine, _ = machine_of(unequal)
    law = unequal.law
    q = np.array([0.45 * law.driver.pitch + 1e-5 / law.driver.rb, 0.45 * law.driven.pitch, 2e-5, -1e-5])

    def gaps(q: np.ndarray) -> dict:
        pairs = find_pairs(law, q[0], q[1], law.centre, q[3] - q[2], 5e-4)
        return {(pair["side"], pair["tooth"]): pair["gap"] for pair in pairs}

    pairs = find_pairs(law, q[0], q[1], law.centre, q[3] - q[2], 4e-4)
    rows = contact_rows(machine, pairs)
    assert len(pairs) >= 3 and 1 in pairs["side"]
    for k, step in enumerate((1e-6, 1e-6, 1e-7, 1e-7)):
        up, down = gaps(q + step * np.eye(4)[k]), gaps(q - step * np.eye(4)[k])
        for p, pair in enumerate(zip(pairs["side"], pairs["tooth"], strict=True)):
            assert rows[p, k] == pytest.approx((up[pair] - down[pair]) / (2 * step), rel=1e-4, abs=1e-4)


def test_modes_and_coupling_count_the_teeth_alike(gear: Any, twins: Any) -> None:
    """On a gear with a slender hub the coupling of two pairs is that of the lowest modes (torsion, shaking).

    Both flank sides and neighbouring teeth: a wrong tooth, sense or sign puts other modes' values there.
    """
    slender = condense(gear(hub_radius=3e-3), twins.rig.material, 0.7e-3, 30)
    curves = twins.law.curves[:2]
    law = make_law(twins.pair, slender, slender, twins.rig.material, curves=curves)
    rig = twins.rig.model_copy(update={"driver": gear(hub_radius=3e-3), "driven": gear(hub_radius=3e-3)})
    bodies = tuple(body(twins.pair.driver, rig.driver, rig.material.density) for _ in range(2))
    machine = make_machine(rig, twins.pair, law, (slender, slender), bodies, 1.0)
    at = 0.5 * law.driver.pitch
    pairs = find_pairs(law, at, at, law.centre, 0.0, 2e-4)
    assert len(pairs) >= 3 and set(pairs["side"]) == {0, 1}
    rows = contact_rows(machine, pairs)
    modal = modal_flexibility(machine, rows)
    static = coupling(law, pairs)
    off = ~np.eye(len(pairs), dtype=bool)
    same = pairs["side"][:, None] == pairs["side"][None]
    scale = np.abs(static).max()
    assert np.abs(modal - static)[off].max() < 1e-2 * scale
    # Pushing both flanks the same way twists the hub, from opposite sides it does not.
    assert np.all(static[off & same] > 0)
    assert np.all(static[~same] < 0)


def test_coupling_takes_the_teeth_in_their_order(unequal: Any) -> None:
    """Driver teeth are numbered clockwise, driven ones counter-clockwise; a back pair is driven by the next tooth."""
    law = unequal.law
    k1, k2 = law.k1, law.k2
    pairs = find_pairs(law, 0.5 * law.driver.pitch, 0.5 * law.driven.pitch, law.centre, 0.0, 3e-4)
    c = coupling(law, pairs)
    number = {(int(pair["side"]), int(pair["tooth"])): p for p, pair in enumerate(pairs)}
    zero, one = number[0, 0], number[0, 1]

    def flexibility(p: int, q: int, apart1: int, apart2: int) -> float:
        load, at = pairs[q], pairs[p]
        one, two = (
            cross_flexibility(
                kernel,
                int(load["side"]),
                grid_position(kernel, s_load),
                int(at["side"]),
                grid_position(kernel, s),
                apart,
            )
            for kernel, s_load, s, apart in ((k1, load["s1"], at["s1"], apart1), (k2, load["s2"], at["s2"], apart2))
        )
        return one + two

    assert c[one, zero] == pytest.approx(flexibility(one, zero, -1, 1), rel=1e-12)
    assert c[zero, one] == pytest.approx(flexibility(zero, one, 1, -1), rel=1e-12)
    assert c[one, zero] != pytest.approx(flexibility(one, zero, 1, -1), rel=1e-2)
    behind = number[1, 0]
    assert c[behind, zero] == pytest.approx(flexibility(behind, zero, 0, 1), rel=1e-12)
    assert c[zero, behind] == pytest.approx(flexibility(zero, behind, 0, -1), rel=1e-12)


def test_the_mass_matrix_moves_the_gears_as_wholes(unequal: Any) -> None:
    """Positive definite; hub terms are total mass and inertia; the modes' share of a hub motion turns with the gear."""
    machine, bodies = machine_of(unequal)
    for theta1, theta2 in ((0.0, 0.0), (0.7, -0.4)):
        m = mass_matrix(machine, theta1, theta2)
        np.testing.assert_allclose(m, m.T)
        assert np.linalg.eigvalsh(m).min() > 0
        np.testing.assert_allclose(
            np.diag(m)[:4], [bodies[0].inertia, bodies[1].inertia, bodies[0].mass, bodies[1].mass]
        )
        n1 = machine.hub1.shape[1]
        for axis, hub, modes, chi in (
            (2, machine.hub1, slice(4, 4 + n1), unequal.pair.driver_angle + theta1),
            (3, machine.hub2, slice(4 + n1, None), np.pi + unequal.pair.driven_angle - theta2),
        ):
            # World +y, seen in the gear's frame.
            expected = hub[:2].T @ [np.sin(chi), np.cos(chi)]
            np.testing.assert_allclose(m[axis, modes], expected, atol=1e-12 * np.abs(hub).max())
        np.testing.assert_allclose(m[0, 4 : 4 + n1], machine.hub1[2])
        np.testing.assert_allclose(m[1, 4 + n1 :], -machine.hub2[2])


def test_supports_along_the_line_of_action_move_the_modes_along_it(unequal: Any) -> None:
    """The hub's coupling mass on the support's direction, seen in the frame of each gear."""
    support = unequal.rig.support.model_copy(update={"direction": "line-of-action"})
    rig = unequal.rig.model_copy(update={"support": support})
    tilted = replace(unequal, rig=rig)
    machine, _ = machine_of(tilted)
    alpha = unequal.pair.working_pressure_angle
    m = mass_matrix(machine, 0.3, 0.2)
    n1 = machine.hub1.shape[1]
    for axis, hub, modes, chi in (
        (2, machine.hub1, slice(4, 4 + n1), unequal.pair.driver_angle + 0.3),
        (3, machine.hub2, slice(4 + n1, None), np.pi + unequal.pair.driven_angle - 0.2),
    ):
        turn = np.array([[np.cos(chi), np.sin(chi)], [-np.sin(chi), np.cos(chi)]])
        expected = hub[:2].T @ turn @ [np.sin(alpha), np.cos(alpha)]
        np.testing.assert_allclose(m[axis, modes], expected, atol=1e-12 * np.abs(hub).max())


@pytest.mark.parametrize("side", [0, 1])
def test_every_tooth_sees_the_same_gear(unequal: Any, side: int) -> None:
    """One pitch on, the next tooth stands where this one stood: how its force shakes the hub has not changed.

    That holds only if teeth, modes and the sense of rotation are numbered alike.
    """
    machine, _ = machine_of(unequal)
    law = unequal.law
    seen = []
    for number in (0, 1, 2, 7):
        phase = 0.1 + number
        theta1, theta2 = phase * law.driver.pitch, phase * law.driven.pitch
        pairs = find_pairs(law, theta1, theta2, law.centre, 0.0, 3e-4)
        rows = contact_rows(machine, pairs)
        (p,) = np.flatnonzero((pairs["side"] == side) & (pairs["tooth"] == number))
        hubs = mass_matrix(machine, theta1, theta2)[:4, 4:]
        seen.append(hubs / machine.squares @ rows[p, 4:])
    for other in seen[1:]:
        np.testing.assert_allclose(other, seen[0], rtol=1e-6, atol=1e-9 * np.abs(seen[0]).max())


def test_prescribed_speed_leaves_one_rotation(unequal: Any) -> None:
    free, _ = machine_of(unequal)
    driven, _ = machine_of(unequal, "speed")
    assert (free.rotations, driven.rotations) == (2, 1)
    keep = np.delete(np.arange(len(free.mass)), 1)
    np.testing.assert_array_equal(mass_matrix(driven, 0.1, 0.2), mass_matrix(free, 0.1, 0.2)[np.ix_(keep, keep)])
    assert free.speed1 * 20 == pytest.approx(free.speed2 * 30) == pytest.approx(2 * np.pi * 10)


@pytest.mark.parametrize("kept", [0, 1, 3])
def test_loops_need_no_compiling_for_another_number_of_modes(unequal: Any, kept: int) -> None:
    """Loops are compiled for each layout of what they are given, a minute and more for those of the steps."""

    def few(gear: CondensedGear) -> CondensedGear:
        cut = {name: getattr(gear, name)[:kept] for name in ("omega", "mode_front", "mode_back", "mode_hub")}
        return replace(gear, **cut)

    one, two = (few(gear) for gear in unequal.gears)
    law = make_law(unequal.pair, one, two, unequal.rig.material, unequal.law.curves[:2])
    machine, _ = machine_of(replace(unequal, gears=(one, two), law=law))
    assert numba.typeof(machine) == numba.typeof(machine_of(unequal)[0])

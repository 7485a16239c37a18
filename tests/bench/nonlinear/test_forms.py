"""Flanks that depart from their involutes in the lumped model's law: against finite elements that have them in their
contact, and against two springs whose answer is written down."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.bench import BenchError
from gearbench.bench.elastic.rig import elastic_rig
from gearbench.bench.nonlinear.law_table import mesh_law, teeth_law
from gearbench.bench.refusals.effects import refuse_unknown
from gearbench.fem.contact.static import static_cycle
from gearbench.geometry import pair
from gearbench.geometry.pair.touching import touching_excess
from gearbench.lumped import LumpedError
from gearbench.lumped.nonlinear.forms import formed
from gearbench.lumped.nonlinear.law import MeshLaw, approach_grid
from gearbench.lumped.nonlinear.model import nonlinear_model
from gearbench.lumped.nonlinear.pressing import travel_under
from gearbench.lumped.nonlinear.tables import Motion, instants, tables
from gearbench.rig import Gear, Rig, Simulation, Support, Supports

Array = NDArray[np.float64]

# Coarse on purpose: law and comparison stand on the same condensed gears.
SIMULATION = Simulation(model="lumped", mesh_stiffness="finite-element", element_size=0.8e-3, modes=0)
TORQUES = (60.0, 130.0)
PHASE = np.arange(64) / 64
SLOPES = {"driver": {"profile_slope": 8e-6}, "driven": {"profile_slope": -3e-6}}
# A hollow flank whose tip stands proud, and one worn at its root.
FORM = (6e-6, 0.0, -4e-6, 0.0, 5e-6)
HOLLOW = {"driver": {"profile_form": FORM, "profile_form_diameter": (39e-3, 41e-3, 43e-3, 45e-3, 47e-3)}}
WORN = {"driven": {"wear": 2e-6, "wear_depth": (9e-6, 0.0), "wear_roll": (0.1, 0.5)}}
RELIEVED = {
    side: {"tip_relief": 12e-6, "tip_relief_start_diameter": diameter, "tip_relief_shape": "parabolic"}
    for side, diameter in (("driver", 45e-3), ("driven", 54.5e-3))
}

SHORT = {
    side: {"tip_relief": 25e-6, "tip_relief_start_diameter": diameter}
    for side, diameter in (("driver", 47e-3), ("driven", 55.5e-3))
}


def make_rig(flanks: dict[str, dict[str, Any]]) -> Rig:
    gear = {"module": 3e-3, "face_width": 0.02, "thinning": 30e-6}
    support = Support(stiffness=1e8)
    return Rig(
        driver=Gear(teeth=14, hub_radius=11e-3, profile_shift=0.3, **gear, **flanks.get("driver", {})),
        driven=Gear(teeth=17, hub_radius=15e-3, profile_shift=0.1, **gear, **flanks.get("driven", {})),
        support=Supports(driver=support, driven=support),
    )


def lumped_error(rig: Rig, simulation: Simulation = SIMULATION) -> Array:
    """Transmission error (torques, phases) [m] of the non-linear lumped model."""
    meshing = pair(rig)
    model = nonlinear_model(rig, meshing, mesh_law(rig, simulation, 150.0))
    at = instants(model, tables(model, Motion(cycles=1.0, entries=len(PHASE), step=1.0)), -1)
    force = np.array(TORQUES)[:, None] / meshing.driver.base_radius
    return travel_under(model.law, at, np.broadcast_to(force, (len(TORQUES), len(PHASE))))


def excess_of(rig: Rig, law: MeshLaw) -> Array:
    """What each pair's flanks have beside their involutes (phases, offsets) [m]."""
    return touching_excess(pair(rig), (rig.driver, rig.driven), law.rho1)


def elastic_error(rig: Rig) -> Array:
    """The same of finite elements, whose contact follows the real flanks."""
    return static_cycle(elastic_rig(rig, SIMULATION).law, PHASE, torque=list(TORQUES)).transmission_error


@pytest.mark.parametrize(("flanks", "within"), [(SLOPES, 0.08), (HOLLOW, 0.06), (WORN, 0.06)])
def test_forms_change_the_transmission_error_as_in_finite_elements(
    flanks: dict[str, dict[str, Any]], within: float
) -> None:
    changed = elastic_error(make_rig(flanks)) - elastic_error(make_rig({}))
    found = lumped_error(make_rig(flanks)) - lumped_error(make_rig({}))
    for true, here in zip(changed, found, strict=True):
        assert np.sqrt(np.mean((here - true) ** 2)) < within * np.sqrt(np.mean(true**2))
        assert np.std(here - true) < within * np.std(true)


@pytest.mark.parametrize(("flanks", "within"), [(RELIEVED, 0.02), (SHORT, 0.02)])
def test_reliefs_beside_the_table_do_what_those_in_it_do(flanks: dict[str, dict[str, Any]], within: float) -> None:
    """Pairs that stand back one by one against contact solved on the relieved flanks, along which it moves."""
    rig, sound = make_rig(flanks), make_rig({})
    meshing, law = pair(rig), teeth_law(sound, SIMULATION, 150.0)
    back = excess_of(rig, law)
    model = nonlinear_model(sound, meshing, formed(law, back))
    at = instants(model, tables(model, Motion(cycles=1.0, entries=len(PHASE), step=1.0)), -1)
    force = np.array(TORQUES)[:, None] / meshing.driver.base_radius
    found = travel_under(model.law, at, np.broadcast_to(force, (len(TORQUES), len(PHASE))))
    true, plain = lumped_error(rig), lumped_error(sound)
    for row in range(len(TORQUES)):
        assert np.std(found[row] - true[row]) < within * np.std(true[row] - plain[row])


def springs(shared: float = 0.0) -> MeshLaw:
    """Two pairs of 2e8 N/m each at all phases, beside what they share [m/N]."""
    approach, phases = approach_grid(40e-6, 49), 8
    stiffness = 1.0 / (shared + 1.0 / 4e8)
    force = np.tile(stiffness * approach, (phases, 1))
    half = np.full((phases, 2), 0.5)
    return MeshLaw(
        approach=approach, force=force, offsets=np.array([0, 1]), share=half, parts=force[..., None] * half[:, None],
        rho1=half, rho2=half, bending=np.zeros((phases, 2, 2)), backlash=1e-4, base_pitch=9e-3, shared=shared,
    )  # fmt: skip


@pytest.mark.parametrize("shared", [0.0, 1e-9])
def test_a_pair_that_stands_back_carries_as_two_springs_do(shared: float) -> None:
    """k u + k (u - r) = F for u > r, delta = u + c F."""
    one, back = 2e8, 6e-6
    law = formed(springs(shared), np.tile([1e-6, 1e-6 - back], (8, 1)))
    assert law.lead == 1e-6
    u = np.linspace(0.5e-6, 25e-6, 60)
    force = one * u + one * np.maximum(u - back, 0.0)
    found = law.evaluate(u + shared * force, 0.3)[0]
    np.testing.assert_allclose(found, force, atol=3e-3 * force.max())
    np.testing.assert_allclose(law.parts.sum(axis=2), law.force)
    np.testing.assert_allclose(law.share.sum(axis=1), 1.0)


def test_a_pair_that_does_not_touch_at_the_reference_load_has_no_share() -> None:
    law = springs()
    back = formed(law, np.tile([0.0, -0.8 * law.approach[-1]], (8, 1)))
    np.testing.assert_allclose(back.share, np.tile([1.0, 0.0], (8, 1)))


def test_pairs_carry_what_two_springs_do_at_the_reference_load() -> None:
    """k u + k (u - r) = F."""
    one, back = 2e8, 3e-6
    law = formed(springs(), np.tile([0.0, -back], (8, 1)))
    force = 0.3 * law.force[:, -1].max()
    pressed = (force + one * back) / (2 * one) - np.array([0.0, back])
    np.testing.assert_allclose(law.carried[:-1], np.tile(one * pressed / force, (8, 1)), atol=3e-3)


@pytest.mark.parametrize(("size", "more"), [(1e-11, 0.0), (0.0, 1e-15), (1e-11, 1e-15)])
def test_flanks_and_bodies_that_hardly_depart_leave_the_shares(size: float, more: float) -> None:
    """Friction follows them: a jump there is one of all that the record shows."""
    law = teeth_law(make_rig({}), SIMULATION, 150.0)
    excess = size * np.cos(2 * np.pi * np.arange(law.phases) / law.phases)[:, None] * np.ones(len(law.offsets))
    found = formed(law, excess, more)
    assert not np.array_equal(found.force, law.force)
    np.testing.assert_allclose(found.share, law.share, atol=1e-4)


def test_wear_of_all_flanks_alike_turns_the_driver_on_and_changes_nothing_else() -> None:
    worn = {"driver": {"wear": 5e-6}, "driven": {"wear": 2e-6}}
    np.testing.assert_allclose(lumped_error(make_rig(worn)) - lumped_error(make_rig({})), 7e-6, rtol=1e-9)


def test_reliefs_stand_in_a_law_of_any_source() -> None:
    """Two pairs of which one stands back by r: k1 u + k2 max(u - r, 0) = F, closest but where r is just closed."""
    simulation = Simulation(model="lumped")
    rig = make_rig(RELIEVED)
    meshing, law = pair(rig), teeth_law(rig, simulation, 150.0)
    back = -excess_of(rig, law)
    stiffness = law.parts[:, -1] / law.approach[-1]
    rows = (PHASE * law.phases).astype(int)
    forces = np.array(TORQUES) / meshing.driver.base_radius
    for force, found in zip(forces, lumped_error(rig, simulation), strict=True):
        pressed = np.maximum(found[:, None] - back[rows], 0.0)
        wrong = np.abs((stiffness[rows] * pressed).sum(axis=1) / force - 1.0)
        assert wrong.max() < 0.015 and np.quantile(wrong, 0.9) < 0.002


def test_teeth_that_differ_in_their_form_are_refused() -> None:
    factors = (1.0,) * 13 + (0.5,)
    with pytest.raises(BenchError, match=r"rig\.driver\.wear_tooth runs from 0\.5 to 1"):
        refuse_unknown(make_rig({"driver": {"wear": 5e-6, "wear_tooth": factors}}))
    with pytest.raises(BenchError, match=r"rig\.driven\.profile_slope_tooth_um"):
        refuse_unknown(make_rig({"driven": {"profile_slope_tooth": (1e-6,) * 16 + (0.0,)}}))


def test_excess_of_another_shape_or_beyond_numbers_is_refused() -> None:
    with pytest.raises(LumpedError, match="shape"):
        formed(springs(), np.zeros((8, 3)))
    with pytest.raises(LumpedError, match="finite"):
        formed(springs(), np.full((8, 2), np.nan))


@pytest.mark.parametrize("more", [2e-9, -8e-10])
def test_bodies_that_yield_otherwise_add_what_they_do_to_the_deflection(more: float) -> None:
    """Two equal springs and the compliance c + d in series with both: delta = F/(2 k) + (c + d) F."""
    law = formed(springs(1e-9), None, more)
    assert law.shared == 1e-9 + more
    force = np.linspace(50.0, 6000.0, 40)
    deflection = force / 4e8 + (1e-9 + more) * force
    found, tangent = law.evaluate(deflection, 0.3)
    np.testing.assert_allclose(found, force, rtol=1e-6)
    np.testing.assert_allclose(tangent, 1.0 / (1.0 / 4e8 + 1e-9 + more), rtol=1e-6)
    np.testing.assert_allclose(law.parts.sum(axis=2), law.force, rtol=1e-12)


@pytest.mark.parametrize(("shared", "one", "two"), [(0.0, 3e-9, -1.5e-9), (1e-9, -1e-9, 2e-9)])
def test_pairs_that_yield_more_by_themselves_are_softer_springs(shared: float, one: float, two: float) -> None:
    """Two springs 1/(1/k + d_n) side by side, and the compliance c in series with both."""
    law = formed(springs(shared), None, 0.0, np.tile([one, two], (8, 1)))
    stiffness = np.array([1.0 / (1.0 / 2e8 + own) for own in (one, two)])
    deflection = np.linspace(1e-6, 25e-6, 40)
    force, tangent = law.evaluate(deflection, 0.3)
    whole = 1.0 / (1.0 / stiffness.sum() + shared)
    np.testing.assert_allclose(force, whole * deflection, rtol=1e-6)
    np.testing.assert_allclose(tangent, whole, rtol=1e-6)
    np.testing.assert_allclose(law.parts[:, 1:] / law.force[:, 1:, None], np.broadcast_to(
        stiffness / stiffness.sum(), (8, len(law.approach) - 1, 2)), rtol=1e-6)  # fmt: skip
    np.testing.assert_allclose(law.share, np.tile(stiffness / stiffness.sum(), (8, 1)), rtol=1e-6)


def test_teeth_cannot_give_back_more_than_they_yield() -> None:
    with pytest.raises(LumpedError, match=r"end_compliance_um_per_kn and tilt_compliance_um_per_kn"):
        formed(springs(), None, 0.0, np.full((8, 2), -4.6e-9))


@pytest.mark.parametrize(
    ("ends", "tilt"), [(2e-9, 0.0), (-1e-9, 0.0), (0.0, 1e-9), (0.0, -1e-9)], ids=["soft", "stiff", "late", "early"]
)
def test_pairs_yield_more_at_the_ends_of_their_path_as_in_finite_elements(ends: float, tilt: float) -> None:
    rig = make_rig({})
    law = elastic_rig(rig, SIMULATION).law
    plain, changed = (
        static_cycle(one, PHASE, torque=list(TORQUES)).transmission_error
        for one in (law, law._replace(ends=ends, tilt=tilt))
    )
    uneven = {"end_compliance": ends, "tilt_compliance": tilt}
    softer = rig.model_copy(update={"mesh": rig.mesh.model_copy(update=uneven)})
    found = lumped_error(softer) - lumped_error(rig)
    for true, here in zip(changed - plain, found, strict=True):
        assert np.sqrt(np.mean((here - true) ** 2)) < 0.05 * np.sqrt(np.mean(true**2))


def test_bodies_and_flanks_together_are_bodies_after_flanks() -> None:
    excess = np.tile([0.0, -5e-6], (8, 1))
    both, after = formed(springs(1e-9), excess, 1e-9), formed(formed(springs(1e-9), excess), None, 1e-9)
    deflection = np.linspace(1e-6, 25e-6, 30)
    one, two = (law.evaluate(deflection, 0.2)[0] for law in (both, after))
    np.testing.assert_allclose(one, two, atol=4e-3 * one.max())


def test_bodies_cannot_give_back_more_than_the_mesh_yields() -> None:
    with pytest.raises(LumpedError, match=r"shared_compliance_um_per_kn = -2\.4 .* must lie above -2\.25"):
        formed(springs(), None, -2.4e-9)


def test_the_law_of_a_rig_has_its_shared_compliance() -> None:
    rig = make_rig({})
    softer = rig.model_copy(update={"mesh": rig.mesh.model_copy(update={"shared_compliance": 1e-9})})
    plain, found = (mesh_law(one, SIMULATION, 150.0) for one in (rig, softer))
    force = 0.4 * float(plain.force[:, -1].min())
    for phase in (0.1, 0.45, 0.8):
        before, after = (np.interp(force, one.evaluate(one.approach, phase)[0], one.approach) for one in (plain, found))
        assert after - before == pytest.approx(1e-9 * force, rel=5e-3)

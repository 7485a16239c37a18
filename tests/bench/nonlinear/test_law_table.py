"""The finite-element mesh law against static equilibria that are not in its tables, and the law from k(phase)."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.bench import BenchError
from gearbench.bench.elastic.rig import elastic_rig
from gearbench.bench.nonlinear import law_table as module
from gearbench.bench.nonlinear.law_table import PHASES, mesh_law
from gearbench.fem.contact.law import PAIRS, Law
from gearbench.fem.contact.static import position, static_cycle
from gearbench.geometry import pair
from gearbench.lumped import mesh_stiffness
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.model import nonlinear_model
from gearbench.lumped.nonlinear.pressing import travel_under
from gearbench.lumped.nonlinear.tables import Motion, instants, tables
from gearbench.rig import Crack, Gear, Rig, Simulation, Support, Supports

Array = NDArray[np.float64]

# Coarse on purpose: law and comparison stand on the same condensed gears.
SIMULATION = Simulation(model="lumped", mesh_stiffness="finite-element", element_size=0.8e-3, modes=0)


def make_rig(**driver: object) -> Rig:
    gear = {"module": 3e-3, "face_width": 0.02, "thinning": 30e-6}
    support = Support(stiffness=1e8)
    return Rig(
        driver=Gear(teeth=14, hub_radius=11e-3, profile_shift=0.3, **gear, **driver),
        driven=Gear(teeth=17, hub_radius=15e-3, profile_shift=0.1, **gear),
        support=Supports(driver=support, driven=support),
    )


@pytest.fixture(scope="module")
def law() -> MeshLaw:
    return mesh_law(make_rig(), SIMULATION, 150.0)


@pytest.fixture(scope="module")
def solved() -> Law:
    return elastic_rig(make_rig(), SIMULATION).law


def force_at(solved: Law, dte: float, phase: float) -> float:
    """Static force [N], all pairs in equilibrium."""
    theta1 = phase * solved.driver.pitch + dte / solved.driver.rb
    return float(
        position(solved, theta1, phase * solved.driven.pitch, 0.0, 0.0, 0.0, 0.0, np.zeros(PAIRS)).torque_driver
        / solved.driver.rb
    )


def test_law_is_the_static_equilibrium_between_its_nodes(law: MeshLaw, solved: Law) -> None:
    rng = np.random.default_rng(1)
    phase, dte = rng.uniform(-2, 5, 300), rng.uniform(0, law.approach[-1], 300)
    expected = np.array([force_at(solved, d, p) for d, p in zip(dte, phase, strict=True)])
    found = law.evaluate(dte, phase)[0]
    error = (found - expected) / expected.max()
    assert np.abs(error).max() < 2e-3
    assert np.sqrt(np.mean(error**2)) < 2e-4
    # At a node of the table it is exact: this one lies in mid-table.
    at = law.approach[20]
    assert float(law.evaluate(at, 100 / PHASES)[0]) == pytest.approx(force_at(solved, at, 100 / PHASES), rel=1e-10)


def test_back_flanks_touch_where_the_backlash_ends_and_carry_alike(law: MeshLaw, solved: Law) -> None:
    rng = np.random.default_rng(2)
    phase, depth = rng.uniform(0, 3, 200), rng.uniform(0, 20e-6, 200)
    expected = np.array([force_at(solved, -law.backlash - d, p) for d, p in zip(depth, phase, strict=True)])
    found = law.evaluate(-law.backlash - depth, phase)[0]
    assert expected.max() < 0
    assert np.abs(found - expected).max() < 2e-3 * -expected.min()
    assert force_at(solved, -law.backlash + 1e-9, 0.2) == 0.0


def test_shares_are_those_of_the_pairs_tangents(law: MeshLaw, solved: Law) -> None:
    # Force of each pair at two deflections around the reference: their slopes are the tangent shares.
    reference = 0.3 * 2 ** (14.5 / 2) / solved.driver.rb  # 152 N m, the next step above 150
    for phase in (0.1, 0.4, 0.6, 0.9):
        dte = float(np.interp(reference, law.evaluate(law.approach, phase)[0], law.approach))
        slopes = {}
        for size, sign in ((dte + 2e-9, 1.0), (dte - 2e-9, -1.0)):
            theta1 = phase * solved.driver.pitch + size / solved.driver.rb
            found = position(solved, theta1, phase * solved.driven.pitch, 0.0, 0.0, 0.0, 0.0, np.zeros(PAIRS))
            assert np.all(found.pairs["side"] == 0)
            for tooth, force in zip(found.pairs["tooth"], found.force, strict=True):
                slopes[int(tooth)] = slopes.get(int(tooth), 0.0) + sign * force
        total = sum(slopes.values())
        for number, share in zip(*law.pairs(phase), strict=True):
            assert share == pytest.approx(slopes.get(int(number), 0.0) / total, abs=2e-3)


def test_shape_of_the_law(law: MeshLaw) -> None:
    meshing = pair(make_rig())
    np.testing.assert_allclose(law.share.sum(axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(law.rho1 + law.rho2, meshing.line_of_action, rtol=1e-12)
    assert law.pitch_roll == pytest.approx(meshing.rho_pitch, rel=1e-12)
    assert not law.share[0, -1]
    assert law.backlash == pytest.approx(meshing.backlash_normal)
    # Both teeth bend, and the contact takes the rest.
    assert np.all(law.bending > 0.1)
    assert np.all(law.bending.sum(axis=2) < 0.95)
    # A tooth bends most when it is touched at its tip: the driver's at the end of contact.
    column = int(np.argmax(law.offsets == 0))
    assert np.all(np.diff(law.bending[: PHASES // 4, column, 0]) > 0)
    assert np.all(np.diff(law.bending[: PHASES // 4, column, 1]) < 0)


def test_errors_cracks_and_masses_do_not_change_the_sound_law(law: MeshLaw, monkeypatch: pytest.MonkeyPatch) -> None:
    def solve(*_: object) -> None:
        raise AssertionError("solved again")

    monkeypatch.setattr(module, "_solve", solve)
    other = make_rig(pitch_error=(1e-6,) * 14, runout=5e-6, crack=Crack(tooth=1, stiffness_loss=0.2), mass=3.0)
    again = mesh_law(other, SIMULATION, 130.0)
    np.testing.assert_array_equal(again.force, law.force)
    np.testing.assert_array_equal(again.share, law.share)


def test_loads_beyond_the_flanks_are_refused() -> None:
    with pytest.raises(BenchError, match="more than the modelled flanks can carry"):
        mesh_law(make_rig(), SIMULATION, 1e6)
    with pytest.raises(BenchError, match="must be positive and finite, not nan"):
        mesh_law(make_rig(), SIMULATION, float("nan"))


def test_law_reaches_the_load_asked_for(law: MeshLaw, solved: Law) -> None:
    cycle = static_cycle(solved, np.arange(16) / 16, torque=[150.0])
    assert cycle.transmission_error.max() < law.approach[-1]


def test_law_of_a_stiffness_over_phase_is_linear() -> None:
    rig, simulation = make_rig(), Simulation(model="lumped", stiffness_edge=0.1)
    law = mesh_law(rig, simulation, 100.0)
    phase = np.linspace(0, 2, 777)
    k = mesh_stiffness(rig, pair(rig), simulation).at(phase, finest=2 / PHASES)
    force, tangent = law.evaluate(12e-6, phase)
    np.testing.assert_allclose(force, 12e-6 * k, rtol=2e-3)
    np.testing.assert_allclose(tangent, k, rtol=2e-3)
    # One pair carries all where only one is in contact.
    single = law.share.max(axis=1) > 1 - 1e-12
    assert single.mean() == pytest.approx(2 - pair(rig).contact_ratio, abs=2 / PHASES)


def test_parts_add_up_to_the_force(law: MeshLaw) -> None:
    np.testing.assert_allclose(law.parts.sum(axis=-1), law.force, rtol=1e-9, atol=1e-9 * law.force.max())
    assert not law.parts[0, :, -1].any()


@pytest.mark.parametrize(("torque", "most"), [(120.0, 0.02), (25.0, 0.09)])
def test_uneven_teeth_carry_as_finite_elements_say(torque: float, most: float) -> None:
    # Neighbours differ by up to 8 um: under the smaller load, 3 um, single teeth carry nothing.
    errors = tuple(1e-6 * np.array([3, -2, 4, -4, 1, 3, -3, 0, 2, -1, 4, -2, -4, 2], dtype=float))
    rig = make_rig(pitch_error=errors)
    phase = np.arange(14 * 16) / 16
    sound, uneven = (elastic_rig(one, SIMULATION).law for one in (make_rig(), rig))
    expected = static_cycle(uneven, phase, torque=[torque]).transmission_error[0]
    even = static_cycle(sound, phase[:16], torque=[torque]).transmission_error[0]
    model = nonlinear_model(rig, pair(rig), mesh_law(rig, SIMULATION, 150.0))
    at = instants(model, tables(model, Motion(14.0, phase.size, 1.0)), -1)
    found = travel_under(model.law, at, np.array(torque / model.base_radii[0]))
    change = np.std(expected - np.tile(even, 14))
    assert change > 2.0e-6
    assert np.std(found - expected) < most * change


@pytest.mark.parametrize("torque", [5.0, 40.0, 120.0])
def test_relieved_flanks_carry_as_finite_elements_say(torque: float) -> None:
    """Relief that is far larger than the deflection under the first load, and about as large under the last."""
    rig = make_rig(tip_relief=12e-6, tip_relief_start_diameter=44e-3)
    phase = np.arange(64) / 64
    expected, plain = (
        static_cycle(elastic_rig(one, SIMULATION).law, phase, torque=[torque]).transmission_error[0]
        for one in (rig, make_rig())
    )
    model = nonlinear_model(rig, pair(rig), mesh_law(rig, SIMULATION, 150.0))
    at = instants(model, tables(model, Motion(1.0, phase.size, 1.0)), -1)
    found = travel_under(model.law, at, np.array(torque / model.base_radii[0]))
    change = np.std(expected - plain)
    assert change > 0.5e-6
    assert np.std(found - expected) < 0.02 * change and abs(np.mean(found - expected)) < 0.02 * change

"""k over the mesh phase: where pairs join and leave, how switches look, what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.geometry import Pair, pair
from gearbench.lumped import (
    LumpedError,
    PairStiffness,
    mesh_stiffness,
    pair_stiffness,
    potential_energy_stiffness,
    rectangular_stiffness,
    tabulated_stiffness,
)
from gearbench.rig import Gear, Rig, Simulation, Support, Supports

PHASES = (np.arange(20_000) + 0.5) / 20_000


def make_rig(driver: dict[str, Any] | None = None, driven: dict[str, Any] | None = None) -> Rig:
    support = Support(stiffness=1e8)
    common = {"module": 2e-3, "face_width": 0.02, "hub_radius": 0.0175}
    return Rig(
        driver=Gear(**{"teeth": 62, **common, **(driver or {})}),
        driven=Gear(**{"teeth": 62, **common, **(driven or {})}),
        support=Supports(driver=support, driven=support),
    )


@pytest.fixture(scope="module")
def rig() -> Rig:
    return make_rig(driven={"teeth": 40, "hub_radius": 0.015})


@pytest.fixture(scope="module")
def meshing(rig: Rig) -> Pair:
    return pair(rig)


def test_phase_zero_has_a_pair_at_the_pitch_point(rig: Rig, meshing: Pair) -> None:
    k = potential_energy_stiffness(rig, meshing)
    pitch = meshing.rho_pitch[0]
    start, stop = meshing.active_driver
    touching = [pitch + i * meshing.base_pitch for i in (-1, 0, 1)]
    expected = sum(pair_stiffness(rig, meshing, rho)[0] for rho in touching if start <= rho <= stop)
    assert float(k.at(0.0)) == pytest.approx(expected, rel=1e-6)


def test_contact_moves_up_the_driver_as_the_phase_grows(rig: Rig, meshing: Pair) -> None:
    # A quarter cycle later: every pair has moved by a quarter of the base pitch, towards the driver's tip.
    k = potential_energy_stiffness(rig, meshing)
    start, stop = meshing.active_driver
    touching = [meshing.rho_pitch[0] + (i + 0.25) * meshing.base_pitch for i in (-1, 0, 1)]
    expected = sum(pair_stiffness(rig, meshing, rho)[0] for rho in touching if start <= rho <= stop)
    assert float(k.at(0.25)) == pytest.approx(expected, rel=1e-6)


def test_stiffness_repeats_after_one_cycle(rig: Rig, meshing: Pair) -> None:
    k = potential_energy_stiffness(rig, meshing, edge=0.02)
    np.testing.assert_allclose(k.at(PHASES + 3.0), k.at(PHASES), rtol=1e-9)
    np.testing.assert_allclose(k.at(PHASES - 1.0), k.at(PHASES), rtol=1e-9)


def test_equal_gears_are_symmetric_about_the_pitch_point() -> None:
    rig = make_rig()
    k = potential_energy_stiffness(rig, pair(rig), edge=0.05)
    np.testing.assert_allclose(k.at(PHASES), k.at(-PHASES), rtol=1e-9)


def test_share_of_double_contact_is_the_contact_ratio_less_one(meshing: Pair) -> None:
    k = rectangular_stiffness(meshing, 2e8, 3.5e8)
    values = k.at(PHASES)
    assert set(np.unique(values)) == {2e8, 3.5e8}
    assert np.mean(values == 3.5e8) == pytest.approx(meshing.contact_ratio - 1, abs=1e-4)
    assert np.mean(k.pairs(PHASES)) == pytest.approx(meshing.contact_ratio, abs=1e-4)
    np.testing.assert_array_equal(values == 3.5e8, k.pairs(PHASES) == 2)


def test_switches_are_where_the_number_of_pairs_changes(meshing: Pair) -> None:
    k = rectangular_stiffness(meshing, 2e8, 3.5e8)
    joins, leaves = k.switches
    assert k.pairs(joins + 1e-6) - k.pairs(joins - 1e-6) == 1
    assert k.pairs(leaves + 1e-6) - k.pairs(leaves - 1e-6) == -1
    start, stop = meshing.active_driver
    assert joins == pytest.approx((start - meshing.rho_pitch[0]) / meshing.base_pitch % 1.0)
    assert leaves == pytest.approx((stop - meshing.rho_pitch[0]) / meshing.base_pitch % 1.0)


@pytest.mark.parametrize("edge", [0.02, 0.1])
def test_wide_switches_keep_mean_and_instant_and_are_raised_cosines(meshing: Pair, edge: float) -> None:
    sharp = rectangular_stiffness(meshing, 2e8, 3.5e8)
    smooth = rectangular_stiffness(meshing, 2e8, 3.5e8, edge=edge)
    assert smooth.at(PHASES).mean() == pytest.approx(sharp.at(PHASES).mean(), rel=1e-4)
    for switch, sign in zip(smooth.switches, (1, -1), strict=True):
        assert float(smooth.at(switch)) == pytest.approx(2.75e8, rel=1e-9)
        for part in (-0.5, -0.25, 0.25, 0.5):
            expected = 2.75e8 + sign * 0.75e8 * np.sin(np.pi * part)
            assert float(smooth.at(switch + part * edge)) == pytest.approx(expected, rel=1e-9)


def test_finest_widens_sharp_switches_only(meshing: Pair) -> None:
    sharp = rectangular_stiffness(meshing, 2e8, 3.5e8)
    wide = rectangular_stiffness(meshing, 2e8, 3.5e8, edge=0.1)
    asked = rectangular_stiffness(meshing, 2e8, 3.5e8, edge=0.01)
    np.testing.assert_array_equal(sharp.at(PHASES, finest=0.01), asked.at(PHASES))
    np.testing.assert_array_equal(wide.at(PHASES, finest=0.01), wide.at(PHASES))


def test_three_pairs_are_counted_when_the_contact_ratio_exceeds_two() -> None:
    k = PairStiffness(np.array([-1.2, 1.1]), np.array([1e8, 1e8]))
    values = k.at(PHASES)
    assert values.mean() == pytest.approx(2.3e8, rel=1e-4)
    assert values.max() == 3e8


def test_table_is_joined_by_straight_lines_around_the_cycle() -> None:
    table = tabulated_stiffness([1e8, 3e8, 2e8, 2e8])
    phases = [0.0, 0.125, 0.25, 0.875, 1.0, -0.125]
    np.testing.assert_allclose(table.at(phases), [1e8, 2e8, 3e8, 1.5e8, 1e8, 1.5e8])


@pytest.mark.parametrize(
    ("values", "words"),
    [([1e8], "at least 2 values"), ([1e8, -1.0], "lowest is -1"), ([[1e8, 2e8]], "one dimension")],
)
def test_unfit_tables_are_refused(values: list[float], words: str) -> None:
    with pytest.raises(LumpedError, match=words):
        tabulated_stiffness(values)


def test_case_chooses_the_law(rig: Rig, meshing: Pair) -> None:
    box = Simulation(
        mesh_stiffness="rectangular", stiffness_single=2e8, stiffness_double=3e8, stiffness_edge=0.0
    )
    assert set(np.unique(mesh_stiffness(rig, meshing, box).at(PHASES))) == {2e8, 3e8}
    energy = mesh_stiffness(rig, meshing, Simulation(stiffness_edge=0.03))
    expected = potential_energy_stiffness(rig, meshing, edge=0.03)
    assert energy.edge == 0.03
    np.testing.assert_array_equal(energy.at(PHASES), expected.at(PHASES))


def test_single_above_double_is_refused(meshing: Pair) -> None:
    with pytest.raises(LumpedError, match=r"stiffness_single_n_per_m = 3e\+08 must be positive and below"):
        rectangular_stiffness(meshing, 3e8, 2e8)

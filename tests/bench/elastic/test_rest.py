"""Whether teeth pass through the positions of rest: by vibrations of the mesh, not by those that leave it alone."""

from __future__ import annotations

from typing import Any

import pytest

from gearbench.bench import BenchError, simulate
from gearbench.bench.elastic.rig import beside_rest, elastic_rig, machine_for, natural_frequencies
from gearbench.cases import case_path
from gearbench.fem.contact.static import ContactError
from gearbench.rig import read_case

TORQUE = 20.0
RIGID = ["rig.support.stiffness_n_per_m=1e13", "rig.support.damping_n_s_per_m=0", "rig.damping.material_ratio=0"]
HOUSING = ["rig.housing.mass_kg=60", "rig.housing.stiffness_n_per_m=1e8", "rig.housing.damping_n_s_per_m=3e4"]


def machine(*settings: str) -> Any:
    case = read_case(case_path("quick_fe"), [*RIGID, *settings])
    return machine_for(elastic_rig(case.rig, case.simulation), 100.0, TORQUE)


def test_a_mesh_that_vibrates_answers_as_one_degree_of_freedom() -> None:
    """Of an undamped one with its inertia in the hub, at a third of its frequency 1/(1 - 1/9): an eighth more."""
    rigid = machine("rig.driver.inertia_kg_m2=0.5")
    first = natural_frequencies(rigid, TORQUE, 0.0)[0]
    assert beside_rest(rigid, TORQUE, 0.0, first / 3) == pytest.approx(1 / 8, rel=0.05)
    assert beside_rest(rigid, TORQUE, 0.0, first / 30) == pytest.approx(1 / 899, rel=0.05)


def test_a_housing_that_both_gears_push_both_ways_has_no_part_in_it() -> None:
    """Its own frequency is far below the mesh's, and the answer that of rest."""
    alone, housed = machine(), machine(*HOUSING)
    lowest, mesh = natural_frequencies(housed, TORQUE, 0.0)[:2]
    assert 1.5 * lowest < mesh / 3
    expected = beside_rest(alone, TORQUE, 0.0, 1.5 * lowest)
    assert beside_rest(housed, TORQUE, 0.0, 1.5 * lowest) == pytest.approx(expected, rel=1e-3)


def test_a_load_too_high_is_refused_before_it_is_integrated() -> None:
    """Behind a housing slower than the mesh too."""
    case = read_case(case_path("quick_fe"), [*RIGID, *HOUSING, "experiment.torque_mean_nm=2300"])
    notes: list[str] = []
    with pytest.raises(BenchError, match=r"^experiment.torque_mean_nm = 2300 at rest, at mesh phase"):
        simulate(case, progress=lambda _, note: notes.append(note))
    assert not [note for note in notes if note.startswith("integrating")]


def test_supports_that_give_way_are_named() -> None:
    soft = ["rig.support.driver.across.stiffness_n_per_m=1e4", "rig.support.driver.across.damping_n_s_per_m=10"]
    sentence = r"^experiment.torque_mean_nm = 200 moves a gear's centre by [\d.]+ mm on its support \(rig.support\)"
    with pytest.raises(ContactError, match=sentence):
        simulate(read_case(case_path("quick_fe"), [*soft, "experiment.torque_mean_nm=200"]))

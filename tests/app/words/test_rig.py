"""The effects of a rig on its data sheet."""

from __future__ import annotations

from gearbench.cases import case_path
from gearbench.rig import read_case
from gearbench.words.rig import effect_lines

SHAFT = "rig.load.coupling={inertia_kg_m2 = 0.1, stiffness_nm_per_rad = 1e4}"


def test_effects_are_named_by_their_keys_and_an_idle_inertia_is_said() -> None:
    assert effect_lines(read_case(case_path("paper_fe")).rig) == []
    held = effect_lines(read_case(case_path("quick_lumped"), [SHAFT, "rig.load.boundary=speed"]).rig)
    assert held[0] == "beyond gears, supports and damping: rig.load.coupling"
    assert held[1] == (
        'rig.load.coupling.inertia_kg_m2 = 0.1 is of no effect: rig.load.boundary = "speed" holds its speed'
    )
    free = effect_lines(read_case(case_path("quick_lumped"), [SHAFT, "rig.load.boundary=torque"]).rig)
    assert free == ["beyond gears, supports and damping: rig.load.coupling"]

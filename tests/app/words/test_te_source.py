"""What a static TE holds is said for every model and law, and each says another thing."""

from __future__ import annotations

from typing import get_args

import numpy as np

import gearbench as gb
from gearbench.rig import Simulation
from gearbench.words.te_source import te_source


def test_every_model_and_law_has_its_sentence() -> None:
    laws = get_args(Simulation.model_fields["mesh_stiffness"].annotation)
    said = [te_source("lumped", law) for law in laws] + [te_source("reduced", laws[0])]
    assert len(set(said)) == len(laws) + 1
    assert te_source("full", "rectangular") == said[-1]


def test_pairs_side_by_side_swing_more() -> None:
    """The claim itself, on the shipped pair."""
    case = gb.read_case("quick_fe")
    found = [gb.static(case, model, torque=[100.0], positions=32) for model in ("reduced", "lumped")]
    swing = [float(np.ptp(one["transmission_error"].values)) for one in found]
    assert swing[1] > 1.2 * swing[0]

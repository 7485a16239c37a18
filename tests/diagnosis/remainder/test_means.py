"""Means that no rig explains are told, with the lag that would make them."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shared.simulated_lines import behind, demonstration, of_records

from gearbench.diagnosis.remainder.means import sentences_of_means
from gearbench.diagnosis.simulation.simulator import Simulator

LAG = 60e-6  # [s]


@pytest.fixture(scope="module")
def prompt() -> Simulator:
    return demonstration()


def said(simulator: Simulator, gear: str, lag: float, **changes: Any) -> tuple[str, ...]:
    """What is said of the nominal rig where that gear's angle is recorded so late, but for changes of the record."""
    (measured,) = simulator.target.measurements
    told = of_records(simulator, replace(behind(measured, gear, lag), **changes))
    lines = told.lines(np.zeros(told.layout.size))
    found: Any = SimpleNamespace(
        simulator=told, layout=told.layout, selection=SimpleNamespace(best=SimpleNamespace(lines=lines))
    )
    return sentences_of_means(found)


@pytest.mark.parametrize("gear", ["driver", "driven"])
def test_a_late_angle_that_the_rig_lacks_is_told(prompt: Simulator, gear: str) -> None:
    (sentence,) = said(prompt, gear, LAG)
    assert f"A {gear} angle that is recorded" in sentence
    told = float(sentence.split("is recorded ")[1].split(" us")[0])
    assert told == pytest.approx(1e6 * LAG, rel=0.02)
    (measured,) = prompt.target.measurements
    base_pitch = 2 * pi * measured.record.attrs["base_radius_driver"] / measured.record.attrs["teeth_driver"]
    off = float(sentence.split("error is ")[1].split(" um")[0])
    assert off == pytest.approx(1e6 * measured.mesh_frequency * base_pitch * LAG, rel=0.02)


def test_nothing_is_said_of_sound_means_or_unknown_zeros(prompt: Simulator) -> None:
    assert said(prompt, "driven", 0.0) == said(prompt, "driven", 3e-6) == ()
    assert said(prompt, "driven", LAG, zero_known=False) == ()

"""Noise of what a simulation leaves of a record whose motion need not repeat."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.diagnosis.intake.signals import noise_of_mean
from gearbench.diagnosis.judging.held_against import scattered


@pytest.mark.parametrize("repetitions", [2, 5])
def test_one_motion_more_departs_from_the_mean_of_all_by_that_much(repetitions: int) -> None:
    """Motions drawn alike: of repetitions, whose mean is held against one more."""
    motions = np.random.default_rng(3).standard_normal((repetitions + 1, 20_000))
    measured, simulated = motions[:-1], motions[-1]
    left = float(np.mean((measured.mean(axis=0) - simulated) ** 2))
    found = scattered({"dte": noise_of_mean(measured)})["dte"]
    assert float((found**2).sum(axis=0).mean()) == pytest.approx(left, rel=0.05)

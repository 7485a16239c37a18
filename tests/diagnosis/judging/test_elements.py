"""A fit by another model that goes on from the lumped one's, with its Jacobian: lines made by hand."""

from __future__ import annotations

import numpy as np
import pytest
from shared.fake_simulator import FakeSimulator, sensitivities, target

from gearbench.diagnosis.fitting.fit import fit, sensitivity_of
from gearbench.diagnosis.judging.elements import refitted

LUMPED = sensitivities(3)
# The other model answers by a fifth otherwise.
ELEMENTS = LUMPED + 0.2 * sensitivities(4)
TRUE = np.array([0.08, -0.1, 0.05, 0.3, 0.0, 0.0, 0.0, 0.0])
SD = np.array([0.1, 0.1, 0.1, 0.5, 0.01, 0.01, 0.0, 0.0])


def test_the_fit_of_another_model_ends_at_the_truth_that_the_lumped_one_bends() -> None:
    held = target(TRUE @ ELEMENTS)
    simple = FakeSimulator(lambda p: p @ LUMPED, held)
    first = sensitivity_of(simple, np.zeros(SD.size), np.where(SD > 0, SD, 1.0))  # type: ignore[arg-type]
    assert first is not None
    bent = fit(simple, np.zeros(SD.size), SD, first, renewals=1)  # type: ignore[arg-type]
    assert bent is not None
    elements = FakeSimulator(lambda p: p @ ELEMENTS, held)
    found = refitted(elements, bent, False)  # type: ignore[arg-type]
    assert np.abs(found.p - TRUE).max() < 0.3 * np.abs(bent.p - TRUE).max()
    assert found.misfit < 0.1 * bent.misfit and elements.jacobians == 0


def test_cracked_teeth_stay_as_they_are_and_a_model_without_an_answer_says_so() -> None:
    truth = TRUE.copy()
    truth[6] = 0.1
    held = target(truth @ ELEMENTS)
    simple = FakeSimulator(lambda p: p @ LUMPED, held)
    sd = SD.copy()
    sd[6] = 0.35
    first = sensitivity_of(simple, np.zeros(SD.size), np.where(sd > 0, sd, 1.0))  # type: ignore[arg-type]
    assert first is not None
    cracked = fit(simple, np.zeros(SD.size), sd, first, renewals=1)  # type: ignore[arg-type]
    assert cracked is not None and cracked.p[6] != 0.0
    found = refitted(FakeSimulator(lambda p: p @ ELEMENTS, held), cracked, False)  # type: ignore[arg-type]
    assert found.p[6] == cracked.p[6]
    with pytest.raises(ValueError, match="finite elements cannot answer the records of the search"):
        refitted(FakeSimulator(lambda p: p @ ELEMENTS, held, largest=1e-3), cracked, False)  # type: ignore[arg-type]

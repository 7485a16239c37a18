"""Stated standard deviations: the fit's, widened by the model's error."""

from __future__ import annotations

import pytest

from gearbench.diagnosis.evidence.calibration import MODEL_ERROR, stated
from gearbench.diagnosis.evidence.hypotheses import LIBRARY


def test_the_models_error_is_added_in_squares() -> None:
    assert set(MODEL_ERROR) == set(LIBRARY)
    assert stated("friction", "coefficient", 0.05, 0.0) == pytest.approx(0.05 * MODEL_ERROR["friction"])
    assert stated("friction", "coefficient", 0.0, 0.002) == pytest.approx(0.002)
    three, four = 3.0 / MODEL_ERROR["backlash"], 4.0
    assert stated("backlash", "more", three, four) == pytest.approx(5.0)


def test_numbers_of_teeth_and_phases_keep_the_fits() -> None:
    assert stated("tooth-crack", "driver.tooth", 8.0, 0.0) == 0.0
    assert stated("eccentricity", "driven.runout_phase", 90.0, 3.0) == 3.0

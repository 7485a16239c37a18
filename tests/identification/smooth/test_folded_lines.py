"""Mesh harmonics of the operating response that come back from beyond half the sampling rate are no response."""

import numpy as np
import pytest
from shared.ptv import spectra_of

from gearbench.identification.lpm.missing import MissingPower
from gearbench.identification.lpm.regression import prepare
from gearbench.identification.smooth.estimate import SmoothModel, window_equations

SAMPLES, MESH_LINES, WIDTH = 810, 20, 60


@pytest.mark.parametrize("samples", [SAMPLES, 0])
def test_lines_that_the_operating_response_folds_onto_make_no_equation(samples: int) -> None:
    """40.5 samples to a mesh period: harmonics 21 to 60 of 20 lines come back 10 lines beside harmonics."""
    rng = np.random.default_rng(0)
    force, dte = rng.standard_normal((2, 2, SAMPLES))
    spectra = spectra_of(force, dte, MESH_LINES)
    regression = prepare(spectra.__class__(**{**vars(spectra), "samples": samples}), transient=False, reach=WIDTH)
    middle = 200
    equations = window_equations(regression, middle, SmoothModel(2, WIDTH, 20.0, False))
    assert equations is not None
    rows = np.arange(middle - WIDTH, middle + WIDTH + 1)
    beside = rows % MESH_LINES == 10
    # Of both realisations one row is lost to the operating response itself.
    lost = np.count_nonzero(rows % MESH_LINES == 0) + (2 * np.count_nonzero(beside) if samples else 0)
    assert equations.data.size == 2 * rows.size - lost
    assert np.isin(rows[beside] - middle, equations.offset).any() == (samples == 0)
    missing = MissingPower(regression, rows, 2)
    assert missing.operating[rows[beside] - 1].all() == (samples != 0)

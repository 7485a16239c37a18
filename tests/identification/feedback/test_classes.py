"""Residue classes of lines: those of which nothing is left need no solution."""

import numpy as np
from shared.ptv import spectra_of

from gearbench.identification.feedback.data import class_data


def test_the_operating_responses_class_is_there_if_a_realisation_is_left_of_it() -> None:
    """Of one realisation nothing is left beside the operating response, of two the difference. Equations are as many
    as before: a line each, of which classes that are their own mirror image hold every one twice."""
    d, top = 4, 40
    lines = np.random.default_rng(0).standard_normal((2, 2, 129)) * (np.arange(129) <= top) + 0j
    force, dte = np.fft.irfft(lines, axis=2)
    for runs, first in ((1, 1), (2, 0)):
        data = class_data(spectra_of(force[:runs], dte[:runs], d), top)
        classes = {int(line) % d for line in data.lines[data.valid]}
        assert min(classes) == first and max(classes) == d // 2
        wanted = sum((runs - (line % d == 0)) for line in range(1, data.top + 1))
        assert abs(data.equations - wanted) <= 0.5

"""Kinds of lines: what the excitation makes with itself is told from what the teeth's errors do."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from gearbench.diagnosis.forces.covariance import KINDS
from gearbench.diagnosis.simulation.target import DISTORTED, with_products

CYCLES, BINS = 96, 500
NAMES = (*KINDS, DISTORTED)


def kinds(excited: list[int]) -> np.ndarray:
    """Names (BINS,) of the kinds of all bins of a record whose torque has these lines; 24 teeth drive 96."""
    torque = np.zeros(BINS)
    torque[excited] = 1.0
    condition: Any = SimpleNamespace(
        bins=BINS, cycles=CYCLES, teeth=(24, 96), spectra={"torque_driver": torque.astype(complex)}
    )
    return np.array(NAMES)[with_products(condition)]


def test_sums_and_differences_of_excited_lines_and_mesh_orders_are_lines_of_their_own() -> None:
    found = kinds([17, 79, 113, 175])
    for bin_ in (34, 62, 51, 68, 85, 96 + 34, 192 - 34):
        assert found[bin_] == DISTORTED
    assert found[17] == found[175] == "excited" and found[96] == "operating"
    assert found[4] == "driver-shaft" and found[18] == "driven-shaft"


def test_a_difference_is_made_by_one_line_and_the_mesh_alone() -> None:
    found = kinds([17, 113])
    assert found[96 - 34] == found[96 - 17] == DISTORTED


def test_where_the_excitation_is_everywhere_lines_stay_what_they_are() -> None:
    assert DISTORTED not in kinds(list(range(1, 200, 3)))

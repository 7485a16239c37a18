"""Sidebands beyond the lines of the fit: they act back, and are trusted as far as the record has them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shared.reference_rig import ReferenceRig, reference_record

from gearbench.identification import IdentificationSettings, exact_itf, identify, itf
from gearbench.identification.feedback.functions import Splines
from gearbench.identification.feedback.result import FEWEST_HELD, doubt_beyond

HELD = 2 * FEWEST_HELD


def found(left: float, noise: float, valid: int, excited: int = 5) -> Any:
    """Lines of one class, all of size 1, of which the model leaves `left` above the `valid` ones and 0.3 below."""
    lines = np.arange(1, valid + HELD + 1)[None]
    dte = np.ones((1, lines.size, 2), dtype=complex)
    dte[:, :, 1] = 0.0  # the record that holds the operating response has no such lines
    rest = np.where(lines[:, :, None] > valid, left, 0.3) * dte
    data = SimpleNamespace(valid=lines <= valid, lines=lines, excited=excited, dte=dte)
    return SimpleNamespace(data=data, refined=SimpleNamespace(left=rest, noise=noise))


def test_what_is_left_of_lines_that_were_not_fitted_is_the_doubt() -> None:
    assert doubt_beyond(found(0.1, 0.0, 10)) == pytest.approx(0.01)
    assert doubt_beyond(found(3.0, 0.0, 10)) == 1.0
    # What noise leaves there is in the parameters' variance; one deviation of its power is not known.
    assert doubt_beyond(found(0.1, 0.01, 10)) == pytest.approx(0.01 / np.sqrt(HELD) / 0.99)
    assert doubt_beyond(found(1.0, 0.99, 10)) == 1.0


def test_too_few_such_lines_are_joined_by_those_above_the_excited_band() -> None:
    few = found(0.1, 0.0, 10)
    few.data.valid[0, :-FEWEST_HELD + 1] = True
    # Excited to line 5: of the lines 6 to 10 0.3 is left.
    assert doubt_beyond(few) == pytest.approx((0.01 * HELD + 0.09 * 5) / (HELD + 5))


def test_without_lines_above_the_excited_band_nothing_is_trusted() -> None:
    nothing = found(0.0, 0.0, 10, excited=10 + HELD)
    nothing.data.valid[:] = True
    assert doubt_beyond(nothing) == 1.0


def test_splines_go_on_as_mass_and_damper() -> None:
    """Of D = k + c s - m w^2 at the end of its splines: m w^2 and c s of the same sizes further out."""
    basis = Splines(8)
    half = basis.at(np.zeros(1)).shape[1] // 2
    coefficients = np.concatenate([np.full(half, -2.0), np.full(half, 0.3)])
    assert basis.at(np.array([1.0])) @ coefficients == pytest.approx(np.array([-2.0 + 0.3j]))
    assert basis.at(np.array([-1.5])) @ coefficients == pytest.approx(np.array([-2.0 * 2.25 - 0.45j]))


@pytest.mark.validation
def test_error_is_as_expected_where_a_tenth_of_the_sidebands_lies_beyond() -> None:
    """Half a second at 64 Hz mesh, sharp switches, no noise: with a model that ends with its lines the error was ten
    times the expected one."""
    rig = ReferenceRig(mesh_frequency=64.0)
    record = reference_record(rig, realisations=1, duration=0.5, band=(2.0, 2500.0), seed=3)
    frf = identify([record], IdentificationSettings("mesh-feedback", band=(10.0, 2400.0), step=40, phases=256, modes=0))
    exact = exact_itf(rig.system(512), frf.frequency.values, np.arange(256) / 256)
    error = float(np.linalg.norm(itf(frf).values - exact) / np.linalg.norm(exact))
    assert error < 0.01
    assert 0.5 < frf.attrs["expected_error"] / error < 2.0

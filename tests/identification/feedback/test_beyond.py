"""Sidebands beyond the lines of the fit: they act back, and are trusted as far as the record has them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm
from shared.reference_rig import ReferenceRig, reference_record

from gearbench.identification import IdentificationSettings, exact_itf, identify, itf
from gearbench.identification.feedback.branches import left_out
from gearbench.identification.feedback.functions import Fractions, Splines
from gearbench.identification.feedback.model import Model
from gearbench.identification.feedback.result import HIDDEN, doubt_beyond, htf_on

HELD = 200


def found(left: float, noise: float, valid: int, excited: int = 5) -> Any:
    """Lines of one class, all of size 1, of which the model leaves `left` above the `valid` ones and 0.3 below."""
    lines = np.arange(1, valid + HELD + 1)[None]
    dte = np.ones((1, lines.size, 2), dtype=complex)
    dte[:, :, 1] = 0.0  # the record that holds the operating response has no such lines
    rest = np.where(lines[:, :, None] > valid, left, 0.3) * dte
    data = SimpleNamespace(valid=lines <= valid, lines=lines, excited=excited, dte=dte)
    return SimpleNamespace(data=data, refined=SimpleNamespace(left=rest, noise=noise))


def test_what_is_left_of_lines_that_were_not_fitted_is_the_doubt() -> None:
    assert doubt_beyond(found(0.1, 0.0, 10)) == pytest.approx(0.01 / 0.9**2)
    assert doubt_beyond(found(3.0, 0.0, 10)) == 1.0


def test_what_noise_alone_leaves_counts_by_the_mean_of_its_positive_half() -> None:
    """200 lines of size 1 - 0.1: the deviation of the power left, over what is seen, and sqrt(2 / pi) of it."""
    assert doubt_beyond(found(0.1, 0.01, 10)) == pytest.approx(np.sqrt(2 / np.pi) * 0.01 / 0.81 / np.sqrt(HELD))


def test_lines_count_by_the_power_that_the_model_sees_in_them() -> None:
    """Half of the lines hold a hundredth, of which the model sees half: they hardly matter."""
    uneven = found(0.1, 0.0, 10)
    weak = uneven.data.lines[0] > 10 + HELD // 2
    uneven.data.dte[0, weak] *= 0.01
    uneven.refined.left[0, weak] = 0.5 * uneven.data.dte[0, weak]
    assert doubt_beyond(uneven) == pytest.approx(0.01 / 0.9**2, rel=1e-3)


def test_lines_in_noise_are_joined_by_those_above_the_excited_band() -> None:
    """Excited to line 5: of lines 6 to 10, larger than those beyond by ten, 0.3 is left."""
    hidden = found(0.1, 1.0, 10)
    hidden.data.dte[0, :10] *= 10.0
    hidden.refined.left[0, :10] *= 10.0
    assert 1.0 / 0.81 / np.sqrt(HELD) > HIDDEN
    power = 5 * 49.0**2 + HELD * 0.81**2
    part = (5 * 49.0 * (9.0 - 1.0) + HELD * 0.81 * (0.01 - 1.0)) / power
    above = part * np.sqrt(power)
    positive = 1.0 / np.sqrt(power) * norm.pdf(above) / norm.cdf(above)
    assert doubt_beyond(hidden) == pytest.approx(part + positive)


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


def test_what_a_model_leaves_out_that_ends_below_a_resonance_is_told() -> None:
    """One mass on a mesh whose resonance lies beyond the model's last line: against a model that ends far beyond."""
    resonance, lines = 1.7, np.arange(5, 100, 5)
    basis = Fractions(np.empty((0, 2)))
    harmonics = np.arange(1, 13)
    k = 0.2 * np.exp(0.7j * harmonics) / harmonics
    model = Model(basis, np.array([1.0, 0.06, resonance**-2]), np.array([1.0, 0.0, 0.0]), k, 0.0 * k)
    data: Any = SimpleNamespace(mesh_lines=10, top=100, stiffness_unit=1.0, furthest_at=lambda ratio: 150)
    short, whole = (htf_on(model, data, lines, 20, furthest=end) for end in (150, 900))
    error = float(np.sum(np.abs(whole - short) ** 2))
    assert error > (0.01 * np.linalg.norm(whole)) ** 2
    assert float(np.sum(left_out(model, data, lines, 20))) == pytest.approx(error, rel=0.3)


@pytest.mark.validation
def test_a_resonance_above_the_excited_band_is_in_the_sidebands() -> None:
    """Excited to 800 Hz, first mode at 1013 to 1231 Hz, no noise: with a fit that ends at eight sidebands, 1056 Hz, the
    response erred by 7.2 %."""
    rig = ReferenceRig(mesh_frequency=32.0)
    record = reference_record(rig, realisations=1, duration=1.0, band=(2.0, 800.0), seed=3)
    frf = identify([record], IdentificationSettings("mesh-feedback", band=(10.0, 790.0), step=20, phases=128, modes=0))
    exact = exact_itf(rig.system(512), frf.frequency.values, np.arange(128) / 128)
    error = float(np.linalg.norm(itf(frf).values - exact) / np.linalg.norm(exact))
    assert error < 0.03
    assert 0.5 < frf.attrs["expected_error"] / error < 2.0

"""Dte from angles alone: the form with the centres' motion against the exact response of that output."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from shared.reference_rig import ANGLES, DIRECTION, ReferenceRig, reference_record
from shared.rig_model import rig_model

from gearbench.identification import IdentificationSettings, exact_itf, itf
from gearbench.identification.estimation import by_feedback
from gearbench.identification.feedback.data import ClassData, class_data
from gearbench.identification.feedback.model import Model
from gearbench.identification.feedback.refine import linearised, output_error, response
from gearbench.identification.feedback.result import htf_on
from gearbench.identification.spectra.records import record_spectra
from gearbench.identification.task import Task, output_lines
from gearbench.identification.truth.periodic import itf_from_htf

RIG = ReferenceRig(mesh_frequency=64.0, edge=0.1)


def angle_record(noise: float) -> xr.Dataset:
    return reference_record(
        RIG, realisations=1, duration=0.25, band=(4.0, 2600.0), noise=noise, start_phase=0.3, substeps=2, output=ANGLES
    )


def relative(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


@pytest.fixture(scope="module")
def data() -> ClassData:
    spectra, excited, _ = record_spectra([angle_record(0.0)], sidebands=40)
    return class_data(spectra, round(excited[1] / spectra.spacing))


@pytest.fixture(scope="module")
def model(data: ClassData) -> Model:
    return rig_model(RIG, data, centres=True)


def test_the_rigs_own_functions_give_the_exact_response_of_its_angles(data: ClassData, model: Model) -> None:
    """Harmonic balance against the monodromy, and the response against the integrated record. Without E, or with the
    deflection itself, the ITF is off by a tenth and more."""
    lines = np.arange(200, 400, 13)
    exact = exact_itf(RIG.system(512, ANGLES), lines * data.spacing, np.arange(64) / 64)
    assert relative(itf_from_htf(htf_on(model, data, lines, 60), 64), exact) < 1e-3
    assert relative(exact_itf(RIG.system(512, DIRECTION), lines * data.spacing, np.arange(64) / 64), exact) > 0.1
    left = (data.dte - response(model, data))[1:]
    assert np.linalg.norm(left[data.valid[1:]]) < 2e-3 * np.linalg.norm(data.dte[1:][data.valid[1:]])


def test_the_common_factor_leaves_the_response(data: ClassData, model: Model) -> None:
    """N times 1.3, with D, k and c times its square."""
    assert relative(response(model.scaled(1.3), data), response(model, data)) < 1e-9
    step = 1e-6
    along = (model.scaled(1 + step).vector() - model.scaled(1 - step).vector()) / (2 * step)
    assert along == pytest.approx(model.scale_direction(), abs=1e-7)


def test_slopes_of_the_output_error(data: ClassData, model: Model) -> None:
    """Of all kinds of parameters, against differences of the error."""
    begin = model.moved(model.vector() * (1 + 0.02 * np.random.default_rng(1).standard_normal(model.vector().size)))
    _, pull = linearised(begin, data)
    vector = begin.vector()
    sizes = np.cumsum([0, begin.d.size, begin.n.size, begin.e.size, begin.basis.pairs.size])
    for parameter in (*sizes, *(sizes[1:4] + 3), sizes[3] + 2, sizes[4] + 41, sizes[4] + 81):
        step = np.zeros(vector.size)
        step[parameter] = 1e-5 * max(abs(vector[parameter]), 1e-3)
        rise = output_error(begin.moved(vector + step), data) - output_error(begin.moved(vector - step), data)
        assert rise / (2 * step[parameter]) == pytest.approx(-2 * pull[parameter], rel=1e-3, abs=1e-4)


def test_records_say_that_they_hold_angles_only() -> None:
    record = angle_record(0.0)
    assert record_spectra([record], sidebands=40)[0].angle_only
    record.dte.attrs["angle_only"] = 0
    assert not record_spectra([record], sidebands=40)[0].angle_only


def by_mesh_feedback(record: xr.Dataset) -> xr.Dataset:
    """Mesh feedback alone, over 200 to 2400 Hz."""
    spectra, excited, notes = record_spectra([record], sidebands=40)
    settings = IdentificationSettings("mesh-feedback", phases=64, modes=0)
    lines = output_lines(spectra, (200.0, 2400.0), excited, 10)
    return by_feedback(Task(spectra, lines, settings, excited, tuple(notes), 0.0, lambda part, message: None))


def test_stiffness_from_angles_is_known_but_for_a_compliance_in_series() -> None:
    """1/k' = 1/k + e: a spring in series with the mesh, which the supports are; the variance holds it. The slope is
    the square of N at frequency 0, of which a quarter of a second says little: over draws of noise 0.993 to 1.041, with
    a standard deviation of 0.024."""
    found = by_mesh_feedback(angle_record(0.01))
    k = RIG.stiffness(found.phase.values)
    told, deviation = found["mesh_stiffness"].values, np.sqrt(found["mesh_stiffness_var"].values)
    (slope, series), *_ = np.linalg.lstsq(np.stack([1 / k, np.full(k.size, 1e-8)], axis=1), 1 / told, rcond=None)
    assert slope == pytest.approx(1.0, abs=0.07)
    assert 0 < series * 1e-8 < 1.5 * sum(1 / support for support in RIG.support_stiffness)
    assert np.std(1 / told - slope / k) < 0.05 * np.std(1 / told)
    assert told.mean() < 0.8 * k.mean()
    assert (np.abs(told - k) < 2 * deviation).all()
    assert "only 1/k plus a constant is known" in found.attrs["warnings"]


@pytest.mark.validation
def test_the_response_of_angles_alone_is_found_with_the_centres_motion() -> None:
    """Supports softer than the mesh, half a second at 40 dB: the form with the centres is chosen, knows its error, and
    errs by half of what the one without does or less (0.9 against 3.0 %)."""
    rig = ReferenceRig(
        mass=1.4, centre_mass=(2.5, 3.4), support_stiffness=(1.1e8, 1.5e8), support_ratio=0.05, stiffness_single=1.2e8,
        stiffness_double=2.2e8, contact_ratio=1.45, edge=0.06, mesh_ratio=0.04, mesh_frequency=64.0,
    )  # fmt: skip
    record = reference_record(
        rig, realisations=1, duration=0.5, band=(2.0, 2600.0), noise=0.01, start_phase=0.3, seed=4, output=ANGLES
    )
    found = by_mesh_feedback(record)
    exact = exact_itf(rig.system(1024, ANGLES), found.frequency.values, np.arange(64) / 64)
    error = relative(itf(found).values, exact)
    assert found.attrs["form"] == "centres from angles"
    assert "the centres' motion is identified" in found.attrs["warnings"]
    assert error < 0.015
    assert 0.5 < found.attrs["expected_error"] / error < 2.0
    record.dte.attrs["angle_only"] = 0
    plain = by_mesh_feedback(record)
    assert plain.attrs["form"] == "dte" and relative(itf(plain).values, exact) > 2 * error

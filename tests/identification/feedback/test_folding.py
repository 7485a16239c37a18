"""Sidebands beyond half the sampling rate: how they come back, what tells their part, the response without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from shared.ptv import spectra_of
from shared.reference_rig import ReferenceRig, reference_record
from shared.rig_model import rig_model

from gearbench.identification import IdentificationSettings, exact_itf, identify, itf
from gearbench.identification.feedback.data import FURTHER, class_data
from gearbench.identification.feedback.folding import folded, likely
from gearbench.identification.feedback.refine import linearised, output_error, refined, response, told_beside
from gearbench.identification.spectra.folded import folded_harmonics
from gearbench.identification.spectra.records import record_spectra
from gearbench.records.record import make_record

RIG = ReferenceRig(mesh_frequency=200.0, edge=0.05)


def thinned(record: xr.Dataset, *, filtered: bool, noise: float, seed: int) -> xr.Dataset:
    """Every second sample, behind an ideal filter or not, with white noise relative to the dte's own deviation."""
    dte = record.dte.values
    if filtered:
        lines = np.fft.rfft(dte, axis=1)
        lines[:, dte.shape[1] // 4 :] = 0.0
        dte = np.fft.irfft(lines, dte.shape[1], axis=1)
    dte = dte[:, ::2]
    dte = dte + noise * dte.std() * np.random.default_rng(seed).standard_normal(dte.shape)
    attributes = {name: record.attrs[name] for name in ("periods", "mesh_period", "settling_residual")}
    attributes |= {"sampling_rate": record.attrs["sampling_rate"] / 2, "samples_per_period": dte.shape[1]}
    others = {name: np.ascontiguousarray(record[name].values[:, ::2]) for name in ("force", "mesh_phase")}
    thin = make_record({"dte": dte, **others}, attributes)
    thin.dte.attrs["angle_only"] = 0
    return thin


@pytest.fixture(scope="module")
def fast() -> xr.Dataset:
    """Half a second at 16 kHz, excited to 2.6 kHz, without noise; the start is no whole number of samples after phase
    0 at half that rate."""
    return reference_record(
        RIG, realisations=1, duration=0.5, sampling_rate=16000.0, band=(2.0, 2600.0), start_phase=0.29, substeps=2
    )


def result(record: xr.Dataset) -> tuple[float, float, xr.Dataset]:
    """Error of the response, what is expected, and all of it."""
    settings = IdentificationSettings("mesh-feedback", band=(700.0, 2400.0), step=20, phases=64, modes=0)
    frf = identify([record], settings)
    exact = exact_itf(RIG.system(512), frf.frequency.values, np.arange(64) / 64)
    error = float(np.linalg.norm(itf(frf).values - exact) / np.linalg.norm(exact))
    return error, float(frf.attrs["expected_error"]), frf


def test_lines_come_back_as_a_sampler_makes_them() -> None:
    """Random lines at 1024 samples, sampled with 512: what these have in excess is what folds. Three realisations,
    which are rotated, begin at different parts of a sample, and 512 samples are no whole number of mesh harmonics."""
    d, rng = 6, np.random.default_rng(2)
    lines = np.zeros((2, 3, 513), dtype=complex)
    lines[0, :, 1:200] = rng.standard_normal((3, 199)) + 1j * rng.standard_normal((3, 199))
    lines[1, :, 1:390] = rng.standard_normal((3, 389)) + 1j * rng.standard_normal((3, 389))
    lines[:, :, ::d] = 0.0
    force, dte = np.fft.irfft(lines, axis=2)
    start = np.array([0.1, 0.47, 0.815])
    whole = class_data(spectra_of(force, dte, d, start=start), 105, FURTHER)
    sampled = class_data(
        replace(spectra_of(force[:, ::2], dte[:, ::2], d, start=start), samples=512, spacing=1 / 1024), 105, FURTHER
    )
    assert sampled.furthest == whole.furthest > 390 and sampled.folds and not whole.folds
    seen = whole.dte * whole.dte_unit / sampled.dte_unit
    kept = np.where(sampled.dte != 0, seen, 0.0)
    found = folded(seen, sampled)
    assert np.linalg.norm(found) > 0.3 * np.linalg.norm(kept)
    assert np.abs(sampled.dte - kept - found).max() < 1e-9


def test_there_was_a_filter_or_none_unless_neither_agrees() -> None:
    assert likely(0.5, 0.3, 0.0) == pytest.approx((0.5, 0.5))
    part = 1.0 / (1.0 + np.exp(-((0.7**2 - 0.3**2) / (2 * 0.5**2))))  # of two normal densities
    assert likely(0.7, 0.5, 0.0) == pytest.approx((part, np.sqrt(part * (1 - part))))
    assert likely(0.97, 0.01, 0.0) == pytest.approx((1.0, 0.0))
    assert likely(1.2, 0.01, 1.0) == pytest.approx((1.0, 0.2))
    assert likely(0.7, 0.01, 1.0) == pytest.approx((1.0, 0.3))
    assert likely(0.7, 0.01, 0.0) == pytest.approx((0.0, 0.7))


def test_the_residual_tells_a_change_beside_all_parameters(fast: xr.Dataset) -> None:
    """A change that parameters make is theirs: their shift, and a part that nothing tells; of another one, its part."""
    spectra, excited, _ = record_spectra([thinned(fast, filtered=True, noise=0.01, seed=0)], sidebands=40)
    data = class_data(spectra, round(excited[1] / spectra.spacing))
    fit = refined(rig_model(RIG, data), data)
    model = fit.model
    step = np.zeros(model.vector().size)
    step[model.free] = 1e-5 * abs(model.k[0])
    own = 1e5 * (response(model.moved(model.vector() + step), data) - response(model, data)) * (data.dte != 0)
    _, deviation, shift = told_beside(fit, data, own)
    assert np.linalg.norm(shift - 1e5 * step) < 0.02 * np.linalg.norm(1e5 * step)
    folds = folded(response(model, data), data)
    told, apart, _ = told_beside(fit, data, folds)
    assert deviation * np.linalg.norm(own) > 50 * apart * np.linalg.norm(folds)
    assert abs(told) < 4 * apart
    more = replace(data, dte=data.dte + 0.37 * folds)
    assert told_beside(fit, more, folds)[0] == pytest.approx(told + 0.37, abs=1e-6)


def test_the_response_is_that_of_a_filtered_record(fast: xr.Dataset) -> None:
    """Without a filter, 50 dB: before folded lines were known it erred by 1 % and expected 0.2 %."""
    errors = []
    for filtered, part, words in ((False, 1.0, "sidebands beyond half the sampling rate are in"), (True, 0.0, "")):
        error, expected, frf = result(thinned(fast, filtered=filtered, noise=0.003, seed=0))
        assert frf.attrs["folded_part"] == pytest.approx(part, abs=1e-6)
        assert words in frf.attrs["warnings"] and (bool(words) or "half the sampling" not in frf.attrs["warnings"])
        assert 0.6 < expected / error < 1.6
        errors.append(error)
    assert errors[0] < 1.3 * errors[1]


def test_nothing_folds_where_the_model_ends_below_half_the_rate(fast: xr.Dataset) -> None:
    spectra, excited, _ = record_spectra([fast], sidebands=40)
    top = round(excited[1] / spectra.spacing)
    assert not class_data(replace(spectra, samples=3 * class_data(spectra, top).top * 2), top).folds


@pytest.mark.validation
@pytest.mark.parametrize("filtered", [False, True])
def test_expected_error_is_the_true_one_with_and_without_a_filter(fast: xr.Dataset, filtered: bool) -> None:
    """Eight draws of noise, 50 dB; where folded lines are not told within their deviation more is expected."""
    found = [result(thinned(fast, filtered=filtered, noise=0.003, seed=seed)) for seed in range(8)]
    ratios = [expected / error for error, expected, _ in found]
    assert 0.8 < np.median(ratios) < 1.3
    assert min(ratios) > 0.6


def test_what_folds_inside_classes_is_what_folds() -> None:
    """A mesh period of 32 samples: class by class the same as line by line, two realisations that begin alike."""
    d, samples, rng = 16, 512, np.random.default_rng(5)
    lines = rng.standard_normal((2, 2, 257)) + 1j * rng.standard_normal((2, 2, 257))
    lines[:, :, ::d] = 0.0
    force, dte = np.fft.irfft(lines * (np.arange(257) < 220), axis=2)
    spectra = spectra_of(force, dte, d, start=np.array([0.3, 0.3 + 5 / 32]))
    data = class_data(replace(spectra, samples=samples), 219)
    assert data.folds and data.folds_inside
    seen = rng.standard_normal(data.dte.shape) + 1j * rng.standard_normal(data.dte.shape)
    seen *= data.modelled[:, :, None]
    # Classes that are their own mirror image are those of real signals.
    for index in np.flatnonzero(2 * np.arange(d // 2 + 1) % d == 0):
        position = {int(line): at for at, line in enumerate(data.lines[index]) if data.modelled[index, at]}
        for line, at in position.items():
            if line < 0:
                seen[index, at] = seen[index, position[-line]].conj()
            elif line == 0:
                seen[index, at] = seen[index, at].real
    inside = replace(data, part=0.4)
    found = np.stack([inside.sampled(one) for one in seen]) - seen
    assert np.abs(np.where(data.dte != 0, found, 0.0) - 0.4 * folded(seen, data)).max() < 1e-12
    apart = spectra_of(force, dte, d, start=np.array([0.3, 0.31]))
    assert not class_data(replace(apart, samples=samples), 219).folds_inside
    assert not class_data(replace(spectra, samples=520), 219).folds_inside


def test_derivatives_are_those_of_what_a_sampler_shows(fast: xr.Dataset) -> None:
    """Of the residual of a model whose lines fold, by differences, for a number of D, of N, of k and of c."""
    spectra, excited, _ = record_spectra([thinned(fast, filtered=False, noise=0.01, seed=0)], sidebands=40)
    data = replace(class_data(spectra, round(excited[1] / spectra.spacing)), part=1.0)
    model = rig_model(RIG, data)
    gram, right = linearised(model, data)
    error, vector = output_error(model, data), model.vector()
    for number in (1, model.d.size + 2, model.free + 1, model.free + 2 * model.harmonics):
        step = np.zeros(vector.size)
        step[number] = np.sqrt(1e-8 * error / gram[number, number])
        up, down = (output_error(model.moved(vector + sign * step), data) for sign in (1.0, -1.0))
        wanted = -2 * right[number] * step[number]
        assert (up - down) / 2 == pytest.approx(wanted, rel=1e-3, abs=1e-8 * error)


def test_folded_harmonics_are_those_of_a_sampled_cosine() -> None:
    """81 samples hold two mesh periods: harmonics from the 21st on come back, every second one between the others."""
    samples, d = 810, 20
    time = np.arange(samples) / samples
    wanted = set()
    for order in range(1, 101):
        size = np.abs(np.fft.rfft(np.cos(2 * np.pi * order * d * time + 0.3)))
        line = int(np.argmax(size))
        wanted |= {line} if order * d > samples / 2 else set()
    assert set(np.abs(folded_harmonics(samples, d))) == wanted
    assert folded_harmonics(800, d).size == 0 and folded_harmonics(0, d).size == 0


@pytest.mark.parametrize("noise", [1e-3, 10**-3.5])
def test_a_record_of_little_noise_tells_what_folds(fast: xr.Dataset, noise: float) -> None:
    """60 and 70 dB: before lines that fold had derivatives the harmonics took them in, and it erred by 1 %."""
    error, expected, frf = result(thinned(fast, filtered=False, noise=noise, seed=0))
    assert frf.attrs["folded_part"] == pytest.approx(1.0, abs=1e-6)
    assert error < 3e-4
    assert 0.5 < expected / error < 1.6

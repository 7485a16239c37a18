"""Coset multisines, which excite two classes of lines of sixteen: what a local method promises between them."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from shared.reference_rig import ReferenceRig, integrate

from gearbench.identification import IdentificationSettings, exact_itf, identify, itf, random_phase_multisine
from gearbench.records.record import make_record

RIG = ReferenceRig(mesh_frequency=64.0, edge=0.05)
CLASSES, RATE = 16, 8192.0


@pytest.fixture(scope="module")
def record() -> xr.Dataset:
    """Ten realisations of a quarter of a second, 40 dB."""
    rng = np.random.default_rng(0)
    samples = round(CLASSES / RIG.mesh_frequency * RATE)
    signals = [
        random_phase_multisine(
            samples, RATE, (1.0, 3000.0), amplitude=500.0, grid="coset", modulus=CLASSES, residue=1, rng=rng
        )
        for _ in range(10)
    ]
    dte = integrate(RIG, signals, mean=2000.0, substeps=2)
    noise = 0.01 * float((dte - dte.mean(axis=0)).std()) * rng.standard_normal(dte.shape)
    attributes = {
        "sampling_rate": RATE, "samples_per_period": samples, "periods": 1, "mesh_period": 1 / RIG.mesh_frequency,
        "mesh_phase": 0.0, "settling_residual": 1e-9,
    }  # fmt: skip
    return make_record({"dte": dte + noise, "force": np.stack([s.sample(samples) for s in signals]) + 2000}, attributes)


def error_of(frf: xr.Dataset) -> float:
    exact = exact_itf(RIG.system(512), frf.frequency.values[::5], np.arange(32) / 32)
    return float(np.linalg.norm(itf(frf).values[::5] - exact) / np.linalg.norm(exact))


def test_the_choice_left_free_is_one_that_knows_its_error(record: xr.Dataset) -> None:
    frf = identify([record], IdentificationSettings(band=(700.0, 2500.0), phases=32, modes=0))
    assert frf.attrs["branches"] == "smooth"
    assert 0.8 < frf.attrs["expected_error"] / error_of(frf) < 1.6
    assert "leaves most lines" not in frf.attrs["warnings"]


def test_polynomials_say_that_they_do_not(record: xr.Dataset) -> None:
    settings = IdentificationSettings(band=(700.0, 2500.0), phases=32, modes=0, branches="polynomials")
    frf = identify([record], settings)
    assert frf.attrs["expected_error"] < 0.6 * error_of(frf)
    assert "the force leaves most lines of its band out" in frf.attrs["warnings"]


def test_noise_of_the_torque_fills_no_lines(record: xr.Dataset) -> None:
    force = record["force"]
    noise = 0.01 * float(force.std()) * np.random.default_rng(1).standard_normal(force.shape)
    settings = IdentificationSettings(band=(700.0, 2500.0), phases=32, modes=0, branches="polynomials")
    frf = identify([record.assign(force=(force.dims, force.values + noise, force.attrs))], settings)
    assert "the force leaves most lines of its band out" in frf.attrs["warnings"]

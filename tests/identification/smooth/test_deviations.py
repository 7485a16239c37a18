"""Stated variances of smooth branches against draws of noise: they are of the whole error, with what the prior leaves
open, so that the errors are held against the exact response, not against their mean."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from shared.reference_rig import ReferenceRig, reference_record

from gearbench.identification import IdentificationSettings, exact_itf, htf, htf_from_itf, identify, itf

RIG = ReferenceRig(mesh_frequency=64.0, edge=0.05)
DRAWS, HARMONICS, NOISE = 12, 33, 0.03
Floats = NDArray[np.float64]


@cache
def ratios() -> tuple[float, Floats]:
    """Stated over actual rms error: of the HTF in all, and of the ITF at each of 64 phases."""
    clean = reference_record(RIG, realisations=1, duration=0.5, band=(2.0, 2600.0))
    dte = clean["dte"]
    settings = IdentificationSettings(
        band=(900.0, 1300.0), step=8, phases=64, modes=0, branches="smooth", harmonics=HARMONICS
    )
    random = np.random.default_rng(5)
    stated, errors, of_htf = [], [], []
    for _ in range(DRAWS):
        noise = NOISE * float(dte.std()) * random.standard_normal(dte.shape)
        frf = identify([clean.assign(dte=(dte.dims, dte.values + noise, dte.attrs))], settings)
        fine = exact_itf(RIG.system(512), frf.frequency.values, np.arange(512) / 512)
        stated.append((frf["itf_var"].values.sum(axis=0), frf["htf_var"].values.sum()))
        errors.append(np.sum(np.abs(itf(frf).values - fine[:, ::8]) ** 2, axis=0))
        of_htf.append(np.sum(np.abs(htf(frf).values - htf_from_itf(fine, HARMONICS)) ** 2))
    over_phase = np.sqrt(sum(one for one, _ in stated) / sum(errors))
    return float(np.sqrt(sum(one for _, one in stated) / sum(of_htf))), over_phase


@pytest.mark.validation
def test_deviations_of_the_htf_are_those_of_its_errors() -> None:
    assert 0.8 < ratios()[0] < 1.6


@pytest.mark.validation
def test_deviations_of_the_itf_are_a_mean_over_phase() -> None:
    """Right within a zone; at the switches, which the highest branches make, errors are twice as large as stated."""
    _, over_phase = ratios()
    assert 0.8 < float(np.median(over_phase)) < 1.6
    assert float(over_phase.min()) > 0.4 and float(over_phase.max()) < 1.6
    assert np.mean(over_phase > 0.8) > 0.85

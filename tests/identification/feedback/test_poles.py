"""Poles of D and N from the equations themselves, where splines know them badly."""

from __future__ import annotations

import numpy as np
import pytest
from shared.reference_rig import ReferenceRig, reference_record

from gearbench.identification import IdentificationSettings, exact_itf, identify, itf
from gearbench.identification.feedback.data import class_data
from gearbench.identification.feedback.functions import Splines
from gearbench.identification.feedback.poles import linear_models
from gearbench.identification.feedback.start import first_model
from gearbench.identification.spectra.records import record_spectra


def test_pole_of_the_supports() -> None:
    """1/P2 has poles where torsion and supports together give no motion; N = P1/P2 has the same. The lower
    one, below the first mode, follows from the equations with the harmonics of a first model."""
    rig = ReferenceRig(mesh_frequency=64.0, edge=0.1)
    record = reference_record(rig, realisations=1, duration=0.25, band=(4.0, 2600.0), substeps=2)
    spectra, excited, _ = record_spectra([record], sidebands=40)
    data = class_data(spectra, round(excited[1] / spectra.spacing))
    found = linear_models(first_model(data, Splines(20), 20), data, 1)[-1].basis.pairs[0]
    # Numerator of 1/(m s^2) + 1/(m1 s^2 + c1 s + k1) + 1/(m2 s^2 + c2 s + k2), which P2 is.
    supports = [
        np.array([m, 2 * rig.support_ratio * np.sqrt(k * m), k])
        for m, k in zip(rig.centre_mass, rig.support_stiffness, strict=True)
    ]
    torsion = np.array([rig.mass, 0.0, 0.0])
    numerator = np.polymul(*supports) + np.polymul(torsion, supports[0]) + np.polymul(torsion, supports[1])
    wanted = min(np.roots(numerator) / data.omega_unit, key=abs)
    assert np.sqrt(found[1]) == pytest.approx(abs(wanted), rel=0.01)
    assert found[0] == pytest.approx(-2 * wanted.real, rel=0.2)


@pytest.mark.validation
def test_soft_supports_are_found_through_noise() -> None:
    """Supports at 133 and 191 Hz with 6 %, a mode of 0.8 %, 54 dB: with poles read off splines the rounds ended far
    from the noise, at an error of 69 %."""
    rig = ReferenceRig(
        mass=8.27, centre_mass=(15.1, 8.92), support_stiffness=(1.05e7, 1.28e7), support_ratio=0.064,
        stiffness_single=3.7e7, stiffness_double=6.0e7, contact_ratio=1.48, parabola=0.035, edge=0.099,
        mesh_ratio=0.00765, mesh_frequency=96.5,
    )  # fmt: skip
    record = reference_record(
        rig, realisations=1, duration=108 / 96.5, sampling_rate=40 * 96.5, band=(1.0, 1337.0), noise=0.002, seed=9
    )
    settings = IdentificationSettings("mesh-feedback", band=(27.0, 1270.0), step=30, phases=128, modes=0)
    frf = identify([record], settings)
    exact = exact_itf(rig.system(512), frf.frequency.values, np.arange(128) / 128)
    error = float(np.linalg.norm(itf(frf).values - exact) / np.linalg.norm(exact))
    assert error < 0.005
    assert 0.5 < frf.attrs["expected_error"] / error < 2.0

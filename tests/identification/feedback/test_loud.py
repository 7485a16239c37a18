"""Phases at which a fit leaves more than elsewhere: found as in time, never in even noise, and counted in variances."""

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray
from shared.reference_rig import ReferenceRig, reference_record

from gearbench.identification import IdentificationSettings, htf, identify, itf
from gearbench.identification.feedback.data import ClassData, class_data
from gearbench.identification.feedback.loud import by_phase, loud_parts
from gearbench.identification.spectra.records import record_spectra
from gearbench.records.record import make_record

RATE, SAMPLES, PERIODS = 4096.0, 8192, 64
LOUD = (0.58, 0.64)


def classes(dte: NDArray[np.float64], band: float = 2000.0) -> ClassData:
    """Lines of an error over 64 mesh periods in 2 s, as of a record that is excited up to `band`."""
    time = np.arange(SAMPLES) / RATE
    force = np.fft.irfft((np.fft.rfftfreq(SAMPLES, 1 / RATE) < band) * np.exp(1j * np.arange(SAMPLES // 2 + 1) ** 2))
    attributes = {"sampling_rate": RATE, "samples_per_period": SAMPLES, "periods": 1, "mesh_period": 2.0 / PERIODS}
    signals = {"dte": dte, "force": force[None], "mesh_phase": 32.0 * time[None]}
    spectra, excited, _ = record_spectra([make_record(signals, attributes)], sidebands=4)
    return class_data(spectra, round(excited[1] / spectra.spacing))


def windowed(draw: int, size: float) -> NDArray[np.float64]:
    """White noise of deviation 1, of `size` from phase 0.58 to 0.64."""
    phase = 32.0 * np.arange(SAMPLES) / RATE % 1.0
    loud = (phase > LOUD[0]) & (phase < LOUD[1])
    return np.asarray(np.where(loud, size, 1.0) * np.random.default_rng(draw).standard_normal(SAMPLES))[None]


def test_power_by_phase_is_that_of_the_samples() -> None:
    """Parts of a mesh period hold the squares of their own samples, but for the mesh's mean, which the operating
    response takes, and what the edge of the band blurs."""
    noise = windowed(1, 6.0)
    data = classes(noise)
    count, power = by_phase(data.dte, data)
    own = noise.reshape(PERIODS, -1)
    own = own - own.mean(axis=0)
    part = np.arange(own.shape[1]) * power.size // own.shape[1]
    wanted = np.bincount(part, np.sum(own**2, axis=0))
    assert power.size >= 40
    found, wanted = power / power.sum(), wanted / wanted.sum()
    assert np.abs(found - wanted).max() < 0.15 * wanted.max()
    loud = np.flatnonzero(loud_parts(count, power)) / power.size
    assert loud.size and LOUD[0] - 0.04 < loud.min() and loud.max() < LOUD[1] + 0.02


def test_even_noise_has_no_loud_phase() -> None:
    for draw in range(20):
        data = classes(windowed(draw, 1.0))
        assert not loud_parts(*by_phase(data.dte, data)).any()


def deviations(found: list[xr.Dataset], own: NDArray[np.float64], name: str) -> float:
    """Predicted over empirical standard deviation."""
    predicted = np.mean([frf[name].values.mean() for frf in found])
    return float(np.sqrt(predicted / np.mean(np.var(own, axis=0, ddof=1))))


@pytest.mark.validation
def test_deviations_hold_where_noise_is_loud_at_a_switch() -> None:
    """Ten draws of noise that is ten times as large around one switch of stiffness as elsewhere."""
    rig = ReferenceRig(mesh_frequency=64.0, edge=0.1)
    clean = reference_record(rig, realisations=1, duration=0.25, band=(4.0, 2600.0))
    size = 0.003 * float((clean.dte - clean.dte.mean()).std())
    phase = clean["mesh_phase"].values % 1.0
    size = np.where((phase > LOUD[0]) & (phase < LOUD[1]), 10.0, 1.0) * size
    band = (800.0, 1600.0)
    settings = IdentificationSettings(
        method="mesh-feedback", harmonics=14, band=band, phases=32, step=8, modes=0
    )
    found = []
    for seed in range(10):
        noise = size * np.random.default_rng(seed).standard_normal(clean.dte.shape)
        found.append(identify([clean.assign(dte=clean.dte + noise)], settings))
    for values, name in (
        (np.array([itf(frf).values for frf in found]), "itf_var"),
        (np.array([htf(frf).values for frf in found]), "htf_var"),
        (np.array([frf.mesh_stiffness.values for frf in found]), "mesh_stiffness_var"),
    ):
        assert 0.8 < deviations(found, values, name) < 1.6, name
    phases = np.arange(32) / 32
    for part in ((phases > LOUD[0] - 0.03) & (phases < LOUD[1] + 0.03), (phases > 0.1) & (phases < 0.4)):
        own = np.array([frf.mesh_stiffness.values[part] for frf in found])
        kept = [frf.sel(phase=frf.phase.values[part]) for frf in found]
        assert 0.8 < deviations(kept, own, "mesh_stiffness_var") < 1.6
    assert all(frf.attrs["loud_error"] > 0.0 for frf in found)

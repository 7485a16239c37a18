"""A path beside the mesh, which mesh feedback cannot explain, is part of the error that it expects of itself."""

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray
from shared.reference_rig import ReferenceRig, reference_record

from gearbench.identification import IdentificationSettings, exact_itf, itf
from gearbench.identification.estimation import by_feedback
from gearbench.identification.spectra.records import record_spectra
from gearbench.identification.task import Task, output_lines

RIG = ReferenceRig(mesh_frequency=2.0)
FREQUENCIES = np.arange(900.0, 1301.0, 20.0)
PHASES = np.arange(64) / 64


def side(frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Response of a path beside the mesh, but for its size."""
    s = 1j * frequency
    return np.asarray(1.0 / ((1 + s / 800.0) * (1 + 0.1 * s / 1500.0 + (s / 1500.0) ** 2)))


@pytest.mark.parametrize("share", [0.0, 0.03])
def test_what_chance_may_hide_counts(share: float) -> None:
    """At 2 Hz and one second a window of 80 equations has 1300 branches: what residuals share with the force is lost
    in chance, though they are 36 times the noise."""
    clean = reference_record(RIG, realisations=1, duration=1.0, band=(1.0, 2600.0), noise=0.003)
    force = clean["force"].values[0] - clean["force"].values[0].mean()
    known = exact_itf(RIG.system(2048), FREQUENCIES, PHASES)
    turning = np.cos(6 * np.pi * PHASES)
    beside = side(FREQUENCIES)[:, None] * turning
    size = share * np.linalg.norm(known) / np.linalg.norm(beside)
    way = np.fft.irfft(np.fft.rfft(force) * side(np.arange(force.size // 2 + 1.0)), force.size)
    dte = clean["dte"].values + size * way * np.cos(6 * np.pi * clean["mesh_phase"].values)
    frf = _feedback(clean.assign(dte=(clean["dte"].dims, dte, clean["dte"].attrs)))
    wanted = known + size * beside
    error = np.linalg.norm(itf(frf).sel(frequency=FREQUENCIES).values - wanted) / np.linalg.norm(wanted)
    assert 0.8 < frf.attrs["expected_error"] / error < 1.6


def _feedback(record: xr.Dataset) -> xr.Dataset:
    """The result of mesh feedback, whatever it expects of itself."""
    settings = IdentificationSettings(method="mesh-feedback", band=(900.0, 1300.0), step=20, phases=64, modes=0)
    spectra, excited, notes = record_spectra([record], sidebands=100)
    lines = output_lines(spectra, (900.0, 1300.0), excited, 20)
    return by_feedback(Task(spectra, lines, settings, excited, tuple(notes), 0.0, lambda part, message: None))

"""Mesh feedback at a speed that varies, against an outside integrator."""

import numpy as np
import pytest
import xarray as xr
from shared.reference_rig import ReferenceRig
from shared.varying_rig import truth_at, varying_record, wandering

from gearbench.identification import IdentificationSettings, SpectraError, estimation, identify, itf
from gearbench.identification.feedback.varying import Signals, loud_at
from gearbench.identification.feedback.varying_frf import signals_of
from gearbench.identification.spectra.course import speed_varies
from gearbench.records.even_speed import mesh_phase

RIG = ReferenceRig(mesh_frequency=60.0, edge=0.2)
SETTINGS = IdentificationSettings("mesh-feedback", 16, band=(700.0, 1900.0), phases=64, modes=1, step=20)


@pytest.fixture(scope="module")
def record() -> xr.Dataset:
    course = wandering(60.0, 0.5)
    return varying_record(RIG, course, duration=0.5, rate=6000.0, band=(2.0, 2000.0), noise=0.01, tolerance=1e-6)


@pytest.fixture(scope="module")
def identified(record: xr.Dataset) -> xr.Dataset:
    return identify([record], SETTINGS)


def relative(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


@pytest.mark.validation
def test_a_wander_of_a_fifth_costs_no_accuracy(identified: xr.Dataset) -> None:
    """Half a second, 40 dB: the error is small and expected."""
    error = relative(itf(identified).values, truth_at(RIG, identified))
    assert error < 0.02
    assert 0.5 < identified.attrs["expected_error"] / error < 2.0
    assert identified.attrs["speed"] == "varying"
    stiffness = RIG.stiffness(identified.phase.values)
    assert relative(identified["mesh_stiffness"].values, stiffness) < 0.02
    frozen = np.nanmean(identified["natural_frequency"].values)
    assert 1000 < frozen < 1250


def test_what_no_mesh_force_explains_is_told(
    record: xr.Dataset, identified: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A response beside the mesh's, a resonance of 1300 Hz read through a gain that turns with the mesh: its size."""
    monkeypatch.setattr(estimation, "SECOND_OPINION", np.inf)
    assert identified.attrs["unexplained_error"] < 0.01
    assert "explain" not in identified.attrs["warnings"]
    frequency = np.fft.rfftfreq(record.sizes["time"], 1 / 6000.0)
    resonance = 1.0 / (1.0 - (frequency / 1300.0) ** 2 + 0.1j * frequency / 1300.0)
    force = record["force"].values[0] - record["force"].values.mean()
    beside = np.fft.irfft(resonance * np.fft.rfft(force), force.size) * np.cos(2 * np.pi * record["mesh_phase"].values)
    size = 3e-9  # m/N
    found = identify([record.assign(dte=record["dte"] + size * beside)], SETTINGS)
    # Of branches +-1 half of it each; the response is that of the undisturbed record.
    left = size * np.abs(np.interp(found.frequency, frequency, np.abs(resonance))) / np.sqrt(2)
    share = np.sqrt(np.sum(left**2) / np.mean(np.sum(np.abs(itf(identified).values) ** 2, axis=0)))
    assert share > 0.05
    assert found.attrs["unexplained_error"] == pytest.approx(share, rel=0.4)
    assert "does not explain this record" in found.attrs["warnings"]
    assert found.attrs["expected_error"] > share / 2


def test_phase_comes_from_the_angle_where_it_is_not_measured(record: xr.Dataset) -> None:
    angle = record["mesh_phase"] * 2 * np.pi / 31
    by_angle = record.drop_vars("mesh_phase").assign(angle_driver=angle).assign_attrs(teeth_driver=31)
    found = mesh_phase(by_angle)
    assert found is not None
    assert found == pytest.approx(record["mesh_phase"].values, abs=1e-12)
    assert speed_varies([by_angle]) and speed_varies([record])
    even = 60.0 * np.arange(record.sizes["time"])[None] / 6000.0
    assert not speed_varies([record.assign(mesh_phase=(("realisation", "time"), even))])
    assert mesh_phase(record.drop_vars("mesh_phase")) is None


def test_what_a_varying_speed_cannot_do_without_is_named(record: xr.Dataset) -> None:
    back = record.assign(mesh_phase=-record["mesh_phase"])
    with pytest.raises(SpectraError, match="rises from sample to sample"):
        signals_of([back], 1000)
    with pytest.raises(SpectraError, match="same sampling_rate"):
        signals_of([record, record.isel(time=slice(100))], 1000)
    with pytest.raises(SpectraError, match="constant"):
        signals_of([record.assign(force=record["force"] * 0 + 2000.0)], 1000)
    with pytest.raises(ValueError, match=r"under-determined: \d+ unknowns"):
        identify([record], IdentificationSettings("mesh-feedback", 400, band=(700.0, 1900.0)))


def test_what_stands_at_few_mesh_phases_is_loud() -> None:
    """A residual of a tenth of the force at one fiftieth of the mesh phases, noise at all of them: its power over the
    force's, on each of the band's lines; noise alone is not loud."""
    size, rate = 8192, 8192.0
    time = np.arange(size) / rate
    cycles = 40.0 * time + 0.6 * np.sin(2 * np.pi * time)
    rng = np.random.default_rng(2)
    force, noise = rng.standard_normal(size), 1e-3 * rng.standard_normal(size)
    here = np.abs(cycles % 1.0 - 0.3) < 0.01
    signals = Signals(force[None], force[None], cycles[None], rate, 1, 3500, 1.0, 1.0)
    band = (1, 3500)
    burst = np.where(here, 0.1 * rng.standard_normal(size), 0.0)
    found = loud_at(signals, signals.lines(burst + noise)[None], band)
    assert found == pytest.approx(np.mean(burst**2) / np.mean(force**2) * 3500, rel=0.15)
    assert loud_at(signals, signals.lines(noise)[None], band) == 0.0

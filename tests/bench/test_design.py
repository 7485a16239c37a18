"""What is told before a measurement against what records that were integrated in time then give."""

from functools import cache

import numpy as np
import pytest
import xarray as xr

from gearbench.bench.design import Design, _first_mode, _known_htf, _spectra, design
from gearbench.bench.errors import BenchError
from gearbench.bench.experiment import simulate
from gearbench.bench.results.exact import lumped_periodic_system
from gearbench.cases import case_path
from gearbench.identification import IdentificationSettings, exact_itf, identify, itf
from gearbench.rig import Case, read_case

BAND = (800.0, 2000.0)
NOISE = 10 ** (-30 / 20)


@cache
def planned() -> Case:
    settings = ["experiment.realisations=2", "experiment.mesh_frequency_hz=400", "experiment.periods=1"]
    return read_case(case_path("quick_lumped"), settings)


@cache
def measured() -> xr.Dataset:
    """The record with white noise 30 dB below what the torque causes between 1 and 3500 Hz."""
    record = simulate(planned())
    count = record.sizes["time"]
    lines = np.arange(1, 1750)
    power = np.abs(np.fft.rfft(record["dte"].values, axis=1)[:, lines]) ** 2
    power = power[:, lines % 200 != 0].mean() / count  # without the operating response
    noise = NOISE * np.sqrt(power) * np.random.default_rng(7).standard_normal(record["dte"].shape)
    return record.assign(dte=(record["dte"].dims, record["dte"].values + noise, record["dte"].attrs))


def settings_of(window: tuple[int, int, int]) -> IdentificationSettings:
    harmonics, order, half_width = window
    return IdentificationSettings(
        harmonics=harmonics, order=order, window=half_width, band=BAND, step=4, phases=50, modes=0
    )


@cache
def planned_for(window: tuple[int, int, int]) -> Design:
    return design(planned(), settings_of(window), snr_db=30.0)


@pytest.mark.parametrize(
    "window",
    [(3, 1, 10), *(pytest.param(one, marks=pytest.mark.validation) for one in ((6, 2, 20), (8, 3, 36)))],
)
def test_error_is_told_before_the_record_is_made(window: tuple[int, int, int]) -> None:
    """Spectra whose sidebands keep the source's phase at negative lines (no conjugate) err twice as much."""
    told = planned_for(window)
    frf = identify([measured()], settings_of(window))
    frequency = frf["frequency"].values[::3]
    exact = exact_itf(lumped_periodic_system(planned()), frequency, np.arange(50) / 50)
    error = float(np.linalg.norm(itf(frf).values[::3] - exact) / np.linalg.norm(exact))
    assert told.actual == pytest.approx(error, rel=0.2)
    assert told.expected == pytest.approx(frf.attrs["expected_error"], rel=0.2)


def test_planned_spectra_are_those_of_the_record() -> None:
    """Line by line, up to half the sampling rate: the sidebands beyond it come back mirrored."""
    # A whole number of samples in a mesh period: the operating response's mirrors stay on its own lines.
    changed = ["experiment.sampling_rate_hz=16000", "experiment.samples_per_period=8000", "experiment.periods=1"]
    changed += ["experiment.realisations=1", "experiment.mesh_frequency_hz=400"]
    case = read_case(case_path("quick_lumped"), [*changed, "experiment.multisine.band_hz=[1.0, 6000.0]"])
    system = lumped_periodic_system(case)
    clean, _, _ = _spectra(case, _known_htf(system, (1.0, 6000.0), _first_mode(system)[1]))
    lines = np.arange(1, clean.highest)
    lines = lines[(lines % clean.mesh_lines != 0) & (lines * clean.spacing > 7000.0)]
    measured = np.fft.rfft(simulate(case)["dte"].values[0])[lines] / case.experiment.samples_per_period
    assert np.linalg.norm(clean.dte[0, lines] - measured) < 2e-3 * np.linalg.norm(measured)


def test_plan_is_that_of_the_case() -> None:
    told = planned_for((3, 1, 10))
    assert (told.lines, told.spacing, told.realisations) == (1750, 2.0, 2)
    assert told.peak == pytest.approx(50.0)
    assert told.mesh_frequency == pytest.approx(400.0)
    # Frozen eigenvalues: F = k x (and supports) on equal rotors, read from the matrices at 64 phases.
    a, _, _ = lumped_periodic_system(planned()).at(np.arange(64) / 64)
    lowest = [np.sort(np.abs(np.linalg.eigvals(one)[np.linalg.eigvals(one).imag > 1.0]))[0] for one in a]
    assert told.natural == pytest.approx((min(lowest) / (2 * np.pi), max(lowest) / (2 * np.pi)), rel=1e-6)
    assert told.needed == pytest.approx(3 * (2 * told.branches + 1) * 2 / told.bandwidth)
    assert told.distinct == pytest.approx(1.0)


def prescribed(harmonics: int | None, order: int | None, window: int | None, snr_db: float) -> Design:
    return design(
        planned(),
        IdentificationSettings(
            harmonics=harmonics, order=order, window=window, band=(1100.0, 1500.0), step=4, phases=50, modes=0
        ),
        snr_db=snr_db,
    )


def test_noise_is_told_from_missing_response_though_one_period_does_not() -> None:
    """The estimate is linear in the record: errors by noise and by missing response are independent, squares add. With
    the identification's own account, which knows one period only, windows are blamed."""
    loud, silent = (prescribed(8, 1, 10, snr_db) for snr_db in (10.0, 200.0))
    assert loud.account["limited_by"] == "noise"
    assert loud.account["noise_error"] ** 2 + silent.actual**2 == pytest.approx(loud.actual**2, rel=0.02)
    assert loud.free is not None and loud.free.actual < 0.5 * loud.actual


def test_windows_too_wide_are_told_from_too_few_branches() -> None:
    """161 lines of 2 Hz beside a bandwidth of 197 Hz; narrow windows with the same branches err by less than half."""
    wide, narrow, alone = (prescribed(*numbers, 60.0) for numbers in ((3, 1, 80), (3, 1, 10), (1, 1, 10)))
    assert (wide.account["limited_by"], alone.account["limited_by"]) == ("window", "branches")
    assert narrow.actual < 0.5 * wide.actual and narrow.actual < 0.7 * alone.actual


def test_what_the_record_cannot_bear_is_said_and_the_free_choice_stands_in() -> None:
    told, free = prescribed(3, 3, 3, 60.0), prescribed(None, None, None, 60.0)
    assert "L = 3 branches a side of order R = 3 are 28 unknowns" in told.refusal
    assert (told.window, told.actual) == (free.window, free.actual) and told.free is not None
    assert free.prescribed == (None, None, None) and free.free is None and not free.refusal


def test_what_cannot_be_planned_is_refused() -> None:
    settings = IdentificationSettings()
    constant = planned().model_copy(
        update={"experiment": planned().experiment.model_copy(update={"multisine": None})}
    )
    with pytest.raises(BenchError, match=r"no experiment.multisine: there is nothing to plan"):
        design(constant, settings)
    with pytest.raises(BenchError, match="signal-to-noise ratio of 300 dB must lie between -20 and 200"):
        design(planned(), settings, snr_db=300.0)

"""From records to frequency responses: the public function on reference records small enough for every run."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from shared.ptv import periodic_filter
from shared.reference_rig import ReferenceRig, reference_record

from gearbench.identification import IdentificationSettings, LpmError, SpectraError, identify, itf
from gearbench.identification.response.frf import htf
from gearbench.identification.response.modes import itf_modes
from gearbench.identification.spectra.joint import joint_periods
from gearbench.identification.spectra.records import record_spectra
from gearbench.identification.truth.monodromy import exact_itf
from gearbench.identification.truth.periodic import truncation_error
from gearbench.records import RecordError
from gearbench.records.record import make_record

# A faster mesh needs fewer branches: 16 reach 512 Hz to each side.
RIG = ReferenceRig(mesh_frequency=32.0, edge=0.1)
BAND = (700.0, 1500.0)
SETTINGS = IdentificationSettings(harmonics=16, order=2, band=BAND, phases=64)
# Where two results are held against each other, a part of the band tells as much.
NARROW = IdentificationSettings(harmonics=16, order=2, band=(1000.0, 1100.0), phases=64)


@pytest.fixture(scope="module")
def record() -> xr.Dataset:
    return reference_record(RIG, realisations=24, duration=0.5, band=(2.0, 2600.0), start_phase=0.3, seed=3)


@pytest.fixture(scope="module")
def identified(record: xr.Dataset) -> xr.Dataset:
    return identify([record], SETTINGS)


@pytest.fixture(scope="module")
def narrow(record: xr.Dataset) -> xr.Dataset:
    return identify([record], NARROW)


def truth(frf: xr.Dataset) -> np.ndarray:
    return exact_itf(RIG.system(1024), frf.frequency.values, frf.phase.values)


def relative(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


def test_reference_rig_is_identified(identified: xr.Dataset) -> None:
    """Noise-free: the error is what +-16 branches leave out, and the result expects about that of itself."""
    exact = truth(identified)
    error = relative(itf(identified).values, exact)
    assert error < 0.02
    assert error < 2 * truncation_error(exact, 16) + 0.005
    assert identified.attrs["expected_error"] == pytest.approx(error, rel=0.5)
    assert identified.attrs["transient"] == "none"
    assert identified.attrs["unknowns"] == 33 * 3
    wanted, _ = itf_modes(identified.frequency.values, exact)
    found = identified.natural_frequency.values
    assert found.shape == wanted.shape
    assert np.nanmedian(np.abs(found / wanted - 1)) < 2e-3


def test_phase_is_the_mesh_phase_and_not_the_start_of_the_record(identified: xr.Dataset) -> None:
    """The record begins at phase 0.3: read as if at 0, the ITF would be shifted by that."""
    shifted = np.roll(truth(identified), round(0.3 * 64), axis=1)
    assert relative(itf(identified).values, shifted) > 0.3


def test_start_may_come_from_an_attribute_or_be_unknown(record: xr.Dataset, narrow: xr.Dataset) -> None:
    by_attribute = identify([record.drop_vars("mesh_phase").assign_attrs(mesh_phase=0.3)], NARROW)
    assert itf(by_attribute).values == pytest.approx(
        itf(narrow).values, abs=1e-9 * np.abs(itf(narrow).values).max()
    )
    unknown = identify([record.drop_vars("mesh_phase")], NARROW)
    assert "phase 0 is the start of the record" in unknown.attrs["warnings"]
    turn = np.exp(2j * np.pi * 0.3 * narrow.harmonic.values)[:, None]
    assert htf(unknown).values == pytest.approx(
        htf(narrow).values * turn, abs=1e-9 * np.abs(htf(narrow).values).max()
    )


def test_realisations_may_come_in_several_records(record: xr.Dataset, narrow: xr.Dataset) -> None:
    parts = [record.isel(realisation=slice(0, 10)), record.isel(realisation=slice(10, 24))]
    assert itf(identify(parts, NARROW)).values == pytest.approx(
        itf(narrow).values, abs=1e-9 * np.abs(itf(narrow).values).max()
    )


def test_realisations_may_begin_at_different_phases() -> None:
    parts = [
        reference_record(RIG, realisations=12, duration=0.5, band=(2.0, 2600.0), start_phase=start, seed=seed)
        for seed, start in ((1, 0.0), (2, 0.37))
    ]
    frf = identify(parts, NARROW)
    assert relative(itf(frf).values, truth(frf)) < 0.02


def test_choice_of_branches_and_progress(record: xr.Dataset) -> None:
    seen: list[tuple[float, str]] = []
    frf = identify(
        [record],
        IdentificationSettings(band=(950.0, 1000.0), phases=64),
        progress=lambda part, message: seen.append((part, message)),
    )
    assert relative(itf(frf).values, truth(frf)) < 0.01
    parts = [part for part, _ in seen]
    assert parts[0] == 0.0 and parts[-1] == 1.0 and parts == sorted(parts)


def test_short_record_says_so() -> None:
    """One realisation, polynomials: the error is large, expected to be, and warned of."""
    short = reference_record(RIG, realisations=1, duration=0.5, band=(2.0, 2600.0), noise=0.01)
    frf = identify([short], IdentificationSettings(band=(900.0, 1300.0), phases=64, branches="polynomials"))
    error = relative(itf(frf).values, truth(frf))
    assert error > 0.1
    assert frf.attrs["expected_error"] == pytest.approx(error, rel=0.5)
    assert "short by a factor of" in frf.attrs["warnings"]
    assert "expected error of the ITF" in frf.attrs["warnings"]
    assert frf.attrs["record_needed"] > frf.attrs["record_duration"]


def filter_record(periods: int, samples: int = 96, mesh: int = 32, noise: float = 0.0, **attributes: Any) -> xr.Dataset:
    """Periodic response of a random LPTV filter: mesh period 32 samples, 6 realisations, rate 1 Hz."""
    system = periodic_filter(2, mesh)
    rng = np.random.default_rng(4)
    force = np.tile(rng.standard_normal((6, samples)), (1, periods))
    dte = system.response(force) + noise * rng.standard_normal(force.shape)
    given = {
        "sampling_rate": 1.0,
        "samples_per_period": samples,
        "periods": periods,
        "mesh_period": float(mesh),
        "mesh_phase": 0.0,
        **attributes,
    }
    return make_record({"dte": dte, "force": force}, given)


def test_joint_period_of_excitation_and_mesh() -> None:
    assert joint_periods(96, 1.0, 4, 32.0) == (1, 3)
    assert joint_periods(48, 1.0, 4, 32.0) == (2, 3)
    assert joint_periods(40, 1.0, 8, 32.0) == (4, 5)
    with pytest.raises(SpectraError, match=r"spans 1\.25 mesh periods"):
        joint_periods(40, 1.0, 1, 32.0)
    with pytest.raises(SpectraError, match="whole number"):
        joint_periods(40, 1.0, 6, 32.0)


def test_excitation_shorter_than_the_mesh_period() -> None:
    """T_exc = 48, T_mesh = 32 samples: joint period 96, only every second line excited, still identified."""
    spectra, _, _ = record_spectra([filter_record(4, samples=1536, mesh=1024)], sidebands=2)
    assert (spectra.repeats, spectra.mesh_lines, spectra.periods) == (2, 3, 2)
    assert np.abs(spectra.force[:, 1::2]).max() < 1e-12 * np.abs(spectra.force).max()
    record = filter_record(4, samples=1536, mesh=1024)
    frf = identify(
        [record.assign(dte=1e-9 * record.dte)],  # as stiff as gears
        IdentificationSettings(harmonics=2, order=2, window=8, band=(0.05, 0.2), phases=32),
    )
    wanted = 1e-9 * periodic_filter(2, 1024).itf(frf.frequency.values)[:, ::32]
    assert relative(itf(frf).values, wanted) < 1e-4


def test_periods_are_averaged_and_tell_steadiness_and_noise() -> None:
    record = filter_record(16, noise=0.2)
    spectra, _, _ = record_spectra([record], sidebands=2)
    assert spectra.periods == 16 and spectra.steady
    blocks = record.dte.values.reshape(6, 16, 96).mean(axis=1)
    assert spectra.dte[:, :20] == pytest.approx(np.fft.rfft(blocks, axis=1)[:, :20] / 96, abs=1e-12)
    assert spectra.noise is not None
    assert np.mean(spectra.noise) == pytest.approx(0.2**2 / 16 / 96, rel=0.1)


def test_decaying_transient_is_noticed() -> None:
    record = filter_record(4)
    record["dte"] = record.dte + 5.0 * np.exp(-np.arange(record.sizes["time"]) / 60.0)
    spectra, _, _ = record_spectra([record], sidebands=2)
    assert not spectra.steady
    assert record_spectra([filter_record(4)], sidebands=2)[0].steady
    assert not record_spectra([filter_record(1)], sidebands=2)[0].steady  # nothing to compare with
    assert record_spectra([filter_record(1, settling_residual=1e-5)], sidebands=2)[0].steady
    assert not record_spectra([filter_record(1, settling_residual=0.1)], sidebands=2)[0].steady


def test_averaged_record_vouches_by_its_scatter() -> None:
    steady = filter_record(1, periods_averaged=4)
    size = float(steady.dte.std())
    steady["dte"].attrs["period_scatter"] = 1e-5 * size
    spectra, _, _ = record_spectra([steady], sidebands=2)
    assert spectra.steady
    assert spectra.noise is not None and spectra.noise[3] == pytest.approx(
        (1e-5 * size) ** 2 / 3 / 96, rel=1e-9, abs=0.0
    )
    steady["dte"].attrs["period_scatter"] = 0.1 * size
    assert not record_spectra([steady], sidebands=2)[0].steady


def changed(**attributes: Any) -> xr.Dataset:
    return filter_record(2).assign_attrs(attributes)


@pytest.mark.parametrize(
    ("records", "error", "words"),
    [
        ([], SpectraError, "no record"),
        ([filter_record(2), filter_record(4)], SpectraError, r"differ in periods \(2 and 4\)"),
        ([filter_record(2), changed(mesh_period=16.0)], SpectraError, "differ in mesh_period"),
        ([changed(mesh_period=-1.0)], RecordError, "mesh_period = -1 must be positive"),
        ([changed(mesh_period=37.0)], SpectraError, "whole number"),
        ([changed(samples_per_period=90)], RecordError, "192 samples, but samples_per_period x periods is 180"),
        ([filter_record(2).assign(force=filter_record(2).force * 0 + 3.0)], SpectraError, "force is constant"),
    ],
)
def test_records_that_do_not_fit_are_refused(
    records: list[xr.Dataset], error: type[ValueError], words: str
) -> None:
    with pytest.raises(error, match=words):
        identify(records)


def test_record_without_what_it_needs_is_refused() -> None:
    bare = filter_record(2)
    del bare.attrs["mesh_period"]
    with pytest.raises(SpectraError, match="neither attribute mesh_period nor channel mesh_phase"):
        identify([bare])
    with pytest.raises(RecordError, match="angle_driver"):
        identify([filter_record(2).drop_vars("dte")])
    incomplete = filter_record(2)
    del incomplete.attrs["sampling_rate"]
    with pytest.raises(RecordError, match="attribute sampling_rate is missing"):
        identify([incomplete])


def test_mesh_period_from_the_phase_channel() -> None:
    record = filter_record(2)
    del record.attrs["mesh_period"]
    record["mesh_phase"] = record.dte * 0 + record.time / 32.0
    spectra, _, _ = record_spectra([record], sidebands=2)
    assert spectra.mesh_lines == 3


def test_wandering_speed_is_warned_of() -> None:
    record = filter_record(2)
    record["mesh_phase"] = record.dte * 0 + record.time / 32.0 + 0.01 * np.sin(record.time / 10.0)
    _, _, notes = record_spectra([record], sidebands=2)
    assert any("0.01 cycles" in note for note in notes)


def test_mesh_phase_that_drifts_from_the_mesh_period_is_refused() -> None:
    """A wrong number of teeth turns the phase at another speed; a wandering one comes back."""
    record = filter_record(2)
    record["mesh_phase"] = record.dte * 0 + record.time / 32.0 * (1 + 1 / 6)
    with pytest.raises(SpectraError, match=r"runs through 6.96\d* cycles where mesh_period says 5.9\d*.*wrong number"):
        record_spectra([record], sidebands=2)


@pytest.mark.parametrize("channel", ["dte", "force"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_named(channel: str, value: float) -> None:
    record = filter_record(2).copy(deep=True)
    record[channel].values[0, 17] = value
    with pytest.raises(RecordError, match=f"channel {channel} holds 1 value.* not finite, .*sample 17"):
        identify([record])


def test_lost_contact_is_told_with_the_response(record: xr.Dataset) -> None:
    lost = record.assign_attrs(contact_lost_samples=12)
    total = record["dte"].size
    assert f"the teeth are out of contact in 12 of {total} samples" in identify([lost], NARROW).attrs["warnings"]
    assert "contact" not in identify([record], NARROW).attrs["warnings"]


def test_result_that_says_nothing_is_refused() -> None:
    """A dte of noise alone; where doubts are accepted, a warning says so."""
    record = reference_record(RIG, realisations=1, duration=0.25, band=(4.0, 2600.0))
    noise = record.dte.std().item() * np.random.default_rng(1).standard_normal(record.dte.shape)
    wrong = record.assign(dte=(record.dte.dims, noise, {"units": "m"}))
    settings = IdentificationSettings(harmonics=2, order=1, window=10, band=(900.0, 1300.0), phases=16, modes=0)
    with pytest.raises(LpmError, match=r"expected to err by [0-9]{3,}% of itself \(limit 100%\)"):
        identify([wrong], settings)
    frf = identify([wrong], replace(settings, accept_doubts=True))
    assert frf.attrs["expected_error"] > 1.0
    assert "exceeds the response: this result says nothing" in frf.attrs["warnings"]


@pytest.mark.parametrize("cycles", [7, 9])
def test_a_mesh_period_that_the_dte_contradicts_is_refused(cycles: int) -> None:
    """A record without angles that holds 8 mesh periods, by its attribute one less or more."""
    record = reference_record(RIG, realisations=1, duration=0.25, band=(4.0, 2600.0)).drop_vars("mesh_phase")
    wrong = record.assign_attrs(mesh_period=0.25 / cycles)
    with pytest.raises(RecordError, match=f"mesh frequency of about 3.* Hz.*declared {cycles / 0.25:g} Hz do not"):
        identify([wrong], IdentificationSettings(band=(900.0, 1300.0), phases=16, modes=0))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"harmonics": 60, "order": 1, "window": 1}, "under-determined.*242 unknowns|under-determined: L = 60"),
        ({"harmonics": 500, "order": 1, "window": 4}, "sidebands of 1500 Hz"),
        ({"band": (700.0, 3500.0)}, "leaves the excited band 2-2600 Hz"),
        ({"band": (1000.0, 1001.0)}, "at least 3"),
        ({"harmonics": 250}, "under-determined|sidebands"),
        ({"harmonics": 100_000}, "harmonics = 100000 puts sidebands of .* at most [0-9]+ fit"),
    ],
)
def test_requests_beyond_the_record_are_refused(record: xr.Dataset, changes: dict, words: str) -> None:
    with pytest.raises(LpmError, match=words):
        identify([record.isel(realisation=[0, 1])], IdentificationSettings(**{"band": BAND, "phases": 64, **changes}))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"method": "h1"}, "'h1'.*'lpm'"),
        ({"transient": "maybe"}, "'maybe'"),
        ({"harmonics": -1}, "harmonics = -1 must be at least 0"),
        ({"window": 0}, "window = 0 must be at least 1"),
        ({"order": 5, "window": 2}, "order = 5 needs window = 2 of at least 3"),
        ({"band": (5.0, 1.0)}, "5-1 Hz must rise"),
    ],
)
def test_settings_are_checked(changes: dict, words: str) -> None:
    with pytest.raises(LpmError, match=words):
        IdentificationSettings(**changes)


def test_a_wrong_number_of_teeth_is_named_before_the_record_is_found_too_long() -> None:
    """The mesh period of one tooth less than there is: no other length of the record would help."""
    right = reference_record(RIG, realisations=1, duration=0.5, band=(2.0, 2600.0))
    turned = right.assign(angle_driver=(2 * np.pi / 62 * right.mesh_phase).assign_attrs(units="rad"))
    wrong = turned.assign_attrs(teeth_driver=62, mesh_period=right.attrs["mesh_period"] * 62 / 61)
    with pytest.raises(ValueError, match="teeth_driver = 62 give a mesh frequency of"):
        identify([wrong], IdentificationSettings(band=(900.0, 1300.0)))

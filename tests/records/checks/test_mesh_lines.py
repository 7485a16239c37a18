"""The mesh frequency that a dte shows against the declared one, in records without angles."""

from __future__ import annotations

import re

import numpy as np
import pytest
import xarray as xr
from shared.reference_rig import ReferenceRig, reference_record

from gearbench.records import RecordError, make_record
from gearbench.records.checks import check_record
from gearbench.records.checks.derived import swings_fit_the_teeth
from gearbench.records.checks.mesh_lines import mesh_lines_stand_out
from gearbench.records.seen.look import Look

# One revolution of 31 teeth in half a second: any number of teeth makes whole mesh periods.
TEETH, DURATION = 31, 0.5
RIG = ReferenceRig(mesh_frequency=TEETH / DURATION, edge=0.1)


@pytest.fixture(scope="module")
def record() -> xr.Dataset:
    """40 dB, 7936 Hz, so that a mesh period is a whole number of samples."""
    made = reference_record(
        RIG, realisations=1, duration=DURATION, sampling_rate=7936.0, band=(2.0, 2600.0), noise=0.01, substeps=2
    )
    return made.drop_vars("mesh_phase")


def declared(record: xr.Dataset, cycles: float) -> xr.Dataset:
    return record.assign_attrs(mesh_period=DURATION / cycles)


def test_the_right_mesh_is_silent(record: xr.Dataset) -> None:
    assert check_record(record) == ()
    # Every second harmonic of half of the frequency is the mesh's: two mesh periods repeat as well.
    assert mesh_lines_stand_out(Look(declared(record, TEETH / 2))) == []


@pytest.mark.parametrize("cycles", [TEETH - 1, TEETH + 1, TEETH - 3, 40, 20])
def test_another_number_of_teeth_is_refused_with_the_mesh_frequency_there_is(record: xr.Dataset, cycles: float) -> None:
    with pytest.raises(RecordError, match=r"whose harmonics stand out .* wrong number of teeth") as error:
        check_record(declared(record, cycles))
    told = re.search("of about ([0-9.]+) Hz", str(error.value))
    assert told is not None and float(told[1]) == pytest.approx(RIG.mesh_frequency, rel=0.01)


@pytest.mark.parametrize(("part", "word"), [(2, "half"), (3, "a third")])
def test_a_part_of_the_declared_frequency_is_warned_of(record: xr.Dataset, part: int, word: str) -> None:
    (found,) = mesh_lines_stand_out(Look(declared(record, part * TEETH)))
    assert not found.refused
    assert f"repeats with 62 Hz as well, {word} of the declared mesh frequency" in found.sentence


@pytest.mark.parametrize("grid", ["full", "odd", "every third"])
def test_without_a_mean_load_nothing_is_concluded(grid: str) -> None:
    """Lines that the force excites are compared with their like: a comb of the excitation is no mesh."""
    rng = np.random.default_rng(3)
    samples, chosen = 8192, np.arange(1, 2000)
    chosen = {"full": chosen, "odd": chosen[::2], "every third": chosen[2::3]}[grid]
    lines = np.zeros(samples // 2 + 1, dtype=complex)
    lines[chosen] = np.exp(2j * np.pi * rng.random(chosen.size))
    force = np.fft.irfft(lines) * samples
    dte = 1e-8 * np.fft.irfft(lines / (1 + 2j * np.arange(lines.size) / 1000)) * samples
    dte += 1e-10 * rng.standard_normal(samples)
    attributes = {"sampling_rate": 8192.0, "samples_per_period": samples, "periods": 1, "mesh_period": 1 / 64}
    record = make_record({"dte": dte[None], "force": force[None]}, attributes)
    assert mesh_lines_stand_out(Look(record)) == []


def test_a_mean_of_a_metre_is_refused(record: xr.Dataset) -> None:
    (found,) = swings_fit_the_teeth(Look(record.assign(dte=record.dte + 1.0)))
    assert found.refused and "dte has a mean of 1 m (limit 0.02 m" in found.sentence
    assert swings_fit_the_teeth(Look(record.assign(dte=record.dte + 0.01))) == []

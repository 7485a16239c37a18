"""Clocks of force and dte that run at different rates: told where they do, silent where they do not."""

import numpy as np
import pytest
import xarray as xr
from shared.reference_rig import ReferenceRig, reference_record

from gearbench.records.clocks.drift import clocks_keep_pace
from gearbench.records.seen.look import Look

RIG = ReferenceRig(mesh_frequency=16.0, edge=0.1)


@pytest.fixture(scope="module")
def record() -> xr.Dataset:
    return reference_record(RIG, realisations=1, duration=1.0, sampling_rate=8192.0, noise=0.01, substeps=2)


def drifting(record: xr.Dataset, ppm: float) -> xr.Dataset:
    """The record with a dte whose clock is slow by `ppm`: its values are those of t (1 - ppm 1e-6), by its Fourier sum
    of which only the slow turn is new."""
    values, finer = record.dte.values[0], 16
    fine = np.fft.irfft(np.fft.rfft(values), n=finer * values.size) * finer
    place = np.arange(values.size) * (1 - 1e-6 * ppm) * finer
    read = np.interp(place % fine.size, np.arange(fine.size + 1), np.append(fine, fine[0]))
    return record.assign(dte=(record.dte.dims, read[None], record.dte.attrs))


@pytest.mark.parametrize("ppm", [50.0, -80.0])
def test_drift_is_named_with_its_rate(record: xr.Dataset, ppm: float) -> None:
    """The rate is told; the cost is what the mean over all delays leaves of a turn."""
    (finding,) = clocks_keep_pace(Look(drifting(record, ppm)))
    assert not finding.refused
    assert ("falls behind" if ppm > 0 else "runs ahead") in finding.sentence
    told = float(finding.sentence.split("differ by ")[1].split(" ppm")[0])
    deviation = float(finding.sentence.split("standard deviation ")[1].split(" us")[0]) / 0.5
    assert deviation < 8.0
    assert told == pytest.approx(abs(ppm), abs=3 * deviation)
    # At the first mode, from 1013 to 1231 Hz, where the response is: |1 - mean exp(-j w t)|, t from 0 to ppm * 1 s.
    turn = 2 * np.pi * 1100.0 * told * 1e-6 * np.linspace(0, 1, 1000)
    assert finding.error == pytest.approx(abs(1 - np.mean(np.exp(-1j * turn))), rel=0.25)


def test_common_clocks_are_not_accused(record: xr.Dataset) -> None:
    """Neither as they are, nor with a constant lag, nor of a record whose halves hold no whole mesh periods."""
    assert clocks_keep_pace(Look(record)) == []
    late = record.assign(dte=(record.dte.dims, np.roll(record.dte.values, 2, axis=1), record.dte.attrs))
    assert clocks_keep_pace(Look(late)) == []
    odd = drifting(record, 80.0).isel(time=slice(0, 15 * 512)).assign_attrs(samples_per_period=15 * 512)
    assert clocks_keep_pace(Look(odd)) == []


@pytest.mark.parametrize("noise", [0.3, 1.0, 3.0, 10.0])
def test_noise_is_no_drift(record: xr.Dataset, noise: float) -> None:
    """White noise of so many times the dte's rms, sixteen draws: none is a drift, whatever delay fits best."""
    values, random = record.dte.values, np.random.default_rng(8)
    for _ in range(16):
        white = noise * values.std() * random.standard_normal(values.shape)
        assert clocks_keep_pace(Look(record.assign(dte=(record.dte.dims, values + white, record.dte.attrs)))) == []


@pytest.mark.parametrize(("factor", "said"), [(1.0, None), (1e-3, "stiffest mesh"), (1e3, "softer")])
def test_dte_of_a_record_without_angles_in_another_unit(record: xr.Dataset, factor: float, said: str | None) -> None:
    """A spring of 8e7 N/m becomes one of 8e10, which no mesh has, or of 8e4, which is doubtful."""
    from gearbench.records.checks.derived import spring_is_a_mesh

    found = spring_is_a_mesh(Look(record.assign(dte=(factor * record.dte).assign_attrs(record.dte.attrs))))
    if said is None:
        assert found == []
        return
    (finding,) = found
    assert said in finding.sentence
    stiffness = float(finding.sentence.split("spring of ")[1].split(" N/m")[0])
    mean = 1 / np.mean(1 / RIG.stiffness(np.arange(256) / 256))
    assert stiffness == pytest.approx(mean / factor, rel=0.1)
    assert finding.refused == (factor < 1)

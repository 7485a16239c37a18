"""Repetitions at more samples, against the same motion written out at those."""

from __future__ import annotations

import numpy as np
import pytest
import shared.measured as shared
from shared.measured import RATE, channels, nominal, record

from gearbench.diagnosis.intake.brisk import brisk, largest_prime
from gearbench.diagnosis.intake.measurements import Measurement, measurement

SLOW, QUICK = 12289, 12500  # a prime, and the next even number that is 2^a 3^b 5^c
MESH = 60 * RATE / SLOW


def taken(samples: int = SLOW, start: float = 0.0, **changes: object) -> Measurement:
    values = channels(samples=samples, mesh=MESH, phase=start, noise=0.0)
    said = {"samples_per_period": samples, "mesh_period": 1 / MESH, "sampling_rate": shared.RATE, **changes}
    return measurement(record(values, **said), "base", nominal())


@pytest.mark.parametrize("start", [0.0, 7.25])
def test_more_samples_are_those_of_the_same_motion(start: float, monkeypatch: pytest.MonkeyPatch) -> None:
    made = brisk(taken(start=start))
    monkeypatch.setattr(shared, "RATE", RATE * QUICK / SLOW)
    truth = taken(QUICK, start)
    assert (made.phase.size, made.mesh_cycles, made.repetitions) == (QUICK, 60, 2)
    assert made.sampling_rate == pytest.approx(truth.sampling_rate, rel=1e-15)
    assert made.mesh_frequency == pytest.approx(truth.mesh_frequency, rel=1e-12)
    np.testing.assert_allclose(made.phase, truth.phase, atol=1e-9)
    for name, rows in truth.periods.items():
        scale = np.abs(rows).max() + 1e-4  # of angles that turn by 38 rad besides
        np.testing.assert_allclose(made.periods[name], rows, atol=1e-9 * scale, err_msg=name)
    assert {*made.record.data_vars} == {*truth.record.data_vars} - {"dte", "force"}
    for name in made.record.data_vars:
        real = truth.record[name].values
        np.testing.assert_allclose(made.record[name].values, real, atol=1e-10 * np.abs(real).max(), err_msg=str(name))
    for key in ("samples_per_period", "periods", "sampling_rate", "mesh_period", "teeth_driven"):
        assert made.record.attrs[key] == pytest.approx(truth.record.attrs[key], rel=1e-12)


def test_the_zero_of_an_angle_stays_where_it_was() -> None:
    values = channels(samples=SLOW, mesh=MESH, noise=0.0)
    values["angle_driven"] = values["angle_driven"] + 2.0  # far from contact: departures are without their mean
    said = {"samples_per_period": SLOW, "mesh_period": 1 / MESH}
    before = measurement(record(values, **said), "base", nominal())
    made = brisk(before)
    assert not made.zero_known and abs(made.periods["angle_driven"].mean()) < 1e-12
    first = made.record["angle_driven"].values[0, 0]
    assert first == pytest.approx(values["angle_driven"][0], abs=1e-9)


def test_noise_keeps_its_lines() -> None:
    said = {"samples_per_period": SLOW, "mesh_period": 1 / MESH}
    before = measurement(record(channels(samples=SLOW, mesh=MESH), **said), "base", nominal())
    made = brisk(before)
    for name, rows in before.periods.items():
        old, new = (np.fft.rfft(one, axis=1) / one.shape[1] for one in (rows, made.periods[name]))
        np.testing.assert_allclose(new[:, : old.shape[1]], old, atol=1e-12 * np.abs(old).max(), err_msg=name)
        assert np.abs(new[:, old.shape[1] :]).max() < 1e-12 * np.abs(old).max()


def test_quick_ones_and_samples_of_a_simulation_stay() -> None:
    quick = measurement(record(), "base", nominal())
    assert brisk(quick) is quick
    simulated = taken(model="lumped")
    assert brisk(simulated) is simulated


@pytest.mark.parametrize(("number", "prime"), [(2, 2), (4575, 61), (8348, 2087), (12288, 3), (12289, 12289), (961, 31)])
def test_largest_prime(number: int, prime: int) -> None:
    assert largest_prime(number) == prime

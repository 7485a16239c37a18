"""A force and a dte of two devices, of machines whose receptances are known in closed form."""

import numpy as np
import pytest
import xarray as xr

from gearbench.records.clocks.lag import force_and_dte_in_step
from gearbench.records.record import make_record
from gearbench.records.seen.look import Look

RATE, SAMPLES = 8192.0, 8192
FREQUENCY = np.arange(SAMPLES // 2 + 1) * RATE / SAMPLES
# (share of the flexibility 1e-8 m/N, natural frequency [Hz], damping ratio)
MACHINES = {
    "two resonances": ((0.7, 1100.0, 0.05), (0.3, 2300.0, 0.03)),
    "one": ((1.0, 1400.0, 0.05),),
    "over-damped": ((1.0, 900.0, 1.5),),
}


def record(modes: tuple[tuple[float, float, float], ...], delay: float, noise: float = 0.0) -> xr.Dataset:
    """Force and dte, sum of share 1e-8 / (1 - (f/f0)^2 + 2 j zeta f/f0), the dte late by `delay` [s]."""
    rng = np.random.default_rng(3)
    spectrum = np.where((FREQUENCY > 1) & (FREQUENCY < 3000), np.exp(2j * np.pi * rng.random(FREQUENCY.size)), 0)
    receptance = sum(
        share * 1e-8 / (1 - (FREQUENCY / f0) ** 2 + 2j * zeta * FREQUENCY / f0) for share, f0, zeta in modes
    )
    force = 1000 + 5000 * np.fft.irfft(spectrum)
    dte = np.fft.irfft(spectrum * receptance * np.exp(-2j * np.pi * FREQUENCY * delay)) * 5000 + 1e-5
    dte = dte + noise * dte.std() * rng.standard_normal(SAMPLES)
    attributes = {"sampling_rate": RATE, "samples_per_period": SAMPLES, "periods": 1, "mesh_period": 1 / 64}
    return make_record({"dte": dte[None], "force": force[None]}, attributes)


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_nothing_is_said_of_one_clock(name: str, noise: float) -> None:
    assert force_and_dte_in_step(Look(record(MACHINES[name], 0.0, noise))) == []


@pytest.mark.parametrize("delay", [1e-4, 4e-4, 5e-3, -1.2e-4, -5e-3])
def test_a_lag_is_found_with_its_size(delay: float) -> None:
    """Passivity leaves some room; a lag of 0.1 ms turns a resonance of 2300 Hz by 83 degrees."""
    (found,) = force_and_dte_in_step(Look(record(MACHINES["two resonances"], delay, 0.05)))
    assert not found.refused
    assert ("dte lags behind" if delay > 0 else "dte leads") in found.sentence
    assert "two devices" in found.sentence and "limit 10%" in found.sentence
    told = 1e-6 * float(found.sentence.split("about ")[1].split(" us")[0])
    assert told == pytest.approx(abs(delay), abs=6e-5)
    assert found.error > 0.4


def test_noise_alone_is_no_lag() -> None:
    given = record(MACHINES["one"], 0.0)
    noise = np.random.default_rng(1).standard_normal((1, SAMPLES)) * 1e-7
    assert force_and_dte_in_step(Look(given.assign(dte=(given["dte"].dims, noise, given["dte"].attrs)))) == []

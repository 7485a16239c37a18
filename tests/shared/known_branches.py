"""Records of branches that are known in closed form at any speed."""

import numpy as np
import xarray as xr

from gearbench.identification.excitation.multisine import random_phase_multisine
from gearbench.records.record import make_record

RATE, SIZE, MESH = 4096.0, 4096, 40.0
LINES = np.arange(300, 900, 30)
# Of branches 0, 1, 2: gain [m/N] and its slope along the middle frequency [m s/N].
GAIN = (3e-9, 1e-9 - 0.5e-9j, 0.4e-9j)
SLOPE = (2e-12, 0.7e-12 + 0.3e-12j, 0.5e-12)


def known(seed: int = 0, operating: float = 0.0) -> xr.Dataset:
    """A record of y = sum_l exp(j l theta / 2) (a_l + b_l d/dt) (exp(j l theta / 2) u), a_l, b_l known, at a speed that
    wanders by 20 %; `operating` [m]: amplitude of third and fourteenth orders of the mesh."""
    time = np.arange(SIZE) / RATE
    signal = random_phase_multisine(SIZE, RATE, (1.0, 1500.0), amplitude=500.0, rng=np.random.default_rng(seed))
    force = signal.sample(SIZE)
    lines = np.fft.rfftfreq(SIZE, 1 / RATE)
    slope = np.fft.irfft(2j * np.pi * lines * np.fft.rfft(force), SIZE)
    swing = 2 * np.pi * 1.5
    cycles = MESH * (time + 0.2 / swing * np.sin(swing * time + 0.4))
    speed = 2 * np.pi * MESH * (1.0 + 0.2 * np.cos(swing * time + 0.4))
    dte = GAIN[0].real * force + SLOPE[0].real * slope
    for order in (1, 2):
        turn = np.exp(2j * np.pi * order * cycles)
        of_speed = slope + 0.5j * order * speed * force
        dte = dte + 2 * (turn * (GAIN[order] * force + SLOPE[order] * of_speed)).real
    dte = dte + operating * (np.cos(2 * np.pi * 3 * cycles) + np.cos(2 * np.pi * 14 * cycles + 1.0))
    attributes = {"sampling_rate": RATE, "samples_per_period": SIZE, "periods": 1}
    return make_record({"dte": dte[None], "force": force[None], "mesh_phase": cycles[None]}, attributes)


def delayed(lag: int) -> xr.Dataset:
    """A record of y = sum_l a_l exp(j l (theta(t) + theta(t - tau)) / 2) u(t - tau), tau `lag` samples, at the same
    speed: H_l = a_l exp(-j w tau)."""
    time = np.arange(SIZE) / RATE
    signal = random_phase_multisine(SIZE, RATE, (1.0, 1500.0), amplitude=500.0, rng=np.random.default_rng(0))
    force = signal.sample(SIZE)
    swing = 2 * np.pi * 1.5
    cycles, before = (MESH * (t + 0.2 / swing * np.sin(swing * t + 0.4)) for t in (time, time - lag / RATE))
    dte = GAIN[0].real * np.roll(force, lag)
    for order in (1, 2):
        dte = dte + 2 * (GAIN[order] * np.exp(1j * np.pi * order * (cycles + before))).real * np.roll(force, lag)
    attributes = {"sampling_rate": RATE, "samples_per_period": SIZE, "periods": 1}
    return make_record({"dte": dte[None], "force": force[None], "mesh_phase": cycles[None]}, attributes)

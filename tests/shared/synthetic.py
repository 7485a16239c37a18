"""A made-up measurement of the demonstration rig: plausible levels, random motion, no physics behind it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.diagnosis.intake.measurements import Measurement

Array = NDArray[np.float64]

RATE, MESH_FREQUENCY, CYCLES = 10240.0, 50.0, 60
SAMPLES = 12288


def smooth(rng: np.random.Generator, size: float) -> Array:
    """Two equal rows (2, SAMPLES) of random motion below 2.5 kHz with that standard deviation."""
    spectrum = np.zeros(SAMPLES // 2 + 1, dtype=complex)
    spectrum[1:3000] = rng.standard_normal(2999) + 1j * rng.standard_normal(2999)
    values = np.fft.irfft(spectrum)
    return np.tile(size * values / values.std(), (2, 1))


def measurement(seed: int = 1, base_radius: float = 0.02819) -> Measurement:
    """One measurement whose mesh stays in contact almost always."""
    rng = np.random.default_rng(seed)
    noise = {"torque_driver": 1e-2, "torque_driven": 1e-2, "angle_driver": 1e-7, "angle_driven": 1e-7}
    periods = {
        "torque_driver": 100 + smooth(rng, 20.0),
        "torque_driven": 150 + smooth(rng, 20.0),
        "angle_driver": (102e-6 + smooth(rng, 8e-6)) / base_radius,
        "angle_driven": smooth(rng, 1e-6) / base_radius,
        "y_driver": -33e-6 + smooth(rng, 3e-6),
        "y_driven": 33e-6 + smooth(rng, 3e-6),
    }
    periods = {k: v + noise.get(k, 1e-8) * rng.standard_normal(v.shape) for k, v in periods.items()}
    phase = np.arange(SAMPLES) * CYCLES / SAMPLES
    return Measurement("base", xr.Dataset(), periods, RATE, MESH_FREQUENCY, phase, mesh_cycles=CYCLES)

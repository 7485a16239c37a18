"""Measured and replayed channels on equal terms: the same formulas, the same zeros, spectra line by line.

What is compared, per repetition (one or more hunting periods) of N samples:

    dte              rb1 u1 - rb2 u2 + (y1 - y2) cos(alpha_w) [m], always from the channels as their sensors give them
                     (factor 1 for supports along the line of action; angles only, on both sides, where a y is missing)
    angle_driver, angle_driven   departure from steady rotation times base radius: rb (theta - 2 pi phase / z) [m]
    y_driver, y_driven [m], torque_driven [N m]   as recorded

The torque on the driver is what the replay is given, so it has no gap.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from math import cos, pi, sqrt

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.intake.measurements import Measurement

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# In the order of reading: what makes noise first, then where it goes.
CHANNELS = ("dte", "angle_driver", "angle_driven", "y_driver", "y_driven", "torque_driven")
UNITS = {**dict.fromkeys(CHANNELS, "m"), "torque_driven": "N m"}
# Upper ends of the bands that a gap is told in, below the end of the excitation, over it.
BAND_ENDS = (1 / 15, 1 / 3)
# Of the deflection of the nominal supports, within which a measured mean is one, and not a sensor's zero.
NEAR = 0.5
# A line is excited when its torque exceeds this part of the strongest line's (the mean apart).
EXCITED = 0.1


def measured_channels(measurement: Measurement) -> dict[str, Array]:
    """Channel -> (P, N) in the units of this module."""
    return _channels(measurement.periods, measurement.record.attrs, has_both_y(measurement))


def simulated_channels(measurement: Measurement, replay: xr.Dataset) -> dict[str, Array]:
    """Channel -> (N,) of a replay, with the angles' steady rotation taken off as the measurement's was."""
    samples = measurement.phase.size
    if replay.sizes["time"] != samples:
        raise DiagnosisError(
            f"the replay of {measurement.name} has {replay.sizes['time']} samples; a repetition of it has {samples}"
        )
    values = {str(name): replay[name].values[0] for name in replay.data_vars}
    for gear in ("driver", "driven"):
        angle = values[f"angle_{gear}"] - 2 * pi * measurement.phase / int(measurement.record.attrs[f"teeth_{gear}"])
        values[f"angle_{gear}"] = angle if measurement.zero_known else angle - angle.mean()
    return _channels(values, measurement.record.attrs, has_both_y(measurement))


def has_both_y(measurement: Measurement) -> bool:
    """Whether both displacements are measured: without them the transmission error is that of the rotations alone."""
    return "y_driver" in measurement.periods and "y_driven" in measurement.periods


def about_rest(seen: float, rest: float) -> bool:
    """Whether a mean displacement is about where nominal supports come to `rest`, in one unit: its zero is without
    load, then."""
    return abs(seen - rest) < NEAR * abs(rest)


def _channels(values: Mapping[str, Array], attributes: Mapping[str, float], with_y: bool) -> dict[str, Array]:
    rolled = {
        f"angle_{gear}": float(attributes[f"base_radius_{gear}"]) * values[f"angle_{gear}"]
        for gear in ("driver", "driven")
    }
    error = rolled["angle_driver"] - rolled["angle_driven"]
    if with_y:
        along = attributes.get("support_direction", "tangential") == "line-of-action"
        factor = 1.0 if along else cos(float(attributes["working_pressure_angle"]))
        error = error + factor * (values["y_driver"] - values["y_driven"])
    plain = {name: values[name] for name in ("y_driver", "y_driven", "torque_driven") if name in values}
    return {"dte": error, **rolled, **plain}


def line_energy(values: Array) -> Array:
    """Energy of each line of a real signal (..., N): (..., N // 2 + 1), adding up to its mean square (Parseval)."""
    samples = values.shape[-1]
    energy = np.asarray(np.abs(np.fft.rfft(values, axis=-1) / samples) ** 2, dtype=np.float64)
    energy[..., 1 : (samples + 1) // 2] *= 2
    return energy


def noise_of_mean(repetitions: Array) -> Array:
    """Rows (P, N) -> (P, N): independent parts of the error of their mean; squares add up over P to its variance.

    Departures from the mean over sqrt(P (P - 1)): E sum_p |part_p|^2 is the variance of the mean. P >= 2.
    """
    count = len(repetitions)
    return (repetitions - repetitions.mean(axis=0)).astype(np.float64) / sqrt(count * (count - 1))


def frequencies(measurement: Measurement) -> Array:
    """Frequencies (N // 2 + 1,) [Hz] of the lines of a repetition."""
    return np.fft.rfftfreq(measurement.phase.size, 1 / measurement.sampling_rate).astype(np.float64)


def excited(measurement: Measurement) -> Integers:
    """Lines that the measured torque excites; none for a constant torque."""
    torque = measurement.mean("torque_driver")
    energy = line_energy(torque)
    energy[0] = 0.0
    if not energy.max() > (1e-9 * np.abs(torque).max()) ** 2:
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero(energy > EXCITED**2 * energy.max())


def bands(measurement: Measurement) -> tuple[tuple[float, float], ...]:
    """Bands [Hz] of a gap: cut at a fifteenth and a third of the end of the excitation (without any: of the spectrum).

    A line belongs to the band whose lower edge it exceeds and whose upper edge it does not.
    """
    frequency = frequencies(measurement)
    lines = excited(measurement)
    # Up to the next 50 Hz, as `compare` does, so that the records of one campaign share their edges.
    top = min(float(np.ceil(frequency[lines[-1]] / 50 - 1e-9) * 50), frequency[-1]) if lines.size else frequency[-1]
    top = float(top)
    edges = [0.0, *(float(f"{part * top:.2g}") for part in BAND_ENDS), top]
    return tuple(pairwise(edges))


def rotation_lines(measurement: Measurement) -> NDArray[np.bool_]:
    """Lines (N // 2 + 1,) of the rotation: multiples of either shaft's frequency."""
    lines = np.arange(measurement.phase.size // 2 + 1)
    repeats = np.zeros(lines.size, dtype=bool)
    for gear in ("driver", "driven"):
        shaft, rest = divmod(measurement.mesh_cycles, int(measurement.record.attrs[f"teeth_{gear}"]))
        if rest == 0:
            repeats |= lines % shaft == 0
    return repeats

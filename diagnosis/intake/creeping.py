"""Rotation that creeps against the excitation: clocks and drives that differ by parts per million, heavy loads that
still come to rest when a record begins.

The shafts are then ahead of where the record's samples have them, or behind, and what turns with them moves through its
lines, as if something in the mesh changed from one repetition to the next. The angles show by how much.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gearbench.diagnosis.intake.measurements import Measurement, without
from gearbench.diagnosis.intake.quality import noise_of
from gearbench.diagnosis.intake.signals import excited

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Creep over a record [cycles] below which no line shows it, and from which it is worth a sentence: the tenth mesh order
# has turned by a few degrees.
LEAST, TOLD = 1e-6, 1e-3
FINER = 8  # times the samples between which splines hold what turns, to 1e-4 of the highest line
ROUNDS = 4  # of which each leaves as small a part of what turns as the highest line is turned on by


def in_step(measured: Measurement) -> Measurement:
    """The measurement as it were if the shafts turned steadily: what turns with them, the lines of both shafts' orders,
    mesh orders among them, but for those that are excited, is turned back to the mesh phase that samples have on the
    mean; itself where nothing creeps."""
    creep = measured.creep
    more = float(np.ptp(creep))
    if more < LEAST:
        return measured
    turning = _turning(measured)
    ahead = creep * (measured.phase.size / measured.mesh_cycles)
    periods = {name: one - _carried(one, turning, ahead) for name, one in measured.periods.items()}
    record = without(measured.record, {name: measured.periods[name] - one for name, one in periods.items()})
    notes = measured.warnings
    if more > TOLD:
        notes = (*notes, f"the rotation creeps by {more:.2g} mesh cycles against the excitation over the record: the"
                         " lines of both shafts are turned back by it")  # fmt: skip
    noise = {name: noise_of(one) for name, one in periods.items()}
    still = np.zeros_like(creep)
    return replace(measured, record=record, periods=periods, noise=noise, warnings=notes, creep=still)


def _carried(repetitions: Array, turning: Flags, ahead: Array) -> Array:
    """What repetitions (P, N) have because their `turning` lines (N // 2 + 1,) are so many samples (P, N) ahead."""
    samples = repetitions.shape[-1]
    places = (np.arange(samples) + ahead) % samples
    carried = np.zeros_like(repetitions)
    # What turns is seen where it is only but for what it is ahead.
    for _ in range(ROUNDS):
        steady = np.where(turning, np.fft.rfft((repetitions - carried).mean(axis=0)), 0.0)
        fine = FINER * np.fft.irfft(steady, FINER * samples)
        at = np.arange(len(fine) + 1) / FINER
        carried = CubicSpline(at, np.append(fine, fine[0]), bc_type="periodic")(places) - fine[::FINER]
    return np.asarray(carried)


def _turning(measured: Measurement) -> Flags:
    """Which lines (N // 2 + 1,) turn with a shaft and are not excited."""
    lines = np.arange(measured.phase.size // 2 + 1)
    out = np.zeros(lines.size, dtype=bool)
    for gear in ("driver", "driven"):
        out |= lines % (measured.mesh_cycles // int(measured.record.attrs[f"teeth_{gear}"])) == 0
    out[0] = False
    out[excited(measured)] = False
    return out

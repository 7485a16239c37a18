"""Rotation that creeps against the excitation: clocks and drives that differ by parts per million.

Over a record the shafts are then ahead at last of where its samples have them, and what turns with them moves through
its lines, as if something in the mesh changed from one repetition to the next. The angles show by how much.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.intake.measurements import Measurement, without
from gearbench.diagnosis.intake.quality import noise_of
from gearbench.diagnosis.intake.signals import excited

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Creep over a record [cycles] below which no line shows it, and from which it is worth a sentence: the tenth mesh order
# has turned by a few degrees.
LEAST, TOLD = 1e-6, 1e-3


def in_step(measured: Measurement) -> Measurement:
    """The measurement with every repetition turned back to the mesh phase that it has on the mean: the lines of both
    shafts' orders, mesh orders among them, but for those that are excited; itself where nothing creeps."""
    creep = measured.creep
    more = float(np.ptp(creep))
    if more < LEAST:
        return measured
    turning = _turning(measured)
    order = np.arange(turning.size) / measured.mesh_cycles
    back = np.where(turning, np.exp(-2j * np.pi * order * creep[:, None]), 1.0)
    periods = {name: np.fft.irfft(back * np.fft.rfft(one, axis=-1), one.shape[-1], axis=-1)
               for name, one in measured.periods.items()}  # fmt: skip
    record = without(measured.record, {name: measured.periods[name] - one for name, one in periods.items()})
    notes = measured.warnings
    if more > TOLD:
        notes = (*notes, f"the rotation creeps by {more:.2g} mesh cycles against the excitation over the record: the"
                         " lines of both shafts are turned back by it")  # fmt: skip
    noise = {name: noise_of(one) for name, one in periods.items()}
    still = np.zeros_like(creep)
    return replace(measured, record=record, periods=periods, noise=noise, warnings=notes, creep=still)


def _turning(measured: Measurement) -> Flags:
    """Which lines (N // 2 + 1,) turn with a shaft and are not excited."""
    lines = np.arange(measured.phase.size // 2 + 1)
    out = np.zeros(lines.size, dtype=bool)
    for gear in ("driver", "driven"):
        out |= lines % (measured.mesh_cycles // int(measured.record.attrs[f"teeth_{gear}"])) == 0
    out[0] = False
    out[excited(measured)] = False
    return out

"""Records whose speed varies: measured mesh phase, mean mesh frequency, and the departure of the speed from it.

Lines count from the mean mesh frequency, rounded to d lines of the record; `shift` is the mesh frequency less that, in
lines, from the phase smoothed by cubic splines (single samples of a measured phase say nothing of a speed).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import make_lsq_spline

from gearbench.identification.spectra.excited import excited_lines
from gearbench.identification.spectra.joint import Floats, Spectra, SpectraError
from gearbench.identification.spectra.transmission_error import dte, force
from gearbench.records.antialias import common_lag
from gearbench.records.even_speed import VARIES, departure, mesh_phase

# Mesh periods for each interval of the splines of the phase, and most intervals.
SMOOTHED, INTERVALS = 4, 64
# Fewest mesh periods in a record, and a line counts as excited if its force exceeds this part of the strongest one's.
FEWEST = 2
EXCITED = 1e-2
# Mesh harmonics beyond the excited band that are kept unless told otherwise.
SIDEBANDS = 62


@dataclass(frozen=True)
class Course:
    """Of all realisations (E, N): `force` [N] without its mean, `cycles`: mesh phase, `shift` [lines]: mesh frequency
    less the mean one; `lowest`, `excited`: first and last excited line."""

    force: Floats
    cycles: Floats
    shift: Floats
    lowest: int
    excited: int

    def first(self, count: int) -> Course:
        """The first realisations alone."""
        return Course(self.force[:count], self.cycles[:count], self.shift[:count], self.lowest, self.excited)


def speed_varies(records: Sequence[xr.Dataset], limit: float = VARIES) -> bool:
    """Whether the mesh phase of a record departs from constant speed by more than `limit` [cycles]."""
    phases = (mesh_phase(record) for record in records)
    return any(departure(phase) > limit for phase in phases if phase is not None)


def excited_rows(records: Sequence[xr.Dataset]) -> tuple[list[tuple[Floats, Floats, Floats]], float, int, int]:
    """(dte, force, mesh phase) (N,) of each realisation, sampling rate [Hz], first and last excited line. Raises
    SpectraError for records of different sampling, of a phase that does not rise, of less than FEWEST mesh periods, or
    without excitation."""
    sampling = {(record.sizes["time"], float(record.attrs["sampling_rate"])) for record in records}
    if len(sampling) != 1:
        raise SpectraError("records of varying speed must have the same sampling_rate and number of samples")
    ((size, rate),) = sampling
    rows: list[tuple[Floats, Floats, Floats]] = []
    for record in records:
        phase = mesh_phase(record)
        if phase is None or not (np.diff(phase, axis=1) > 0).all():
            raise SpectraError("a varying speed needs a mesh_phase that rises from sample to sample in every record")
        lag = common_lag(record)
        if lag is not None:
            phase = np.array([_earlier(row, lag.delay * rate) for row in phase])
        rows += zip(dte(record).values, force(record).values, phase, strict=True)
    passed = min(float(row[2][-1] - row[2][0]) for row in rows) * size / (size - 1)
    if passed < FEWEST:
        raise SpectraError(
            f"the record of {size / rate:.4g} s holds {passed:.3g} mesh periods; at a speed that varies at least"
            f" {FEWEST} are needed: record longer"
        )
    strength = np.sqrt(np.mean([np.abs(np.fft.rfft(one[1] - one[1].mean())) ** 2 for one in rows], axis=0))
    if not strength.max() > 1e-12 * size * max(abs(float(one[1].mean())) for one in rows):
        raise SpectraError("the force is constant: without excitation nothing can be identified")
    excited = np.flatnonzero(excited_lines(strength**2, least=EXCITED))
    return rows, rate, max(int(excited[0]), 1), int(excited[-1])


def course_spectra(records: Sequence[xr.Dataset], sidebands: int | None = None) -> tuple[Spectra, Course]:
    """Spectra of whole records, without periods, and the course of their speed; lines up to the excited band's end, a
    quarter more, and `sidebands` mesh harmonics (None: SIDEBANDS). Raises SpectraError as `excited_rows`."""
    sidebands = SIDEBANDS if sidebands is None else sidebands
    rows, rate, lowest, excited = excited_rows(records)
    response, driving, cycles = (np.stack(part) for part in zip(*rows, strict=True))
    size = response.shape[1]
    d = round(float(np.mean(cycles[:, -1] - cycles[:, 0])) * size / (size - 1))
    highest = min((size - 1) // 2, int(1.25 * excited) + sidebands * d)
    spectra = Spectra(
        np.fft.rfft(driving, axis=1)[:, : highest + 1] / size,
        np.fft.rfft(response, axis=1)[:, : highest + 1] / size,
        rate / size,
        d,
        cycles[:, 0],
        False,
        repeats=int(records[0].attrs.get("periods", 1)),
    )
    swing = driving - driving.mean(axis=1, keepdims=True)
    return spectra, Course(swing, cycles, np.array([_speed(row) * size - d for row in cycles]), lowest, excited)


def _earlier(cycles: Floats, samples: float) -> Floats:
    """The mesh phase (N,) that many samples earlier, at the first speed before the record."""
    steps = np.arange(cycles.size) - samples
    before = np.minimum(steps, 0.0) * (cycles[1] - cycles[0])
    return np.asarray(np.interp(steps, np.arange(cycles.size), cycles) + before)


def _speed(cycles: Floats) -> Floats:
    """Mesh cycles in a sample (N,), from the phase smoothed by splines."""
    steps = np.arange(cycles.size, dtype=float)
    count = int(np.clip((cycles[-1] - cycles[0]) / SMOOTHED, 1, INTERVALS))
    inner = np.linspace(0.0, steps[-1], count + 1)[1:-1]
    knots: NDArray[np.float64] = np.concatenate([np.zeros(4), inner, np.full(4, steps[-1])])
    found = make_lsq_spline(steps, cycles, knots, k=3).derivative()(steps)
    return np.asarray(found, dtype=float)

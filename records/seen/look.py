"""A record as the checks see it: what is known of it, the first realisation's channels and their spectra."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property
from math import cos, pi

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.records.attributes import numeric_attribute
from gearbench.records.even_speed import VARIES, departure, mesh_phase
from gearbench.records.seen.taper import SPREAD, transform
from gearbench.records.transmission_error import (
    AngleOnlyWarning,
    TransmissionError,
    dte_of_channels,
    force_of_torques,
)

Array = NDArray[np.float64]
Complexes = NDArray[np.complex128]

GEARS = ("driver", "driven")
# Lines of a spectrum that the checks use at most, evenly spread: more would not tell more.
MOST_LINES = 800
# Departure of the mesh phase from even rotation [cycles] from which on nothing need repeat.
WANDERS = 0.5
# Departure of excitation periods from whole mesh periods [mesh periods] up to which both count as repeating.
WHOLE = 1e-3
# A line is excited when its force exceeds this part of the strongest line's, the mean apart.
EXCITED = 0.1


@dataclass(frozen=True, eq=False)
class Look:
    """A record that `validate_record` has passed. How it is wired does not change from realisation to realisation, so
    that the first one tells it."""

    record: xr.Dataset
    cut: bool = False  # a stretch out of a longer record, which need not repeat

    def number(self, name: str) -> float | None:
        """A numeric attribute, None where the record lacks it. Raises RecordError for text."""
        return numeric_attribute(self.record.attrs, name)

    def channel(self, name: str) -> Array | None:
        """Channel (samples,) of the first realisation, None where the record lacks it."""
        return np.asarray(self.record[name].values[0]) if name in self.record else None

    @property
    def rate(self) -> float:
        """Sampling rate [Hz]."""
        return float(self.record.attrs["sampling_rate"])

    @property
    def samples(self) -> int:
        """Samples of a realisation."""
        return int(self.record.sizes["time"])

    @cached_property
    def mesh_period(self) -> float | None:
        """Declared mesh period [s], from the attribute or the channel mesh_phase; None if unknown."""
        declared = self.number("mesh_period")
        phase = self.channel("mesh_phase")
        if declared is None and phase is not None and phase[-1] > phase[0]:
            declared = (phase.size - 1) / (float(phase[-1] - phase[0]) * self.rate)
        return declared

    @cached_property
    def departure(self) -> float:
        """Departure of the mesh phase [cycles] from that of a constant speed, 0 where the record does not say."""
        phase = mesh_phase(self.record.isel(realisation=[0]))
        return 0.0 if phase is None else departure(phase[0])

    @property
    def steady(self) -> bool:
        """Whether the speed is constant, so that what repeats with the mesh shows on lines of its own."""
        return self.departure < WANDERS

    @property
    def tapered(self) -> bool:
        """Whether spectra are tapered: at both ends of a run-up the gears are elsewhere, which derivatives by lines
        would take for a jump."""
        return self.cut or self.departure > VARIES

    def stretches(self, count: int) -> list[Look]:
        """The first realisation cut into so many stretches of equal length."""
        size = self.samples // count
        first = self.record.isel(realisation=[0])
        return [Look(first.isel(time=slice(size * part, size * (part + 1))), cut=True) for part in range(count)]

    @cached_property
    def zero_known(self) -> bool:
        """Whether the angles count from unloaded contact, so that the mean of the DTE means something."""
        return str(self.record.attrs.get("mesh_phase_origin", "geometry")) == "geometry"

    @cached_property
    def support_factor(self) -> float | None:
        """Part of y that acts along the line of action."""
        if str(self.record.attrs.get("support_direction", "tangential")) == "line-of-action":
            return 1.0
        angle = self.number("working_pressure_angle")
        return None if angle is None else cos(angle)

    def speed(self, gear: str) -> float:
        """Mean speed [rad/s] of a gear."""
        return mean_speed(self.record, gear)

    def swing(self, gear: str) -> Array | None:
        """Departure (samples,) [rad] of a gear's angle from steady rotation at the declared mesh period; of a speed
        that varies, from the straight line that fits best."""
        values, teeth = self.channel(f"angle_{gear}"), self.number(f"teeth_{gear}")
        if values is not None and self.tapered:
            steps = np.arange(values.size) - 0.5 * (values.size - 1)
            return np.asarray(values - values.mean() - mean_rate(values, 1.0, 1) * steps)
        if values is None or teeth is None or self.mesh_period is None:
            return None
        ramp = 2 * pi / (teeth * self.mesh_period * self.rate) * np.arange(values.size)
        return np.asarray(values - ramp)

    @cached_property
    def lines(self) -> NDArray[np.int64]:
        """Lines up to the highest excited one (without excitation: to a quarter of the rate), the mean left out."""
        driving = self.channel("torque_driver")
        driving = self.channel("force") if driving is None else driving
        assert driving is not None  # or the record would not be one
        size = self._size(driving)
        top = int(np.flatnonzero(size >= EXCITED * size.max())[-1])
        if size.max() <= 1e-9 * np.abs(driving).sum():
            top = self.samples // 4
        step = max(1, top // MOST_LINES)
        # An odd step meets even and odd lines, and with most combs lines of theirs.
        found = np.arange(self.lowest, max(top, self.lowest + 1) + 1, step + 1 - step % 2)
        met = size[found] >= EXCITED * size.max()
        excited = np.flatnonzero(size >= EXCITED * size.max())
        excited = excited[(excited >= self.lowest) & (excited <= top)]
        return found if met.any() else np.union1d(found, excited[:: max(1, excited.size // MOST_LINES)])

    @property
    def lowest(self) -> int:
        """The first line that holds nothing of the mean, or, of a speed that varies, of its course."""
        return SPREAD if self.tapered else 1

    @cached_property
    def omega(self) -> Array:
        """Angular frequencies [rad/s] of `lines`."""
        return np.asarray(2 * pi * self.lines * self.rate / self.samples)

    @cached_property
    def dte(self) -> Array | None:
        """DTE (samples,) [m] as the channels have it, else as stored; None if it cannot be computed."""
        first = self.record.isel(realisation=[0])
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", AngleOnlyWarning)
                return np.asarray(dte_of_channels(first).values[0])
        except TransmissionError:
            return self.channel("dte")

    def part_of_dte(self, name: str) -> float:
        """Rms fluctuation of a channel [m] over the DTE's; 1 where either is not there or the DTE stands still."""
        values, whole = self.channel(name), self.dte
        if values is None or whole is None or not whole.std() > 0:
            return 1.0
        return float(values.std() / whole.std())

    @property
    def stored_or_own_dte(self) -> Array | None:
        """DTE (samples,) [m] as identification takes it: stored, else from the channels."""
        return self.channel("dte") if "dte" in self.record else self.dte

    @cached_property
    def force(self) -> Array | None:
        """Force (samples,) [N] as the torques have it, else as stored; None if it cannot be computed."""
        try:
            return np.asarray(force_of_torques(self.record.isel(realisation=[0])).values[0])
        except TransmissionError:
            return self.channel("force")

    def excited(self, force: Array) -> NDArray[np.bool_]:
        """Which of `lines` a force (samples,) excites; none where it is constant. What counts is the strongest of all
        lines: those that are looked at may lie between the excited ones."""
        size = self._size(force)
        return np.asarray((size[self.lines] >= EXCITED * size.max()) & (size[self.lines] > 0))

    def _size(self, force: Array) -> Array:
        """Sizes of a force's lines, those below the lowest one 0."""
        size = np.abs(self.transform(force - force.mean()))
        size[: self.lowest] = 0.0
        return np.asarray(size)

    @cached_property
    def joint_samples(self) -> int | None:
        """Samples of the shortest run of excitation periods that holds whole mesh periods, if there are two such runs
        and the speed is constant."""
        period, periods = int(self.record.attrs["samples_per_period"]), int(self.record.attrs["periods"])
        if self.mesh_period is None or not self.steady:
            return None
        cycles = period / (self.rate * self.mesh_period)
        for count in range(1, periods // 2 + 1):
            whole = count * cycles
            if periods % count == 0 and round(whole) >= 1 and abs(whole - round(whole)) < WHOLE:
                return count * period
        return None

    def spectrum(self, values: Array, derivative: int = 0) -> Complexes:
        """DFT of values (samples,), or of a derivative in time, on `lines`, divided by the number of samples."""
        return np.asarray(self.transform(values, derivative)[self.lines] / values.size)

    def transform(self, values: Array, derivative: int = 0) -> Complexes:
        """The same on all lines, not divided, tapered where the speed varies."""
        return transform(values, self.rate, derivative, self.tapered)


def mean_speed(record: xr.Dataset, gear: str) -> float:
    """Mean speed [rad/s] of a gear in the first realisation: by how much its angle advances from period to period; with
    a single period by a linear fit, which swings of the gear falsify."""
    values, rate = record[f"angle_{gear}"].values[0], float(record.attrs["sampling_rate"])
    return mean_rate(values, rate, int(record.attrs["periods"]))


def mean_rate(values: NDArray[np.float64], rate: float, periods: int) -> float:
    """By how much values (N,), sampled at a rate [Hz], advance in a second, likewise."""
    if periods > 1:
        values, rate = values.reshape(periods, -1).mean(axis=1), rate * periods / values.size
    steps = np.arange(values.size) - 0.5 * (values.size - 1)
    return float(steps @ (values - values.mean()) / (steps @ steps)) * rate

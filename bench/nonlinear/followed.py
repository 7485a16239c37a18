"""The rotation of a driven gear as a record has it: a replay that follows it needs to know nothing of what holds the
load, be it a shaft, an inertia or what governs its speed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.record.sensors import encoder_error, lag, taken_back
from gearbench.rig import Rig

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SEEN = 4.0  # standard deviations of its noise above which a line is one of the rotation
ALIKE = 8  # lines to either side that have the noise of a line
STILL = 1e-12  # cycles of the mesh below which a gear turns steadily


@dataclass(frozen=True, eq=False)
class Followed:
    """A rotation that departs from a steady one by what repeats: half-spectrum `lines` (n // 2 + 1,) [mesh cycles] of
    `samples` n a repetition at `sampling_rate` [Hz]. Steady are `cycles_per_sample`, from `first` [cycles] on.

    Answers as `bench.plan.rotation.Rotation` does. Instants are evenly spaced, a whole number of them to a sample.
    """

    lines: Complex
    samples: int
    sampling_rate: float
    cycles_per_sample: float
    first: float
    teeth: int

    @cached_property
    def _fine(self) -> dict[tuple[int, int], Array]:
        return {}

    def _at(self, time: Array, order: int) -> Array:
        """The departure [cycles], or its derivative of that order, at instants (m,) [s]."""
        spacing = (time[-1] - time[0]) / (time.size - 1) if time.size > 1 else 1.0 / self.sampling_rate
        parts = max(round(1.0 / (spacing * self.sampling_rate)), 1)
        points = parts * self.samples
        if (parts, order) not in self._fine:
            omega = 2 * np.pi * np.fft.rfftfreq(self.samples, 1 / self.sampling_rate)
            lines = self.lines * (1j * omega) ** order
            self._fine[parts, order] = np.fft.irfft(lines, points) * (points / self.samples)
        begin = round(time[0] * self.sampling_rate * parts)
        return np.take(self._fine[parts, order], np.arange(begin, begin + time.size), mode="wrap")

    def cycles(self, time: Array) -> Array:
        """Mesh phase (m,) [cycles]."""
        return np.asarray(self.first + time * self.sampling_rate * self.cycles_per_sample + self._at(time, 0))

    def frequency(self, time: Array) -> Array:
        """Mesh frequency (m,) [Hz]."""
        return np.asarray(self.cycles_per_sample * self.sampling_rate + self.velocity(time))

    def velocity(self, time: Array) -> Array:
        """Rate (m,) [cycles/s] of the departure."""
        return self._at(time, 1)

    def acceleration(self, time: Array) -> Array:
        """Angular acceleration (m,) [rad/s^2] of the driver that turns with it."""
        return np.asarray(2 * np.pi / self.teeth * self._at(time, 2))

    @cached_property
    def departures(self) -> Array:
        """Departure (n,) [cycles] at the samples of one repetition."""
        return np.asarray(np.fft.irfft(self.lines, self.samples))


def follows(rig: Rig, record: xr.Dataset) -> bool:
    """Whether a replay can take the driven gear's rotation from the record: where the nominal rig prescribes it."""
    return rig.load.boundary == "speed" and not rig.load.twists and "angle_driven" in record


def followed(
    rig: Rig, record: xr.Dataset, realisation: int, cycles_per_sample: float, first: float
) -> Followed | None:
    """The rotation that a record shows, whose steady part begins at `first` [cycles]; None for a gear that turns
    steadily.

    What the rig's sensors do to the angle is taken back. Of lines that the repetitions show not to stand out of noise
    there is none.
    """
    attributes, sensors = record.attrs, rig.sensors
    rate, samples = float(attributes["sampling_rate"]), int(attributes["samples_per_period"])
    lines = _lines(rig, record, realisation, "driven", cycles_per_sample, first)
    if attributes.get("mesh_phase_origin") == "geometry":
        late = lag(sensors, "angle_driven")
        lines[0] += samples * (cycles_per_sample * rate * late - sensors.mesh_phase_zero)
    else:
        lines[0] = 0.0
    found = Followed(lines, samples, rate, cycles_per_sample, first, rig.driver.teeth)
    return found if np.ptp(found.departures) > STILL else None


def guide_of(
    rig: Rig, record: xr.Dataset, realisation: int, cycles_per_sample: float, first: float, turning: Followed | None
) -> Followed:
    """The driver's motion beside the rotation as a record shows it, without its mean: what nudges a simulated one."""
    rate, samples = float(record.attrs["sampling_rate"]), int(record.attrs["samples_per_period"])
    lines = _lines(rig, record, realisation, "driver", cycles_per_sample, first)
    if turning is not None:
        lines = lines - turning.lines
    lines[0] = 0.0
    return Followed(lines, samples, rate, cycles_per_sample, first, rig.driver.teeth)


def _lines(
    rig: Rig, record: xr.Dataset, realisation: int, gear: str, cycles_per_sample: float, first: float
) -> Complex:
    """Half-spectrum (n // 2 + 1,) [mesh cycles] of a gear's departure from a steady rotation, what its sensors do taken
    back; nothing where the repetitions show no more than noise."""
    attributes, sensors, teeth = record.attrs, rig.sensors, getattr(rig, gear).teeth
    samples, periods = int(attributes["samples_per_period"]), int(attributes["periods"])
    angle = record[f"angle_{gear}"].values[realisation]
    phase = first + np.arange(angle.size) * cycles_per_sample
    turned = angle - 2 * np.pi / teeth * phase - encoder_error(sensors, gear, 2 * np.pi / teeth * phase)
    repetitions = turned.reshape(periods, samples)
    delay = getattr(sensors, f"delay_angle_{gear}")
    swing = taken_back(repetitions.mean(axis=0), sensors, delay, float(attributes["sampling_rate"]))
    lines: Complex = np.fft.rfft(swing) * teeth / (2 * np.pi)
    if samples % 2 == 0:
        lines[-1] = 0.0  # of which half is seen
    if periods > 1:
        scatter = np.fft.rfft(repetitions - repetitions.mean(axis=0), axis=1) * teeth / (2 * np.pi)
        variance = (np.abs(scatter) ** 2).sum(axis=0) / (periods * (periods - 1))
        width = 2 * ALIKE + 1
        around = np.convolve(np.pad(variance, ALIKE, mode="reflect"), np.ones(width) / width, mode="valid")
        unseen = np.abs(lines) <= SEEN * np.sqrt(around)
        unseen[0] = False
        lines[unseen] = 0.0
    return lines

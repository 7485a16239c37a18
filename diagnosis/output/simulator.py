"""Simulated lines of all records for any unknowns, and their derivatives; what no rig may have is no answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.plan.workers import side_by_side
from gearbench.diagnosis.effects.sensor_delay import KEYS as DELAYS
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import simulated_channels
from gearbench.diagnosis.output.jacobian import (
    MOVED,
    STEP,
    drive_forces,
    inertial_forces,
    mesh_forces,
    moving,
    sensor_columns,
)
from gearbench.diagnosis.output.layout import Layout
from gearbench.diagnosis.output.structure import LEAST_STEP
from gearbench.diagnosis.output.target import Target
from gearbench.diagnosis.replay.replays import law_of
from gearbench.rig import Case

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Simulate = Callable[[Case, xr.Dataset], xr.Dataset]


@dataclass
class Simulator:
    """Replays for one layout and target. `simulate(case, record)` is one replay; `replays` counts them."""

    layout: Layout
    target: Target
    simulate: Simulate
    replays: int = 0
    _kept: dict[bytes, Complex] = field(default_factory=dict)

    def lines(self, p: Array) -> Complex | None:
        """Simulated lines (K,) of unknowns (size,); None where no rig has them or it does not settle."""
        key = p.tobytes()
        found = self._kept.get(key)
        if found is None:
            found = self._lines(p)
            if found is None:
                return None
            if len(self._kept) > 64:
                self._kept.clear()
            self._kept[key] = found
        return found

    def _lines(self, p: Array) -> Complex | None:
        def one(measured: Measurement) -> dict[str, Array]:
            return self.channels(p, measured)

        self.replays += len(self.target.measurements)
        try:
            lines = self.target.gathered(side_by_side(one, self.target.measurements))
        except ValueError:
            return None
        return lines if np.isfinite(lines).all() else None

    def channels(self, p: Array, measured: Measurement) -> dict[str, Array]:
        """Simulated channels of one record."""
        replayed = self.simulate(self.layout.case(p, measured.name), measured.record)
        return self._with_held(p, measured, simulated_channels(measured, replayed))

    def _with_held(self, p: Array, measured: Measurement, channels: dict[str, Array]) -> dict[str, Array]:
        """The channels with what a delay of the driven angle does to the measured one, where the rig holds its speed
        and the simulated one stands still."""
        late = float(p[self.layout.unknowns[DELAYS["angle_driven"]]][0])
        if not late or np.ptp(channels["angle_driven"]) > 0.0:
            return channels
        seen = moving(measured, channels, "angle_driven")
        omega = 2 * np.pi * np.fft.rfftfreq(seen.size, 1 / measured.sampling_rate)
        early = np.fft.irfft(np.exp(1j * omega * late) * np.fft.rfft(seen), seen.size)
        return {**channels, "dte": channels["dte"] + early - seen}

    def jacobian(self, p: Array, sd: Array, chosen: Flags) -> Complex | None:
        """Derivatives (size, K) of the lines by the chosen unknowns, zero for the others; None where `p` is no rig."""
        here = self.lines(p)
        if here is None:
            return None
        out = np.zeros((self.layout.size, here.size), dtype=complex)
        try:
            self._by_forces(out, p, chosen)
        except ValueError:
            return None
        unknowns = self.layout.unknowns
        low, high = unknowns.bounds()
        unmoved = self.layout.case(p)
        for key in (*MOVED, "inertia"):
            if key not in unknowns.slices:
                continue
            for index in range(*unknowns[key].indices(unknowns.size)):
                if not chosen[index] or sd[index] <= 0.0 or out[index].any():
                    continue
                least = LEAST_STEP.get(key, 0.0)
                step = least if 0.0 <= p[index] < least else STEP * sd[index]
                for signed in (step, -step):
                    moved = p.copy()
                    moved[index] += signed
                    if not low[index] <= moved[index] <= high[index]:
                        continue
                    if self.layout.case(moved) == unmoved:
                        break  # frequency of a housing that is not there
                    answer = self._lines(moved)
                    if answer is not None:
                        out[index] = (answer - here) / signed
                        break
        return out

    def _by_forces(self, out: Complex, p: Array, chosen: Flags) -> None:
        """Fill in what forces in the mesh and on the shaft, and sensors, do."""
        # Its time loop is compiled on import, which not every user of this module wants.
        from gearbench.bench.nonlinear.along import along
        from gearbench.bench.nonlinear.replay import steady_motion

        def one(item: tuple[int, Measurement]) -> tuple[int, list[tuple[NDArray[np.int64], dict[str, Array]]]]:
            number, measured = item
            case = self.layout.case(p, measured.name)
            tangent = along(steady_motion(case, measured.record, law_of(self.layout.model.law, case)))
            radius = self.layout.model.base_radius[1]
            found = []
            for forces, at, on in (
                (*mesh_forces(self.layout, tangent, chosen), None),
                (*drive_forces(self.layout, tangent, measured.name), tangent.drive),
                *inertial_forces(self.layout, tangent, p),
            ):
                if len(at):
                    answers = tangent.answers(forces, on)
                    answers["torque_driven"] = radius * answers.pop("mesh")
                    found.append((at, answers))
            here = self.channels(p, measured)
            for index, parts in sensor_columns(self.layout, self.target, number, here).items():
                if chosen[index]:
                    found.append((np.array([index]), {name: values[None] for name, values in parts.items()}))
            return number, found

        for number, found in side_by_side(one, list(enumerate(self.target.measurements))):
            for at, answers in found:
                self._put(out, number, at, answers)

    def _put(self, out: Complex, number: int, at: NDArray[np.int64], answers: dict[str, Array]) -> None:
        start = 0
        for record, channel, bins in self.target.plan:
            stop = start + len(bins)
            if record == number:
                spectrum = np.fft.rfft(answers[channel], axis=-1)[:, bins] / answers[channel].shape[-1]
                out[at, start:stop] += spectrum
            start = stop


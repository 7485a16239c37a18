"""Simulated lines of all records for any unknowns, and their derivatives; what no rig may have is no answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.workers import side_by_side
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import has_both_y, simulated_channels
from gearbench.diagnosis.replay.replays import Replay, Replays, law_of
from gearbench.diagnosis.simulation.jacobian import (
    MOVED,
    SHORT_STEP,
    STEP,
    Other,
    forces_of,
    others_of,
    pieces,
    sensor_columns,
)
from gearbench.diagnosis.simulation.target import Target
from gearbench.diagnosis.structure.layout import Layout
from gearbench.diagnosis.structure.structure import least_steps
from gearbench.lumped.nonlinear.coordinates import Acting
from gearbench.rig import Case

if TYPE_CHECKING:
    from gearbench.bench.nonlinear.along import Along
    from gearbench.bench.nonlinear.replay import Steady

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]
Spectra = Mapping[str, NDArray[np.complexfloating[Any, Any]]]


@dataclass
class Simulator:
    """Replays for one layout and target. `simulate(case, record)` is one replay, which takes what nudges the driver
    [N s/m] besides in the records that `nudges` names; `replays` counts them."""

    layout: Layout
    target: Target
    simulate: Replay
    nudges: Mapping[str, float] = field(default_factory=dict)
    replays: int = 0
    _kept: dict[bytes, Complex] = field(default_factory=dict)

    def of_record(self, number: int) -> Simulator:
        """The same for one record alone."""
        return self.of_target(self.target.of_record(number))

    def of_target(self, target: Target) -> Simulator:
        """The same for other lines."""
        return Simulator(self.layout, target, self.simulate, self.nudges)

    @property
    def free(self) -> Simulator:
        """The same without what nudges."""
        return Simulator(self.layout, self.target, self.simulate) if self.nudges else self

    @property
    def smooth(self) -> tuple[int, ...]:
        """Numbers of the records that nothing nudges; all where there is none."""
        kept = tuple(number for number, one in enumerate(self.target.measurements) if one.name not in self.nudges)
        return kept or tuple(range(len(self.target.measurements)))

    @property
    def held_by(self) -> tuple[Measurement, ...]:
        """Those records."""
        return tuple(self.target.measurements[number] for number in self.smooth)

    @property
    def anchored(self) -> bool:
        """Whether records that nothing nudges hold the rig, which those that are nudged only refine."""
        return any(one.name not in self.nudges for one in self.target.measurements)

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
        nudge = self.nudges.get(measured.name, 0.0)
        return simulated_channels(measured, self.simulate(self.layout.case(p, measured.name), measured.record, nudge))

    def jacobian(self, p: Array, sd: Array, chosen: Flags, near: Complex | None = None) -> Complex | None:
        """Derivatives (size, K) of the lines by the chosen unknowns, zero for the others; None where `p` is no rig.
        What has to be moved and simulated stays as it was `near` (size, K) by, if that is given."""
        here = self.lines(p)
        if here is None:
            return None
        out = np.zeros((self.layout.size, here.size), dtype=complex)
        try:
            others = others_of(self.layout, p, sd, chosen)
            self._by_forces(out, p, chosen, others)
        except ValueError:
            return None
        left = chosen & self.layout.unknowns.of(MOVED) & ~np.isin(np.arange(p.size), [one.number for one in others])
        if near is None:
            self._by_moves(out, p, sd, left)
        else:
            out[left] = near[left]
        return out

    def moved(self, p: Array, sd: Array, chosen: Flags) -> Complex | None:
        """Derivatives (size, K) of the lines by the chosen unknowns, each moved and simulated; zero for the others,
        None where `p` is no rig."""
        here = self.lines(p)
        if here is None:
            return None
        out = np.zeros((self.layout.size, here.size), dtype=complex)
        self._by_moves(out, p, sd, chosen & self.layout.unknowns.of(MOVED))
        return out

    @property
    def step(self) -> float:
        """Part of a standard deviation by which unknowns are moved for a derivative."""
        return SHORT_STEP if self.nudges else STEP

    def _by_moves(self, out: Complex, p: Array, sd: Array, chosen: Flags) -> None:
        """Fill in what is moved and simulated."""
        unknowns, here = self.layout.unknowns, self.lines(p)
        assert here is not None
        low, high = unknowns.bounds()
        unmoved, leasts = self.layout.case(p), least_steps(unknowns)
        for key in MOVED:
            for index in unknowns.at(key):
                if not chosen[index] or sd[index] <= 0.0:
                    continue
                least = leasts.get(key, 0.0)
                step = least if 0.0 <= p[index] < least else self.step * sd[index]
                for signed in (step, -step):
                    moved = p.copy()
                    moved[index] += signed
                    if not low[index] <= moved[index] <= high[index]:
                        continue
                    try:
                        if self.layout.case(moved) == unmoved:
                            break  # frequency of a housing that is not there
                    except ValueError:  # of this sense there is no rig
                        continue
                    answer = self._lines(moved)
                    if answer is not None:
                        out[index] = (answer - here) / signed
                        break

    def motion(self, p: Array, measured: Measurement) -> tuple[Case, Steady]:
        """The rig of unknowns (size,) as it is in one record, and its steady motion there."""
        # Its time loop is compiled on import, which not every user of this module wants.
        from gearbench.bench.nonlinear.replay import steady_motion

        coarser = self.simulate.coarser if isinstance(self.simulate, Replays) else 1.0
        case = self.layout.case(p, measured.name)
        law, nudge = law_of(self.layout.model.sound, case), self.nudges.get(measured.name, 0.0)
        return case, steady_motion(case, measured.record, law, nudge=nudge, coarser=coarser)

    def answers(self, measured: Measurement, tangent: Along, acting: Acting) -> Spectra:
        """Half-spectra (departures, K) of what the channels of a record change by under small forces."""
        answers = tangent.answers(acting)
        answers["torque_driven"] *= self.layout.model.base_radius[1]
        if not has_both_y(measured):
            answers["dte"] = answers["angle_driver"] - answers["angle_driven"]
        return answers

    def _by_forces(self, out: Complex, p: Array, chosen: Flags, others: Sequence[Other]) -> None:
        """Fill in what forces in the mesh and on the coordinates, and sensors, do."""
        # Its time loop is compiled on import, which not every user of this module wants.
        from gearbench.bench.nonlinear.along import along
        from gearbench.bench.nonlinear.replay import seen_of

        def one(item: tuple[int, Measurement]) -> None:
            number, measured = item
            case, steady = self.motion(p, measured)
            tangent = along(steady)
            forces = forces_of(self.layout, p, tangent, measured.name, chosen, others)
            for part in pieces(forces, measured.phase.size):
                self.put(out, number, part.at, self.answers(measured, tangent, part.acting))
            seen = simulated_channels(measured, seen_of(case, steady))
            for index, parts in sensor_columns(self.layout, self.target, number, seen).items():
                if chosen[index]:
                    self.put(out, number, np.array([index]), {name: values[None] for name, values in parts.items()})

        # Each record fills lines of its own.
        side_by_side(one, list(enumerate(self.target.measurements)))

    def put(self, out: Complex, number: int, at: Integers, spectra: Spectra) -> None:
        """Add to rows `at` (n,) of `out` the lines of half-spectra (n, K) that a record answers; one row may have
        several answers."""
        samples, start = self.target.measurements[number].phase.size, 0
        for record, channel, bins in self.target.plan:
            stop = start + len(bins)
            if record == number:
                gains = self.target.gains[start:stop] / samples
                for row, lines in zip(at, spectra[channel][:, bins], strict=True):
                    out[row, start:stop] += lines * gains
            start = stop

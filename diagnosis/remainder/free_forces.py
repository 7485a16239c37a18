"""Forces without a name: what no number of a rig makes, each a small force along a rig's motion, and what it is worth.

A joint between two parts passes a force that depends on how far they are apart and how fast they move (Masri and
Caughey 1979); a rig has what is linear in both, and the laws of the library. What a joint may have besides is tried
here in its simplest forms: a damper that grows or falls with the rate, and a spring that is stiffer one way. Their
lines are first-order answers of the rig's tangent, so that nothing is simulated for them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.workers import side_by_side
from gearbench.diagnosis.evidence.decision import at_place
from gearbench.diagnosis.fitting.fit import Optimum
from gearbench.diagnosis.forces.equations import SUPPORTS
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.simulation.quadratic import quadratic_of
from gearbench.diagnosis.simulation.simulator import Simulator, Spectra
from gearbench.lumped.nonlinear.coordinates import IN_MESH, U1, Acting, W
from gearbench.rig.contract import Place

if TYPE_CHECKING:
    from gearbench.bench.nonlinear.along import Along

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Rms of such a force over that of the linear one at its place, one standard deviation before any record.
WIDE = 1.0
# Part of the time without contact up to which flanks stay together.
PARTED = 1e-3
TINY = 1e-300


@dataclass(frozen=True)
class Form:
    """What is in the joint at a `place`."""

    kind: Literal["damper", "spring"]
    place: Place

    @property
    def name(self) -> str:
        """Kind and place."""
        return f"{self.kind} {self.place}"

    @property
    def words(self) -> str:
        """How a sentence begins with it."""
        if self.kind == "damper":
            return f"damping {at_place(self.place)} that is not in proportion to the rate"
        return f"a stiffness {at_place(self.place)} that differs between both senses"


@dataclass(frozen=True)
class FreeForce:
    """A form's log Bayes factor `worth` over no such force [nats], and its `size`, rms over that of the linear force at
    its place."""

    form: Form
    worth: float
    size: float


@dataclass(frozen=True)
class _Course:
    """A form along a motion: a force (entries,), `on` coordinates with such factors, and the linear force (entries,)
    [N] at its place. Of the force only the course counts, that of all records in one unit."""

    form: Form
    on: tuple[tuple[int, float], ...]
    force: Array
    linear: Array


def free_forces(simulator: Simulator, found: Optimum) -> tuple[FreeForce, ...]:
    """What forces without a name are worth beside all that `found` holds, by the records in which its flanks stay
    together: impacts, met a little otherwise, look like any of them. Raises what a simulation of that rig raises."""
    motions = side_by_side(lambda one: motion_of(simulator, found.p, one), simulator.target.measurements)
    kept = {n: one for n, one in enumerate(motions) if float((one.elastic <= 0.0).mean()) <= PARTED}
    if not kept:
        return ()
    inside, target = simulator.target.in_records(list(kept)), simulator.target.of_records(list(kept))
    forms = lines_of_forms(simulator.of_target(target), list(kept.values()))
    nothing, (low, high) = np.zeros(len(forms)), simulator.layout.unknowns.bounds()
    near = quadratic_of(
        target,
        target.lines - found.lines[inside],
        np.concatenate([found.sensitivity.jacobian[:, inside], *(column[None] for _, column in forms)]),
        np.append(found.sensitivity.quadratic.active, found.p.size + np.arange(len(forms))),
    )
    p = np.append(found.p, nothing)
    bounds = np.append(low, nothing - np.inf), np.append(high, nothing + np.inf)

    def weighed(widths: Array) -> tuple[float, Array]:
        """Log evidence with forces of these prior widths (forms,), none of width 0, and their sizes (forms,)."""
        sd = np.append(found.sd, widths)
        step, cost, information = near.best(p, sd, bounds)
        return near.evidence(cost, information, sd), step[len(step) - len(forms) :]

    plain, _ = weighed(nothing)
    out = []
    for (form, _), widths in zip(forms, WIDE * np.eye(len(forms)), strict=True):
        evidence, sizes = weighed(widths)
        out.append(FreeForce(form, evidence - plain, float(sizes[widths > 0.0][0])))
    return tuple(out)


def motion_of(simulator: Simulator, p: Array, measured: Measurement) -> Along:
    """The motion of the rig of unknowns (size,) in a record."""
    # Its time loop is compiled on import, which not every user of this module wants.
    from gearbench.bench.nonlinear.along import along

    return along(simulator.motion(p, measured)[1])


def lines_of_forms(simulator: Simulator, motions: Sequence[Along]) -> list[tuple[Form, Complex]]:
    """The forms along the motions in all records, each with what the lines (K,) change by where it is as large as its
    linear force, over all of them."""
    pairs = list(zip(simulator.target.measurements, motions, strict=True))
    found = side_by_side(lambda pair: _answered(simulator, *pair), pairs)
    out = []
    for number, same in enumerate(zip(*(courses for courses, _ in found), strict=True)):
        size = np.sqrt(sum(_power(one.linear) for one in same) / max(sum(_power(one.force) for one in same), TINY))
        lines = np.zeros((1, simulator.target.lines.size), dtype=complex)
        for record, (_, spectra) in enumerate(found):
            only = {channel: rows[[number]] for channel, rows in spectra.items()}
            simulator.put(lines, record, np.array([0]), only)
        if np.abs(lines).max() > 0.0:
            out.append((same[0].form, lines[0] * size))
    return out


def _answered(simulator: Simulator, measured: Measurement, motion: Along) -> tuple[list[_Course], Spectra]:
    """The forms along the motion in a record, and what its channels change by under each."""
    courses = list(_courses(motion))
    values = [factor * one.force for one in courses for _, factor in one.on]
    on = [coordinate for one in courses for coordinate, _ in one.on]
    of = [number for number, one in enumerate(courses) for _ in one.on]
    acting = Acting(np.stack(values, axis=1).astype(np.float32), np.array(on), np.array(of))
    return courses, simulator.answers(measured, motion, acting)


def _courses(along: Along) -> Iterator[_Course]:
    """The forms along a motion."""
    model, rate = along.model, along.rate
    yield _damped("mesh", ((IN_MESH, 1.0),), rate, along.tangent.damping * rate)
    dampers = model.constants().damping1, model.constants().damping2
    for support, spring, damper in zip(SUPPORTS, model.support_springs, dampers, strict=True):
        moved = along.resampled(spring.deflection(along.places))
        moved = moved - moved.mean()
        on, place = tuple((number, -part) for number, part in enumerate(spring.along) if part), support.equation.place
        yield _Course(Form("spring", place), on, moved**2, spring.stiffness * moved)
        closing = along.rate_of(moved)
        yield _damped(place, on, closing, damper * closing)
    if model.elastic_shaft:
        twisting = along.rate_of(along.fine(W) - along.fine(U1))
        yield _damped("drive", ((W, -1.0), (U1, 1.0)), twisting, model.shaft[1] * twisting)


def _damped(place: Place, on: tuple[tuple[int, float], ...], rate: Array, linear: Array) -> _Course:
    """Damping with the square of a rate (entries,) [m/s]."""
    return _Course(Form("damper", place), on, rate * np.abs(rate), linear)


def _power(values: Array) -> float:
    """Mean square."""
    return float(np.mean(values**2))

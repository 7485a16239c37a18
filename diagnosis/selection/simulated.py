"""From the search by forces to what simulation makes of it: which records, where to begin, what is weighed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.backlash import KEY as BACKLASH
from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.library import hypotheses as library
from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.evidence.decision import likeliest_fit
from gearbench.diagnosis.evidence.prediction import predicted_factors
from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.evidence.search import Search
from gearbench.diagnosis.fitting.around import around
from gearbench.diagnosis.fitting.background import background
from gearbench.diagnosis.fitting.fit import Optimum, fit_afresh
from gearbench.diagnosis.fitting.hidden_by_forces import motion_by_forces
from gearbench.diagnosis.fitting.hidden_motion import Motion
from gearbench.diagnosis.fitting.likely_teeth import with_likely_teeth, with_small_cracks
from gearbench.diagnosis.fitting.shown import Shown
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.replay.replays import Replay
from gearbench.diagnosis.selection.by_forces import Start, begun_by_forces
from gearbench.diagnosis.selection.by_losses import with_losses
from gearbench.diagnosis.selection.followable import followable, nudges_of, parts
from gearbench.diagnosis.selection.parting import with_parting
from gearbench.diagnosis.selection.selection import Selection, select
from gearbench.diagnosis.selection.weighing import Weighed
from gearbench.diagnosis.simulation.passed_noise import noise_left
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import target_of
from gearbench.diagnosis.structure.layout import Layout, layout_of
from gearbench.diagnosis.structure.structure import beginnings
from gearbench.rig import Case

Array = NDArray[np.float64]
Report = Callable[[str], None]

# What only its own hypothesis carries over from the force residuals: no tooth is cracked else, and backlash, which few
# records feel, is the nominal one.
ITS_OWN = (CRACK, BACKLASH)
CRACKED = 2  # teeth that may be cracked: those that the force residuals rank first


@dataclass(frozen=True)
class Simulated:
    """What simulation found: the effects that entered, the unknowns' layout and the simulator."""

    layout: Layout
    simulator: Simulator
    selection: Selection
    # Names of records whose motion need not repeat where nothing changes.
    restless: frozenset[str] = frozenset()
    # Effects that entered and were left out again, not to be tried once more.
    out: tuple[Weighed, ...] = ()
    _ends: dict[bytes, Array] = field(default_factory=dict)

    def with_selection(self, selection: Selection) -> Simulated:
        """The same with another selection."""
        return replace(self, selection=selection)

    @property
    def std(self) -> Array:
        """Standard deviations (size,) of the unknowns at the optimum."""
        out = self.selection.best.std
        for one in self.selection.entered:
            if one.std is not None:
                out[one.hypothesis.entries(self.layout.unknowns)] = one.std
        return out

    @property
    def recalibrated(self) -> Case:
        """The nominal case at the optimum of the background alone, without any part of the effects that entered: what a
        good rig has of them would else take their place in the gap."""
        return self.layout.case(self.end_of(self.selection.bare))

    @property
    def without_any(self) -> Case:
        """The nominal case at the optimum of the background."""
        return self.layout.case(self.end_of(self.selection.base))

    @property
    def with_effects(self) -> Case | None:
        """The case at the optimum with all effects that entered; None without any."""
        return self.layout.case(self.end_of(self.selection.best)) if self.selection.entered else None

    def end_of(self, optimum: Optimum) -> Array:
        """Unknowns (size,) of an optimum, where all records are nudged fitted on without that: gaps are those of
        simulations that go their own way."""
        if self.simulator.anchored:
            return optimum.p
        key = optimum.p.tobytes()
        if key not in self._ends:
            try:
                found = fit_afresh(self.simulator.free, optimum.p, optimum.sd, renewals=1)
            except ValueError:  # a fit that leads nowhere from where it was nudged to
                found = None
            self._ends[key] = found.p if found is not None else optimum.p
        return self._ends[key]


def simulated(
    problem: Problem,
    found: Search,
    measurements: Sequence[Measurement],
    nominal: Case,
    simulate: Replay,
    without: Sequence[str] = (),
    report: Report = lambda step: None,
    *,
    judged: Measurement | None = None,
) -> Simulated | None:
    """Which effects the records call for, by simulation; None where the nominal rig cannot be simulated at all, records
    do not tell the mesh phase, or flanks part in all of them, on the nominal rig and on that of the force residuals.
    `judged`: the record that judges what enters, None where none does."""
    apart, layout = judged is not None, layout_of(nominal, problem.model, problem.conditions, ())
    by_forces = carried(problem.unknowns, found.base.p, layout.unknowns, ITS_OWN)
    smooth, nudges, restless = followable((nominal, layout.case(by_forces)), measurements, problem, simulate)
    if not smooth:
        return None
    listed = library(problem.model, without)
    cracks = [one for one in listed if one.wide[0].key == CRACK]
    chosen = [measurements[number] for number in smooth]
    conditions = [problem.conditions[number] for number in smooth]
    noises = [noise_left(layout.case(np.zeros(layout.size), one.name), one, simulate) for one in chosen]
    simulator = Simulator(layout, target_of(chosen, conditions, noises), simulate, nudges)

    # What acts in the mesh may be anything for the one, an impact too, and is measured for the other.
    shown = Shown(lambda held: around(layout, problem.conditions, held), cache(lambda: _hidden(problem, found)))
    base = background(simulator, _beginnings(layout, by_forces), shown, report)
    if base is None:
        return None
    ranked = _cracked_by_forces(problem, found, cracks) if cracks else []
    simulator = replace(simulator, layout=replace(layout, teeth=tuple(ranked)))
    starts = with_losses(simulator, base, listed, _starts(layout, problem.unknowns, found, listed), report)
    for teeth_first in (True, False):
        if cracks:
            simulator, base = with_likely_teeth(simulator, base, ranked)
            base = with_small_cracks(simulator, base)
        if teeth_first:
            here = base
            base, starts = begun_by_forces(simulator, base, _weighed(listed, simulator.layout), starts, shown, report)
            if base is here:
                break
    weighed = _weighed(listed, simulator.layout)
    selection = select(simulator, base, weighed, starts, report, shown, apart=apart)
    rough = [number for number, one in enumerate(measurements) if number not in smooth or one.name in nudges]
    if rough:
        conditions = [problem.conditions[number] for number in rough]
        target = target_of([measurements[number] for number in rough], conditions)
        alone = Simulator(simulator.layout, target, simulate, nudges_of(problem.model, conditions))
        # Only a record whose flanks part needs what others tell of that.
        wanted = judged is not None and parts(nominal, judged, simulate)
        simulator, selection = with_parting(
            simulator, alone, selection, weighed, starts, report, wanted=wanted, apart=apart
        )
    return Simulated(simulator.layout, simulator, selection, restless)


def _hidden(problem: Problem, found: Search) -> Motion | None:
    """The motion of a housing under the sensors that the forces show."""
    try:
        return motion_by_forces(problem, likeliest_fit(found))
    except ValueError:  # a reading that cannot be made costs a beginning, not the verdict
        return None


def _weighed(listed: Sequence[Hypothesis], layout: Layout) -> list[Hypothesis]:
    """Those listed whose teeth may be cracked."""
    return [one for one in listed if one.wide[0].key != CRACK or one.wide[0].at in layout.teeth]


def _cracked_by_forces(problem: Problem, found: Search, cracks: Sequence[Hypothesis]) -> list[int]:
    """Teeth that the force residuals rank first."""
    ranked = np.argsort(-predicted_factors(found.base, problem.unknowns, cracks))[:CRACKED]
    return [at for at in (cracks[number].wide[0].at for number in ranked) if at is not None]


def carried(unknowns: Unknowns, p: Array, into: Unknowns, but: Collection[str] = ()) -> Array:
    """Unknowns (size,) as those of another list, such as the force residuals', which have filters in place of a
    layout's structure; zero what either has not, and `but`."""
    out = np.zeros(into.size)
    for one in into.groups:
        if one.key in unknowns.slices and one.key not in but:
            out[into[one.key]] = p[unknowns[one.key]]
    return out


def _beginnings(layout: Layout, by_forces: Array) -> list[Array]:
    """Where to begin without an effect: the nominal rig, and the force residuals' one without and with structure."""
    return [np.zeros(layout.size), *beginnings(layout.unknowns, by_forces)]


def _starts(
    layout: Layout, unknowns: Unknowns, found: Search, weighed: Sequence[Hypothesis]
) -> Mapping[str, Start]:
    names = {one.name: one for one in weighed}
    out = {}
    for one in found.tried:
        if one.fit is None or one.hypothesis.name not in names:
            continue
        p = carried(unknowns, one.fit.p, layout.unknowns, ITS_OWN)
        if one.hypothesis.wide[0].key in ITS_OWN:
            here, there = (one.hypothesis.entries(of) for of in (layout.unknowns, unknowns))
            own = one.fit.p[there]
            p[here] = np.maximum(own, 0.0) if one.hypothesis.wide[0].key == CRACK else own
        out[one.hypothesis.name] = Start(names[one.hypothesis.name], p, one.log_bayes_factor)
    return out

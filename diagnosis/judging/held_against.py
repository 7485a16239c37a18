"""Selection held against the record that had no part in it: what each effect closes there.

Every effect that entered is taken out alone, the rig, its structure and the other effects that entered are fitted
again on the records of the search, and both rigs answer the judged record. An effect is kept if the record is more
likely with it, and if its gap grows by a tenth or more without it in some part that can be told apart: a channel in one
band, or in one kind of line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.fitting.fit import Optimum
from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.judging.along import way_of
from gearbench.diagnosis.judging.by_chance import closed_in_all
from gearbench.diagnosis.judging.closing import DUE, Closing, both, closed_parts, closing_of, feels, free_closing
from gearbench.diagnosis.judging.judged import GREATER, Judged
from gearbench.diagnosis.selection.followable import nudges_of, parts
from gearbench.diagnosis.selection.selection import Selection, further, only, taken_out
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.selection.weighing import Weighed, has_own
from gearbench.diagnosis.simulation.passed_noise import noise_left
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import Target, target_of

Array = NDArray[np.float64]
Report = Callable[[str], None]


def judged_on(
    problem: Problem,
    found: Simulated,
    measured: Measurement,
    searched: Sequence[Measurement] = (),
    report: Report = lambda step: None,
) -> Judged | None:
    """The selection with only those effects that close a part of the gap of `measured`, and those whose place others
    had that do not; None where the rig found cannot answer that record. Those of the records `searched` whose flanks
    part, which the fit leaves out or is nudged along, judge what `measured` does not feel, or feels too little of to
    speak for or against it."""
    band = problem.conditions[0].band
    noise = noise_left(found.layout.nominal, measured, found.simulator.simulate)
    condition = prepare(measured, problem.model, band)
    target, way = target_of([measured], [condition], [noise]), way_of(found, problem.model, condition, measured)
    scatter: Mapping[str, Array] = noise
    if is_nudged(found, measured):
        scatter = scattered(noise)
        nudges = {**found.simulator.nudges, **nudges_of(problem.model, [condition])}
        found = replace(found, simulator=replace(found.simulator, nudges=nudges))
    rough = [one for one in searched if not any(one is own for own in found.simulator.held_by)]
    parted = [target_of([one], [prepare(one, problem.model, band)]) for one in rough]
    dropped: list[Weighed] = []
    seen: set[frozenset[str]] = set()
    # A record that had part in the search cannot make up for what it lacked.
    apart = not found.simulator.target.has(measured)
    while True:
        seen.add(_names(found.selection.entered))
        try:
            judged = _closings(found, target, measured, parted, scatter, way, apart=apart)
        except ValueError:
            return None
        poor = [one for one in found.selection.entered if not _stays(judged, one)]
        if poor:
            worst = min(poor, key=lambda one: judged.closings[one.hypothesis.name].gain)
            dropped.append(worst)
            kept = [one for one in found.selection.entered if one is not worst]
            selection = only(found.simulator, found.selection, kept)
        else:
            more = further(found.simulator, found.selection, (*found.out, *dropped), report, apart=apart)
            # Effects may take turns, each needless beside the other: what was judged already is judged no more.
            if more is None or _names(more.entered) in seen:
                return replace(judged, dropped=tuple(dropped))
            selection = more
        found = found.with_selection(selection)


def scattered(noise: Mapping[str, Array]) -> dict[str, Array]:
    """The parts (parts, N) of noise of each channel where motions need not repeat: the simulated one departs from the
    mean of all, too, as far as one repetition of the record does."""
    return {channel: sqrt(1.0 + len(parts)) * parts for channel, parts in noise.items()}


def _names(entered: Sequence[Weighed]) -> frozenset[str]:
    return frozenset(one.hypothesis.name for one in entered)


def _stays(judged: Judged, one: Weighed) -> bool:
    """Whether an effect is due; weak evidence is nothing to go by where the greater part is not explained. A number of
    the nominal rig, which recalibration moves anyway, must make a difference to the whole: some part of it is closer by
    what else it makes up for."""
    closing, unknowns = judged.closings[one.hypothesis.name], judged.found.layout.unknowns
    if not has_own(unknowns, one.hypothesis) and judged.grown(closing.without) < DUE:
        return False
    return closing.due and not (closing.lacking and judged.left > GREATER)


def is_nudged(found: Simulated, measured: Measurement) -> bool:
    """Whether the driver is nudged in a record that judges: where all records of the search are, or some, and its
    flanks part as theirs."""
    if found.simulator.anchored and found.simulator.nudges:
        return parts(found.layout.nominal, measured, found.simulator.simulate)
    return bool(found.simulator.nudges)


def itself(problem: Problem, found: Simulated) -> Judged:
    """The selection on the first record that it was found from, where no other can be answered."""
    measured = found.simulator.held_by[0]
    judged = judged_on(problem, found, measured)
    assert judged is not None  # its optimum has been simulated there
    return judged


def _closings(
    found: Simulated,
    target: Target,
    measured: Measurement,
    parted: Sequence[Target],
    noise: Mapping[str, Array],
    way: Simulator | None,
    *,
    apart: bool,
) -> Judged:
    """What each effect that entered closes; `way`: what keeps the driver on the record's way, if that may matter."""
    simulator, selection = found.simulator, found.selection
    # Sizes are those of simulations that go their own way.
    ends = (np.zeros(simulator.layout.size), found.end_of(selection.bare), found.end_of(selection.best))
    nominal, plain, signals = (simulator.free.channels(p, measured) for p in ends)
    judged = Judged(measured, found, {}, nominal, plain, signals, target=target, noise=noise)
    kept = _kept(way, selection.best.p, measured)
    if kept is not None and judged.strays_from(kept):
        judged = replace(judged, kept=kept)
    nudged = signals if simulator.free is simulator else simulator.channels(selection.best.p, measured)
    closings = {}
    for one in selection.entered:
        optimum = taken_out(simulator, selection, one)
        if way is not None and judged.kept is not None:
            closing = _along_the_way(found, way, target, measured, optimum, judged.kept)
            silent = not feels(target, closing.without, judged.kept)
        else:
            closing, silent = _by_itself(found, target, measured, optimum, signals, nudged)
        lacking = inf if one.lacking and not apart else one.lacking
        if parted and not one.lacking and (silent or closing.open):
            told = [_closing_there(simulator, there, optimum.p, selection.best.p) for there in parted]
            closing = replace(max(told, key=lambda there: there.gain), without=closing.without, own=closing.own)
        closings[one.hypothesis.name] = replace(closing, optimum=optimum, lacking=lacking)
    return replace(judged, closings=closings)


def _kept(way: Simulator | None, p: Array, measured: Measurement) -> Mapping[str, Array] | None:
    """Signals of the rig `p` (size,) on the record's way; None without one, or where it cannot be kept there."""
    try:
        return way.channels(p, measured) if way is not None else None
    except ValueError:
        return None


def _by_itself(
    found: Simulated,
    target: Target,
    measured: Measurement,
    optimum: Optimum,
    signals: Mapping[str, Array],
    nudged: Mapping[str, Array],
) -> tuple[Closing, bool]:
    """What the effect that is not in `optimum` closes, and whether the record does not feel it; `signals` are those of
    the final rig as it goes its own way, `nudged` those of it as the search has it."""
    simulator, selection = found.simulator, found.selection
    free = simulator.free
    closing = closing_of(target, simulator.channels(optimum.p, measured), nudged)
    silent = not feels(target, closing.without, nudged)
    if not simulator.anchored or (simulator.nudges and measured.name in simulator.nudges):
        others = _others(selection, optimum)
        alone = [free_closing(target, free.channels(found.end_of(one), measured), signals) for one in others]
        steady = None
        if closing.due and not all(one.due for one in alone):
            parts = closed_parts(target, closing.without, nudged)
            steady = closed_in_all(found, target, measured, others, parts)
        closing = both(closing, *alone, steady=steady)
    return closing, silent


def _along_the_way(
    found: Simulated,
    way: Simulator,
    target: Target,
    measured: Measurement,
    optimum: Optimum,
    kept: Mapping[str, Array],
) -> Closing:
    """The same where the final rig, whose signals on the record's way are `kept`, goes another by itself."""
    without = [way.channels(other.p, measured) for other in _others(found.selection, optimum)]
    closing = min((free_closing(target, one, kept) for one in without), key=lambda one: (one.due, one.gain))
    return replace(closing, own=found.simulator.free.channels(found.end_of(optimum), measured))


def _others(selection: Selection, optimum: Optimum) -> list[Optimum]:
    """The rigs that must do worse than the final one for an effect to close something: that without it, and where it is
    alone, that which was found without any."""
    return [optimum, selection.bare] if len(selection.entered) == 1 else [optimum]


def _closing_there(simulator: Simulator, target: Target, without: Array, with_all: Array) -> Closing:
    """What unknowns `with_all` (size,) close beside those `without` (size,) of the one record of a target."""
    (measured,) = target.measurements
    signals = [simulator.channels(p, measured) for p in (without, with_all)]
    return replace(closing_of(target, *signals), record=measured.name)

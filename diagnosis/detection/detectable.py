"""The smallest size of every effect that the records at hand would have named: what a verdict without it says.

The information is that of the last fit, about the rig that was found and with what that rig leaves of every block in
its floor; the judged record's derivatives are made for it. No unbiased reading is surer than its inverse (Cramer 1946,
Rao 1945), and an effect below these sizes is hidden by noise, by the rig's other unknowns, or by what a good rig has.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.detection.information import Blocks, Known
from gearbench.diagnosis.detection.opened import Changed, backlashes, smallest_backlash
from gearbench.diagnosis.detection.smallest import View
from gearbench.diagnosis.detection.stated import Sizes, sizes_of
from gearbench.diagnosis.effects.backlash import BACKLASH, KEY
from gearbench.diagnosis.effects.effect import SIDES, Hypothesis
from gearbench.diagnosis.effects.library import hypotheses as library
from gearbench.diagnosis.effects.profile_error import FLANKS, uneven
from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.selection.followable import nudges_of, parts
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.selection.weighing import Weighed
from gearbench.diagnosis.simulation.quadratic import quadratic_of
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import target_of
from gearbench.diagnosis.verdict import Detectable, Smallest

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Part of the nominal gap, by energy, from which an effect is plain to see whatever these records were expected to tell.
PLAIN = 0.01


def detectable_of(
    problem: Problem, judged: Judged, searched: Sequence[Measurement], without: Sequence[str] = ()
) -> tuple[Detectable, ...]:
    """What the records `searched` and the judged one would have shown of every effect of the library but those left
    out; nothing where the rig found does not answer the judged record."""
    found, simulator = judged.found, _answering(problem, judged)
    answer = _answer(found, simulator)
    if answer is None:
        return ()
    measured = ("driver", "driven", *judged.measured.periods)
    listed = [one for one in library(problem.model, without) if one.wide[0].key not in (CRACK, KEY)]
    listed = [one for one in listed if all(name in measured for name in one.on)]
    told = _by_information(judged, simulator, [*listed, *_cracks(problem, found, without)], *answer)
    out = [_told(one, sizes) for one, sizes in told]
    if BACKLASH.name not in without:
        out.append(_backlash(problem, Changed(simulator, found.selection.best.p, answer[1]), searched, found))
    return tuple(out)


def too_small(problem: Problem, judged: Judged, named: Sequence[Weighed]) -> Weighed | None:
    """Of the named effects that are no plain part of the gap, the one furthest below the size from which these records
    would name it; None without any. What speaks for such an effect is something else that looks like it: of that size
    it would not have been found."""
    slight = [one for one in named if one.effect is not BACKLASH and judged.share_of(one.hypothesis) < PLAIN]
    if not slight:
        return None
    found, simulator = judged.found, _answering(problem, judged)
    answer = _answer(found, simulator)
    if answer is None:
        return None
    unknowns, p, parts = found.layout.unknowns, found.selection.best.p, dict[str, float]()
    for one, sizes in _by_information(judged, simulator, [one.hypothesis for one in slight], *answer):
        parts[one.name] = _size_of(one, unknowns, p) / (np.inf if sizes.found is None else sizes.found)
    small = [one for one in slight if parts.get(one.hypothesis.name, 1.0) < 1.0]
    return min(small, key=lambda one: parts[one.hypothesis.name], default=None)


def _size_of(one: Hypothesis, unknowns: Unknowns, p: Array) -> float:
    """Rms of its unknowns, of all (size,), in standard deviations of the wide prior; teeth or flanks that all stand out
    alike are even."""
    p, wide, out = uneven(unknowns, p), one.prior(unknowns), []
    for part in one.wide:
        at = part.entries(unknowns)
        values = p[at] / wide[at]
        alike = len(values) > len(SIDES) and part.key != FLANKS
        out.append(values - values.mean() if alike else values)
    return float(np.sqrt(np.mean(np.concatenate(out) ** 2)))


def _answer(found: Simulated, simulator: Simulator) -> tuple[Complex, Array] | None:
    """What the rig found leaves of the judged record's lines (K,), and floors (blocks,) that hold it; None where it
    does not answer."""
    target = simulator.target
    lines = simulator.lines(found.selection.best.p)
    if lines is None:
        return None
    residual = target.lines - lines
    return residual, target.floors + target.energies(residual)


def _answering(problem: Problem, judged: Judged) -> Simulator:
    """What simulates the judged record's lines as the search does its own, kept on its way where the rig goes another.
    It takes the name of the first record of the search, for whose condition the ripple has unknowns."""
    found, measured = judged.found, judged.measured
    assert judged.target is not None
    alike = replace(measured, name=found.simulator.target.measurements[0].name)
    nudges: Mapping[str, float] = {}
    if judged.kept is not None:
        nudges = nudges_of(problem.model, [prepare(alike, problem.model, problem.conditions[0].band)])
    elif measured.name in found.simulator.nudges:
        nudges = {alike.name: found.simulator.nudges[measured.name]}
    target = replace(judged.target, measurements=(alike,))
    return Simulator(found.layout, target, found.simulator.simulate, nudges)


def _cracks(problem: Problem, found: Simulated, without: Sequence[str]) -> list[Hypothesis]:
    """One cracked tooth of each gear, of those that have unknowns."""
    first: dict[str, Hypothesis] = {}
    for one in library(problem.model, without):
        if one.wide[0].key == CRACK and one.wide[0].at in found.layout.teeth:
            first.setdefault(one.on[0], one)
    return list(first.values())


def _by_information(
    judged: Judged, simulator: Simulator, hypotheses: Sequence[Hypothesis], residual: Complex, left: Array
) -> list[tuple[Hypothesis, Sizes]]:
    """Of effects whose traces grow with them."""
    found = judged.found
    unknowns, best, base = found.layout.unknowns, found.selection.best, found.selection.base
    search = best.sensitivity.quadratic
    chosen = np.isin(np.arange(unknowns.size), search.active)
    jacobian = simulator.jacobian(best.p, unknowns.prior(), chosen)
    if jacobian is None:
        return []
    there = quadratic_of(replace(simulator.target, floors=left), residual, jacobian, search.active)
    apart = not found.simulator.target.has(judged.measured)
    out = []
    for one in hypotheses:
        # Beside what is named, but not beside itself.
        narrow, at = best.sd.copy(), one.entries(unknowns)
        narrow[at] = base.sd[at]
        view = View(Known(unknowns, search.active, narrow, Blocks(search), Blocks(there), apart), (one,))
        out.append((one, sizes_of(found.layout, view, 0)))
    return out


def _told(one: Hypothesis, sizes: Sizes) -> Detectable:
    assert one.effect is not None
    parameters = {
        told.name: Smallest(
            value=None if sizes.found is None else told.value, std=told.std, good=good.value, unit=told.unit
        )
        for told, good in zip(sizes.stated, sizes.good, strict=True)
    }
    return Detectable(name=one.effect.name, place=one.place, on=one.on, parameters=parameters)


def _backlash(problem: Problem, judged: Changed, searched: Sequence[Measurement], found: Simulated) -> Detectable:
    """Of the backlash, which no record shows whose flanks stay together."""
    simulator, group = found.simulator, found.layout.unknowns.group(KEY)
    (one,) = BACKLASH.hypotheses(problem.model)
    rig, band = found.layout.case(judged.p), problem.conditions[0].band
    rough = [measured for measured in searched if parts(rig, measured, simulator.simulate)]
    shown = None
    if rough:
        target = target_of(rough, [prepare(measured, problem.model, band) for measured in rough])
        alone = Simulator(found.layout, target, simulator.simulate, simulator.nudges)
        lines = alone.lines(judged.p)
        if lines is not None:
            left = target.floors + target.energies(target.lines - lines)
            shown = smallest_backlash(Changed(alone, judged.p, left), judged)
    sizes = backlashes(group, shown)
    more = Smallest(value=sizes.found, std=sizes.std, good=sizes.good, unit="um")
    return Detectable(name=BACKLASH.name, place=one.place, on=one.on, parameters={"more": more})

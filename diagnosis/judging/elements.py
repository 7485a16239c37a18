"""What was found, answered by the reduced finite-element model: fitted again there, and judged by the same rule.

The optimum of the lumped model has taken in what that model lacks of elements: bodies that shear, contact off the line
of action. So the rig without effects and the one with them each go on from their optimum, on the records of the search,
simulated by finite elements. Steps come from the lumped model's Jacobian: it only has to point downhill, as each step
is simulated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.replays.carried import Carried, on_elements
from gearbench.diagnosis.effects.backlash import KEY as BACKLASH
from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.fitting.fit import Optimum, Sensitivity, fit
from gearbench.diagnosis.intake.signals import simulated_channels
from gearbench.diagnosis.judging.closing import Closing, closing_of
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.replay.replays import Replay
from gearbench.diagnosis.simulation.quadratic import quadratic_of
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.structure.viscous import LOADED
from gearbench.rig import Case

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Report = Callable[[str], None]

# Unknowns that stay as they are: the elements lack the first; the others change teeth, which would be meshed anew at
# every step.
HELD = (LOADED, BACKLASH, CRACK)


@dataclass(frozen=True)
class ByElements:
    """What finite elements answer on the judged record: the rigs of the stages "nominal", "recalibrated" and, where an
    effect is named, "with_effect", with their channels (channel -> (N,)); what each named effect closes, by its
    hypothesis' name; the optimum with all of them, None where none is named; keys that the elements lack, and sentences
    on what they have in another form."""

    stages: Mapping[str, Case]
    signals: Mapping[str, Mapping[str, Array]]
    closings: Mapping[str, Closing] = field(default_factory=dict)
    optimum: Optimum | None = None
    lacks: tuple[str, ...] = ()
    said: tuple[str, ...] = ()


def by_elements(judged: Judged, effects: bool, report: Report) -> ByElements:
    """The judged record answered by finite elements; `effects`: whether the verdict names any. Raises ValueError, one
    sentence, for a rig that they cannot answer."""
    found, selection = judged.found, judged.found.selection
    named = [one.hypothesis.name for one in selection.entered] if effects else []
    carried: dict[str, Carried] = {}
    target = found.simulator.target
    # Elements cannot be nudged: the records that they can follow are those that hold the rig.
    held_by, simulate = found.simulator.smooth, _simulate(found.layout.model.resonance, carried)
    elements, lines = Simulator(found.layout, target.of_records(held_by), simulate), target.in_records(held_by)
    open_teeth = any(one.hypothesis.wide[0].key == BACKLASH for one in selection.entered)

    def answered(p: Array) -> tuple[Case, Mapping[str, Array]]:
        case = found.layout.case(p, judged.measured.name)
        return case, simulated_channels(judged.measured, elements.simulate(case, judged.measured.record))

    def again(optimum: Optimum, words: str) -> Optimum:
        report(f"by finite elements: {words}")
        return refitted(elements, optimum, open_teeth, lines)

    report("by finite elements: the nominal rig")
    vectors = {"nominal": np.zeros(found.layout.size)}
    plain = selection.bare if named else selection.base
    vectors["recalibrated"] = again(plain, "the recalibrated rig").p
    best = again(selection.best, "with what was found") if named else None
    if best is not None:
        vectors["with_effect"] = best.p
    answers = {stage: answered(p) for stage, p in vectors.items()}
    closings = {}
    for name in named:
        optimum = judged.closings[name].optimum
        assert optimum is not None and judged.target is not None
        without = answered(again(optimum, f"without {name}").p)[1]
        closings[name] = closing_of(judged.target, without, answers["with_effect"][1])
    lacks = tuple(dict.fromkeys(key for one in carried.values() for key in one.lacks))
    said = tuple(dict.fromkeys(word for one in carried.values() for word in one.said))
    signals = {stage: shown for stage, (_, shown) in answers.items()}
    return ByElements({stage: case for stage, (case, _) in answers.items()}, signals, closings, best, lacks, said)


def _simulate(resonance: float, carried: dict[str, Carried]) -> Replay:
    """Replays by finite elements, which nothing nudges; what it carried over is put into `carried`."""
    # Its time loop is compiled on import, which not every user of this module wants.
    from gearbench.bench.replays.reduced import replay

    def simulate(case: Case, record: xr.Dataset, /, nudge: float = 0.0) -> xr.Dataset:
        if nudge:
            raise ValueError("finite elements cannot be nudged towards a record")
        one = on_elements(case, resonance)
        carried["; ".join((*one.lacks, *one.said))] = one
        return replay(one.case, record)

    return simulate


def refitted(elements: Simulator, optimum: Optimum, open_teeth: bool, lines: Flags | slice = slice(None)) -> Optimum:
    """The optimum by finite elements near that of the lumped model, of whose lines (K,) they are fitted to some; where
    none of its steps comes closer, itself."""
    unknowns, target = elements.layout.unknowns, elements.target
    p, sd = optimum.p.copy(), optimum.sd.copy()
    for key in HELD:
        if key in unknowns.slices:
            sd[unknowns[key]] = 0.0
            # What flanks that stay together never show is left at the nominal teeth.
            if key == LOADED or (key == BACKLASH and not open_teeth):
                p[unknowns[key]] = 0.0
    here = elements.lines(p)
    if here is None:
        raise ValueError("finite elements cannot answer the records of the search with what the lumped model found")
    jacobian = optimum.sensitivity.jacobian[:, lines]
    active = np.flatnonzero(np.abs(jacobian).max(axis=1) > 0.0)
    near = Sensitivity(jacobian, quadratic_of(target, target.lines - here, jacobian, active))
    better = fit(elements, p, sd, near)
    return better if better is not None else replace(optimum, p=p, sd=sd)

"""Selection held against the record that had no part in it: what each effect closes there.

Every effect that entered is taken out alone, the rig, its structure and the other effects that entered are fitted
again on the records of the search, and both rigs answer the judged record. An effect is kept if the record is more
likely with it, and if its gap grows by a tenth or more without it in some part that can be told apart: a channel in one
band, or in one kind of line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.judging.closing import DUE, GAIN, Closing, both, closing_of, energy_of, feels, free_closing
from gearbench.diagnosis.selection.followable import nudges_of, parts
from gearbench.diagnosis.selection.selection import further, only, taken_out
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.selection.weighing import Weighed, is_own
from gearbench.diagnosis.simulation.passed_noise import noise_left
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import FITTED, Target, target_of

Array = NDArray[np.float64]
Report = Callable[[str], None]

# Of the nominal gap, rms over rms and all channels in units of their own fluctuation: more than this part left is "the
# greater part".
GREATER = 0.5


@dataclass(frozen=True)
class Judged:
    """A selection on the judged record `measured`: `found` with the effects that are kept, what each closes by its
    hypothesis' name, the signals (channel -> (N,)) of the nominal rig, of the one without any of them and with all of
    them, what was entered but closes nothing, the lines of that record, and by channel the parts of its noise."""

    measured: Measurement
    found: Simulated
    closings: Mapping[str, Closing]
    nominal: Mapping[str, Array]
    plain: Mapping[str, Array]
    signals: Mapping[str, Array]
    dropped: tuple[Weighed, ...] = ()
    target: Target | None = None
    noise: Mapping[str, Array] = field(default_factory=dict)

    @cached_property
    def sizes(self) -> dict[str, Sizes]:
        """Rms values by channel."""
        out = {}
        for channel, repetitions in measured_channels(self.measured).items():
            if channel not in FITTED or channel not in self.signals:
                continue
            mean = repetitions.mean(axis=0)
            noise = self._rms(self.noise[channel]) if channel in self.noise else 0.0
            nominal, plain, final = (self._rms(mean - one[channel]) for one in (self.nominal, self.plain, self.signals))
            out[channel] = Sizes(self._rms(mean), nominal, plain, final, noise)
        return out

    def _rms(self, values: Array) -> float:
        """Rms of a signal (N,), or of parts (parts, N) that add up by their squares, up to the highest line that the
        search sees: beyond the excitation nothing determines the rig."""
        return max(float(np.sqrt(sum(energy_of(one)[: self._top].sum() for one in np.atleast_2d(values)))), 1e-300)

    @cached_property
    def _top(self) -> int | None:
        """The highest line that the search sees; None: all."""
        return max((int(bins.max()) for _, _, bins in self.target.plan), default=None) if self.target else None

    @property
    def left(self) -> float:
        """Rms of what is left of the nominal gap, over it, all channels in units of their own fluctuation, beyond
        noise."""
        gap = left = 0.0
        for one in self.sizes.values():
            gap += max(one.nominal**2 - one.noise**2, 0.0) / one.fluctuation**2
            left += max(one.final**2 - one.noise**2, 0.0) / one.fluctuation**2
        return float(np.sqrt(left / gap)) if gap > 0.0 else 0.0

    @property
    def remains(self) -> float:
        """The largest part of any channel's fluctuation that is left beyond noise."""
        return max(self._remaining.values(), default=0.0)

    @property
    def _remaining(self) -> dict[str, float]:
        """By channel the part of its fluctuation that is left beyond noise."""
        return {
            channel: float(np.sqrt(max(one.final**2 - one.noise**2, 0.0)) / one.fluctuation)
            for channel, one in self.sizes.items()
        }

    @property
    def searched(self) -> float:
        """The same on the records that the selection was found from, whose channels are taken together."""
        return max((left for left, _ in self._searched.values()), default=0.0)

    @property
    def hidden(self) -> float:
        """The largest part of any channel's fluctuation that is left here and that the records of the search could not
        have told from what changes in them."""
        pairs = ((self._remaining.get(channel, 0.0), noise) for channel, (_, noise) in self._searched.items())
        return max((min(pair) for pair in pairs), default=0.0)

    @cached_property
    def _searched(self) -> dict[str, tuple[float, float]]:
        """By channel of the records of the search, all together: parts of its fluctuation that are left beyond noise,
        and that are noise."""
        simulator, best = self.found.simulator, self.found.selection.best
        own = None if simulator.anchored else simulator.free.lines(self.found.end_of(best))
        lines = best.lines if own is None else own
        target = simulator.target
        shares = zip(*target.shares(target.lines - lines), strict=True)
        return {block.channel: (float(a), float(b)) for block, (a, b) in zip(target.blocks, shares, strict=True)}

    def share(self, without: Mapping[str, Array]) -> float:
        """Part of the nominal gap, by energy and all channels in units of their fluctuation, that comes back in a rig
        with those signals."""
        gap = back = 0.0
        for channel, one in self.sizes.items():
            gap += max(one.nominal**2 - one.noise**2, 0.0) / one.fluctuation**2
            back += (self.rms_left(channel, without) ** 2 - one.final**2) / one.fluctuation**2
        return float(np.clip(back / gap, 0.0, 1.0)) if gap > 0.0 else 0.0

    def rms_left(self, channel: str, signals: Mapping[str, Array]) -> float:
        """Rms that a rig with those signals leaves of a measured channel."""
        return self._rms(measured_channels(self.measured)[channel].mean(axis=0) - signals[channel])

    def grown(self, without: Mapping[str, Array]) -> float:
        """Factor by which all that is left grows in a rig with those signals, rms over rms."""
        return float(np.sqrt(1.0 + self.share(without) / max(self.left, 1e-300) ** 2))


@dataclass(frozen=True)
class Sizes:
    """Rms of one channel on the judged record, without means, up to the end of the excitation: its own, of the gap of
    the nominal rig, of the one without any effect and of the final one, and of the noise."""

    fluctuation: float
    nominal: float
    plain: float
    final: float
    noise: float


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
    target = target_of([measured], [condition], [noise])
    if is_nudged(found, measured):
        nudges = {**found.simulator.nudges, **nudges_of(problem.model, [condition])}
        found = replace(found, simulator=replace(found.simulator, nudges=nudges))
    fitted = found.simulator.target.measurements
    rough = [one for one in searched if not any(one is own for own in found.simulator.held_by)]
    parted = [target_of([one], [prepare(one, problem.model, band)]) for one in rough]
    dropped: list[Weighed] = []
    seen: set[frozenset[str]] = set()
    # A record that had part in the search cannot make up for what it lacked.
    apart = not any(measured is searched for searched in fitted)
    while True:
        seen.add(_names(found.selection.entered))
        try:
            judged = _closings(found, target, measured, parted, noise, apart=apart)
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


def _names(entered: Sequence[Weighed]) -> frozenset[str]:
    return frozenset(one.hypothesis.name for one in entered)


def _stays(judged: Judged, one: Weighed) -> bool:
    """Whether an effect is due; weak evidence is nothing to go by where the greater part is not explained. A number of
    the nominal rig, which recalibration moves anyway, must make a difference to the whole: some part of it is closer by
    what else it makes up for."""
    closing, unknowns = judged.closings[one.hypothesis.name], judged.found.layout.unknowns
    own = any(is_own(unknowns, wide) for wide in one.hypothesis.wide)
    if not own and judged.grown(closing.without) < DUE:
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
    *,
    apart: bool,
) -> Judged:
    simulator, selection = found.simulator, found.selection
    nudged = simulator.channels(selection.best.p, measured)
    # Sizes are those of simulations that go their own way.
    free = simulator.free
    signals = nudged if free is simulator else free.channels(found.end_of(selection.best), measured)
    closings = {}
    for one in selection.entered:
        optimum = taken_out(simulator, selection, one)
        closing = closing_of(target, simulator.channels(optimum.p, measured), nudged)
        silent = not feels(target, closing.without, nudged)
        if not simulator.anchored or (simulator.nudges and measured.name in simulator.nudges):
            # Alone, an effect must do better than the rig that was found without any, too.
            others = [optimum, selection.bare] if len(selection.entered) == 1 else [optimum]
            without = [free.channels(found.end_of(other), measured) for other in others]
            closing = both(closing, *(free_closing(target, one, signals) for one in without))
        lacking = inf if one.lacking and not apart else one.lacking
        silent = silent or (not closing.due and closing.gain > -GAIN)
        if parted and not one.lacking and silent:
            told = [_closing_there(simulator, there, optimum.p, selection.best.p) for there in parted]
            closing = replace(max(told, key=lambda there: there.gain), without=closing.without)
        closings[one.hypothesis.name] = replace(closing, optimum=optimum, lacking=lacking)
    nothing = np.zeros(simulator.layout.size)
    nominal, plain = (free.channels(p, measured) for p in (nothing, found.end_of(selection.bare)))
    return Judged(measured, found, closings, nominal, plain, signals, target=target, noise=noise)


def _closing_there(simulator: Simulator, target: Target, without: Array, with_all: Array) -> Closing:
    """What unknowns `with_all` (size,) close beside those `without` (size,) of the one record of a target."""
    (measured,) = target.measurements
    signals = [simulator.channels(p, measured) for p in (without, with_all)]
    return replace(closing_of(target, *signals), record=measured.name)

"""The verdict that simulation justifies: the effects that entered, none, or unknown at a place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.mesh_damping import MESH_DAMPING
from gearbench.diagnosis.evidence.calibration import LIMITS, Limits
from gearbench.diagnosis.evidence.decision import Decision, at_place, worst
from gearbench.diagnosis.evidence.search import Search, told
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.steadiness import Unsteady
from gearbench.diagnosis.judging.judged import GREATER, Judged
from gearbench.diagnosis.odds import Calibration, unknown_signs
from gearbench.diagnosis.population import POPULATION
from gearbench.diagnosis.remainder.drift import EXPLAINS, Drift
from gearbench.diagnosis.remainder.free_forces import Form, FreeForce
from gearbench.diagnosis.remainder.missing import Missing
from gearbench.diagnosis.selection.needed import size_of
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.selection.weighing import Weighed
from gearbench.diagnosis.structure.structure import lag_of_drive
from gearbench.diagnosis.verdict import Outcome
from gearbench.diagnosis.words import CHANNELS, percent
from gearbench.rig.contract import Place

Array = NDArray[np.float64]

# Of what sound rigs leave of a channel's fluctuation at most: from there on a place can stand out. Of 85 drawn sound
# rigs one, whose records all rattle, does so by more than 0.7 of both this and the limits of its place.
VISIBLE = 0.3
# The same from which something is unknown whatever part of the gap it is: no rig without it is found that far off.
PLAIN = 1.5
# Noise of the search's records, of a channel's fluctuation, from which they do not speak of what is left elsewhere.
HIDING = 0.2
# Part of the nominal gap that the named effects must close for content that changes, or a form without a name, not to
# outbid them; the former does not either where they close so many times its energy.
CLOSES, OUTWEIGHS = 0.5, 3.0
# Of the place that stands out most, what the next one may reach for it to be told, and over what sound rigs leave, what
# it must reach itself.
TOLD, FAINT = 0.5, 0.2
# Nats that a force without a name is worth beside the final rig from which it is one, its least rms over the linear
# force at its place, and how far it may go against that: no damper drives.
FREE, LEAST_FREE, AGAINST = 15.0, 0.05, -1.0
# Effects that stand for the linear part of a force without a name, as far as that has one.
LINEAR = {Form("damper", "mesh"): MESH_DAMPING.name}
# Probability from which something unknown is said to be at work.
EVEN = 0.5
# Over what sound rigs have: a lag of the drive's torque from which something is between its sensor and the rotor.
LATE_LIMIT = 3.0


@dataclass(frozen=True)
class Decided:
    """`verdict` effects, none or unknown; `place`; what is named (effects only); the largest `sign` of something
    unknown over its limit; `because` says in sentences what decided; `drift`: what is named of what changes between
    repetitions (effects only)."""

    verdict: Outcome
    place: Place
    named: tuple[Weighed, ...]
    sign: float
    because: tuple[str, ...]
    drift: Drift | None = None


def decide_simulated(
    judged: Judged,
    forces: Search,
    missing: Missing,
    unsteady: Unsteady,
    changing: float,
    limits: Limits = LIMITS,
    known: Calibration = POPULATION,
    drift: Drift | None = None,
    free: Sequence[FreeForce] = (),
) -> Decided:
    """The decision on what was kept on the judged record. `missing` are the forces that the final rig lacks; `unsteady`
    the excess scatter between repetitions, by place, and `changing` the largest rms of what changes over that of the
    nominal gap, `drift` what explains most of it; `known`: what sound rigs leave; `free`: what forces without a name
    are worth beside the final rig."""
    all_told = _Told(judged, forces, missing, limits, known, tuple(free))
    _, over = unsteady.worst(limits.unsteady)
    # `changing` is more than nothing where what is left grows by it, whatever part of the nominal gap that is.
    large = drift is not None and changing > (0.0 if drift.beyond_sound else known.changing)
    # As of what changes (`remainder.changing_place`): where flanks part in all records, forces must see it, too.
    seen = over > 1.0 or (drift is not None and drift.shown and judged.found.simulator.anchored)
    if drift is None or not large or not seen:
        return _decided(all_told, unsteady, changing)
    # What a drift explains speaks neither for something unknown nor against an effect; what it does not, does.
    rest = _decided(all_told, Unsteady.nothing() if drift.share > EXPLAINS else unsteady, changing)
    said = (
        f"{percent(drift.share)} of the energy of what changes from one repetition to the next is what a stiffness"
        f" {at_place(drift.place)} makes that changes by {percent(drift.value)} over a record"
    )
    if drift.share < EXPLAINS:
        said += ", with which each channel of each record repeats better"
    if rest.verdict == "unknown":
        return replace(rest, because=(*rest.because, said))
    place = rest.place if rest.named else drift.place
    because = (*(rest.because if rest.named else ()), said)
    return replace(rest, verdict="effects", place=place, because=because, drift=drift)


class _Told(NamedTuple):
    """What a decision rests on, without what changes between repetitions."""

    judged: Judged
    forces: Search
    missing: Missing
    limits: Limits
    known: Calibration
    free: tuple[FreeForce, ...]

    @property
    def unnamed(self) -> FreeForce | None:
        """The force without a name that is worth most, if it is larger than a sound rig's: what is worth less stands in
        for that, at another place."""
        most = max(self.free, key=lambda one: one.worth, default=None)
        return most if most is not None and abs(most.size) > LEAST_FREE and most.size >= AGAINST else None

    @property
    def clear(self) -> FreeForce | None:
        """The same, if it is one that no sound rig has."""
        return self.unnamed if self.alone > 1.0 else None

    @property
    def alone(self) -> float:
        """What it is worth, over what those of sound rigs are."""
        return self.unnamed.worth / FREE if self.unnamed is not None else 0.0


def _decided(of: _Told, unsteady: Unsteady, changing: float) -> Decided:
    """The decision without a drift."""
    judged, missing, limits, known = of.judged, of.missing, of.limits, of.known
    named = judged.found.selection.entered
    shares = [judged.share_of(one.hypothesis) for one in named]
    share = max(shares, default=0.0)
    place, over = unsteady.worst(limits.unsteady)
    aside = (_changes(place, changing),) if over > 1.0 else ()
    if over > 1.0 and changing > known.changing and share < min(CLOSES, OUTWEIGHS * changing**2):
        because = f"the force missing {at_place(place)} changes from one repetition to the next"
        return Decided("unknown", place, (), changing / known.changing, (because,))
    left = _left_of(judged, missing, known)
    if not named:
        made = _without(of, left)
        return replace(made, because=(*made.because, *aside)) if made.verdict == "none" else made
    doubt = _linearly(of, named, left) or (_outbid(of, named, left) if share < CLOSES else None)
    if doubt is not None:
        return doubt
    if judged.left > 1.0 and left.size > 1.0:
        return Decided("unknown", _leading(missing), (), left.sign, (_astray(judged, named),))
    if sum(shares) < judged.left**2:
        if left.seen > 1.0:
            return Decided("unknown", _leading(missing), (), left.sign, (_made_up(missing, named),))
        if left.shown > PLAIN:
            return Decided("unknown", _leading(missing), (), left.sign, (_drowned(judged, named, known),))
    it = "it" if len(named) == 1 else "them"
    because = f"simulated with {it}, the rig comes closer to the records than any rig without an effect"
    beside = (_beside(of.clear),) if of.clear else ()
    return Decided("effects", named[0].hypothesis.place, named, left.sign, (because, *beside, *aside))


class _Left(NamedTuple):
    """What is left over what sound rigs leave: `size` of the largest part of a channel's fluctuation, as far as both
    judged record and search show it or the latter's noise hides it; `shown`, the same but for what is hidden; `seen`:
    at the place that stands out, as far as a remainder is there to be seen; `sign`, the largest, each over its
    limit."""

    size: float
    shown: float
    seen: float
    sign: float


def _left_of(judged: Judged, missing: Missing, known: Calibration) -> _Left:
    # A record that had no part in the search may be off because the others do not determine the rig; what their noise
    # hides they do not speak of.
    shown = min(judged.remains, judged.searched) / known.structure
    size = max(shown, judged.hidden / HIDING)
    seen = min(outstanding(missing)[1], size / VISIBLE)
    return _Left(size, shown, seen, max(min(judged.left / GREATER, size), seen, shown / PLAIN))


def _linearly(of: _Told, named: tuple[Weighed, ...], left: _Left) -> Decided | None:
    """What a force without a name says of which the only effect that is named would be the linear part: where the law
    is another one, its number may only make up for that."""
    clear = of.clear
    if clear is None or [one.effect.name for one in named] != [LINEAR.get(clear.form)]:
        return None
    because = f"{_better(clear)}: {_nouns(named)} may only make up for it"
    return Decided("unknown", clear.form.place, (), max(left.sign, of.alone), (because,))


def _outbid(of: _Told, named: tuple[Weighed, ...], left: _Left) -> Decided | None:
    """What a form without a name that explains the records clearly better than what is named says: beside that, or by
    the force residuals where more is left than sound rigs leave. These know no structure: where the rig found says
    whence what it lacks acts, it is there."""
    worth = max(one.log_bayes_factor for one in named)
    unnamed, free = of.unnamed, of.forces.best_free

    def needed(by: float) -> float:
        return of.limits.competitor_factor * by + of.limits.competitor_offset

    if unnamed is not None and unnamed.worth > needed(worth):
        return _explained(unnamed, unnamed.worth / needed(worth))
    by_force = needed(max(worth, _by_force(of.forces, named)))
    if left.size <= 1.0 or not free or free.log_bayes_factor <= by_force:
        return None
    formed, leading = free.hypothesis.place, _leading(of.missing)
    place = formed if leading == "none" else leading
    because = f"a force {at_place(formed)} without any given form explains the records clearly better"
    if place != formed:
        because += f", but what the rig found lacks stands out {at_place(place)}"
    return Decided("unknown", place, (), free.log_bayes_factor / by_force, (because,))


def _explained(by: FreeForce, sign: float) -> Decided:
    """The decision for a force without a name."""
    better = f"{by.form.words} explains the records clearly better ({_worth_of(by)})"
    because = f"{better}, and no effect of the library is such"
    return Decided("unknown", by.form.place, (), sign, (because,))


def _beside(more: FreeForce) -> str:
    """That something without a name is at work besides."""
    return f"{_better(more)}: something else may be at work besides"


def _better(more: FreeForce) -> str:
    """What it explains beside what is named."""
    return f"{more.form.words} explains what is left clearly better ({_worth_of(more)})"


def _worth_of(one: FreeForce) -> str:
    """What it is worth and how large it is."""
    return f"{one.worth:.3g} nats, {percent(abs(one.size))} of the linear force there"


def _without(of: _Told, left: _Left) -> Decided:
    """The decision where no effect is named."""
    judged, missing, known, clear = of.judged, of.missing, of.known, of.clear
    leading = _leading(missing)
    if leading == "none" and clear:
        leading = clear.form.place
    if left.size > 1.0 and judged.left > GREATER:
        because = "no effect of the library closes the gap, and the greater part of it stays"
        # So large a remainder acts somewhere, though no place leaves more than sound rigs do.
        most, over = outstanding(missing)
        return Decided("unknown", most if leading == "none" and over > FAINT else leading, (), left.sign, (because,))
    if left.shown > PLAIN:
        channel, _ = judged.most_left
        because = (
            f"{percent(left.shown * known.structure)} of the {CHANNELS[channel]} stays, where sound rigs leave"
            f" {percent(known.structure)} of a channel's fluctuation at most, and no effect of the library explains it"
        )
        return Decided("unknown", leading, (), left.sign, (because,))
    if left.seen > 1.0:
        place, _ = outstanding(missing)
        because = f"a force {at_place(place)} remains that no effect of the library explains"
        return Decided("unknown", place, (), left.sign, (because,))
    late, sound = lag_of_drive(judged.found.layout.unknowns, judged.found.selection.best.p)
    if abs(late) > LATE_LIMIT * sound:
        return Decided("unknown", "drive", (), max(left.sign, abs(late) / (LATE_LIMIT * sound)), (_late(late),))
    if clear:
        return _explained(clear, max(left.sign, of.alone))
    # Below every limit a sign counts no more than the transmission error shows of it.
    sign = min(max(left.sign, of.alone), judged.beyond_noise)
    likely = known.unknown.of(unknown_signs(sign)).value
    if likely > EVEN:
        return Decided("unknown", leading, (), sign, (_likelier(leading, likely),))
    return Decided("none", "none", (), sign, (_nothing(judged, known),))


def _likelier(place: Place, likely: float) -> str:
    """That something unknown is likelier than not though no single sign of it passes its limit."""
    force = "what remains" if place == "none" else f"the force {at_place(place)} that remains"
    return (
        f"{force} is within the limits of sound rigs, but as large as few of them leave it: something that the library"
        f" lacks is likelier at work than not ({percent(likely)})"
    )


def _nothing(judged: Judged, known: Calibration) -> str:
    """Why no effect is needed, and what remains all the same."""
    because = "no effect brings the simulation closer to the records than a good rig's share of it; "
    kept = "" if judged.kept is None else ", kept on the record's way"
    if judged.searched <= known.structure < judged.remains:
        return because + (
            f"it explains the records of the search to {percent(judged.searched)} of any channel's fluctuation: that"
            f" the judged one is off by {percent(judged.remains)} says that they do not determine the rig"
        )
    sound = f"within the {percent(known.structure)} that sound rigs leave"
    small = judged.remains <= known.structure
    return because + (
        f"what remains{kept}, at most {percent(judged.remains)} of any channel's fluctuation, is"
        f" {sound if small else 'the smaller part of the gap'}"
    )


def _nouns(named: tuple[Weighed, ...]) -> str:
    return " and ".join(one.effect.noun for one in named)


def _made_up(missing: Missing, named: tuple[Weighed, ...]) -> str:
    """That what was found closes less of the gap than what stays, at a place that stands out."""
    place, _ = outstanding(missing)
    return (
        f"a force {at_place(place)} remains that no effect of the library explains, and more of the gap with it than"
        f" {_nouns(named)} would close, which may only make up for it"
    )


def _drowned(judged: Judged, named: tuple[Weighed, ...], known: Calibration) -> str:
    """That what was found closes less of the gap than what stays of a channel, at no place that stands out."""
    channel, part = judged.most_left
    return (
        f"{percent(part)} of the {CHANNELS[channel]} is left, where sound rigs leave {percent(known.structure)} of a"
        f" channel's fluctuation at most, and of the gap more than {_nouns(named)} would close, which may only make up"
        " for something unknown"
    )


def _astray(judged: Judged, named: tuple[Weighed, ...]) -> str:
    """That the rig that was found with effects is further from the judged record than the nominal one."""
    return (
        f"the rig that was found, with {_nouns(named)}, leaves {percent(judged.left)} of the nominal rig's gap in"
        " the judged record, more than there was: what the records of the search say does not hold there"
    )


def _late(late: float) -> str:
    """That the drive's torque does not act when it is measured."""
    return (
        f"the torque of the drive acts {abs(late) * 1e6:.3g} us {'after' if late > 0.0 else 'before'} its channel shows"
        " it, more than channels of one clock differ: a filter, or something that yields between its sensor and the"
        " rotor"
    )


def _changes(place: Place, changing: float) -> str:
    """That records change between repetitions where this is not the cause of the gap."""
    small = f"that is {percent(changing)} of the gap" if changing > 0.0 else "what is left hardly grows by it"
    return (
        f"the force missing {at_place(place)} changes from one repetition to the next, so that something drifts, but"
        f" {small}"
    )


def outstanding(missing: Missing) -> tuple[Place, float]:
    """The place at which most is missing over what sound rigs leave there, and that ratio."""
    most = int(np.argmax(missing.over))
    return PLACES[most], float(missing.over[most])


def _leading(missing: Missing) -> Place:
    """The place that stands out over what sound rigs leave, or does so far more than any other; none without one."""
    place, over = outstanding(missing)
    alone = over > FAINT and float(np.sort(missing.over)[-2]) < TOLD * over
    return place if over > 1.0 or alone else "none"


def size_needed(one: Weighed, limits: Limits) -> float:
    """Size, over that of a background, from which an effect is named."""
    return limits.size_of(one.effect)


def relative_size(found: Simulated, one: Weighed) -> float:
    """Rms of an effect's unknowns in standard deviations of the background, each by how much the records tell of it."""
    unknowns, best = found.layout.unknowns, found.selection.best
    at = one.hypothesis.entries(unknowns)
    return size_of(unknowns, one.hypothesis, best.p, told(found.std[at], best.sd[at]))


def _by_force(forces: Search, named: tuple[Weighed, ...]) -> float:
    """Most evidence that the force residuals have for what is named."""
    names = {one.effect.name for one in named}
    found = [
        one.log_bayes_factor for one in forces.tried if one.hypothesis.effect and one.hypothesis.effect.name in names
    ]
    return max(found, default=0.0)


def unexplained(decision: Decision, silent: Array, left: float, limits: Limits = LIMITS) -> Decision:
    """The decision of the force residuals alone, or unknown where it names nothing and the recalibrated rig leaves the
    greater part of the gap: `left` of it, rms over rms. Its place is that of the largest force that `silent`
    (equations + 1,) says is missing."""
    if decision.verdict != "none" or left <= GREATER:
        return decision
    place, _ = worst(silent, limits.silent)
    because = "the greater part of the gap stays, and no simulation can follow the records to find its cause"
    return Decision("unknown", place, None, max(decision.sign, left / GREATER), because)

"""What of the gap is explained and what remains: parts with sizes, places, and the sentences that say so."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.judging.closing import Closing
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.remainder.missing import Missing
from gearbench.diagnosis.verdict import Gap, Part, Range, Share
from gearbench.diagnosis.words import CHANNELS, SHOWN_UNITS, band_in_words, length, number, percent
from gearbench.diagnosis.words import PLACES as IN_WORDS
from gearbench.rig.contract import Place

Array = NDArray[np.float64]

# Kinds of lines.
LINES = {
    "operating": "at the mesh orders",
    "excited": "at the excited lines",
    "driver-shaft": "at the orders of the driver's shaft",
    "driven-shaft": "at the orders of the driven gear's shaft",
    "distorted": "at sums and differences of the excited lines",
    "other": "between the excited lines",
}
# Multiples of the noise floor below which nothing counts as left.
FLOORS = 2.0


def weights(missing: Missing) -> Array:
    """Parts (places,) that the places have in what remains, each by how far it stands out over what sound rigs leave
    there; they add up to one."""
    over = missing.over
    whole = float(over.sum())
    return over / whole if whole > 0.0 else np.full(len(PLACES), 1.0 / len(PLACES))


def place_in(missing: Missing, band: tuple[float, float]) -> Place:
    """Where most of what remains in a band arises."""
    inside, whole = missing.in_band(band) ** 2, (missing.force**2).sum(axis=0)
    part = weights(missing) * inside / np.maximum(whole, 1e-300)
    return PLACES[int(np.argmax(part))] if part.max() > 0.0 else "none"


def places_of(judged: Judged, named: Sequence[Hypothesis], missing: Missing) -> tuple[Share, ...]:
    """The gap beyond what recalibration closes, by place: what each named effect closes at its own, and what remains
    where its force is missing. Energies, all channels in units of their own fluctuation."""
    found = dict.fromkeys((*PLACES, "sensor"), 0.0)
    for one in named:
        found[one.place] += judged.share_of(one)
    for place, part in zip(PLACES, weights(missing), strict=True):
        found[place] += judged.left**2 * float(part)
    whole = sum(found.values())
    if whole <= 0.0:
        return ()
    return tuple(
        Share(kind="place", name=name, share=value / whole, floor=None)
        for name, value in found.items()
        if value > 0.0 or name != "sensor"
    )


def parts_of(
    gaps: Sequence[Gap], missing: Missing | None, places: Sequence[Place] = ()
) -> tuple[tuple[Part, ...], tuple[Part, ...]]:
    """Explained and remaining parts of the judged record, by channel and band; `places` are those of the named effects,
    the first one first. What remains below twice the noise is left out."""
    explained: list[Part] = []
    remaining: list[Part] = []
    whole = {gap.channel: gap.nominal.value**2 for gap in reversed(gaps) if gap.band_hz[1] > 0}
    for gap in gaps:
        if gap.band_hz[1] == 0.0 or whole.get(gap.channel, 0.0) <= 0.0:
            continue
        final, floor = gap.with_effect or gap.recalibrated, gap.floor.value if gap.floor else 0.0
        scale, unit = SHOWN_UNITS.get(gap.unit, (1.0, gap.unit))
        closed = Range(
            value=sqrt(max(gap.nominal.value**2 - final.value**2, 0.0)),
            low=sqrt(max(gap.nominal.low**2 - final.high**2, 0.0)),
            high=sqrt(max(gap.nominal.high**2 - final.low**2, 0.0)),
        )
        for size, out, place in (
            (closed, explained, places[0] if places else "none"),
            (final, remaining, place_in(missing, gap.band_hz) if missing else "none"),
        ):
            floors = size.value / floor if floor > 0.0 else None
            if size.value <= 0.0 or (out is remaining and floors is not None and floors < FLOORS):
                continue
            out.append(
                Part(
                    channel=gap.channel,
                    band_hz=gap.band_hz,
                    unit=unit,
                    place=place,
                    size=scale * size.value,
                    low=scale * size.low,
                    high=scale * size.high,
                    share=size.value**2 / whole[gap.channel],
                    floors=floors,
                )
            )
    return tuple(explained), (*remaining, *_forces(missing))


def _forces(missing: Missing | None) -> list[Part]:
    """The missing forces of the places that stand out, over the whole band."""
    if missing is None or not missing.bands:
        return []
    band = (missing.bands[0][0], missing.bands[-1][1])
    out = []
    share = weights(missing)
    for number_, place in enumerate(PLACES):
        size = float(missing.in_band(band)[number_])
        if missing.over[number_] > 1.0 and size > 0.0:
            out.append(
                Part(channel="force", band_hz=band, place=place, size=size, low=size, high=size, unit="N",
                     share=float(share[number_]))
            )  # fmt: skip
    return out


def sentence_of_effect(noun: str, closing: Closing, share: float) -> str:
    """What an effect closes of the judged record."""
    channel, part = closing.part
    where = CHANNELS.get(channel, channel)
    lines = LINES.get(part, f"at {part} Hz")
    if closing.record:
        return (
            f"Without {noun} the gap of the {where} {lines} is {number(closing.growth, 2)} times as large on record"
            f" {closing.record}, whose flanks part; the judged record does not feel it"
        )
    kept = "" if closing.own is None else ", kept on the record's way,"
    return (
        f"Without {noun} the gap of the {where} {lines}{kept} is {number(closing.growth, 2)} times as large; that is"
        f" {percent(share)} of the nominal rig's whole gap"
    )


def sentence_of_shares(nouns: Sequence[str], plain: float, final: float) -> str:
    """That a good rig's share of other effects closes as much of the transmission error: rms [m] that the rig leaves
    without what is named, and with it."""
    return (
        f"Recalibrated without {' and '.join(nouns)}, with a good rig's share of other effects, the rig leaves as"
        f" little of the whole transmission error here ({length(1e6 * plain)} um, and {length(1e6 * final)} um with"
        " what is named): all channels and records together speak for it"
    )


def sentence_of_only(noun: str, record: str) -> str:
    """That no record but the judged one shows an effect."""
    return (
        f"The record {record} alone shows {noun}, and tells its size: what is closed by it there is fitted, not"
        " predicted; measure another record whose flanks meet behind"
    )


def sentence_of_rivals(causes: Sequence[Hypothesis]) -> str:
    """That the records speak as well for other causes as for the one that is named."""
    named, *others = (which(one) for one in causes)
    return f"The records cannot tell {named} from {' or '.join(others)}: either explains them as well"


def sentence_of_judging(judged: Measurement, held_out: Measurement | None) -> tuple[str, ...]:
    """That the record that was held out could not judge what was found; nothing where it did, or where none was."""
    if held_out is None or judged is held_out:
        return ()
    lacks = "a rig that has to answer it cannot be simulated there"
    if not held_out.phase_known:
        lacks = "its mesh phase is arbitrary"
    return (
        f"record {held_out.name} was held out but cannot judge, since {lacks}: what effects close is told on record"
        f" {judged.name}, which they were found from",
    )


def which(one: Hypothesis) -> str:
    """An effect in words, with the part that it is in."""
    assert one.effect is not None
    which = one.name.removeprefix(one.effect.name).strip()
    return f"{one.effect.noun} ({which})" if which else one.effect.noun


def sentences_of_gap(gaps: Sequence[Gap], remaining: Sequence[Part]) -> tuple[str, ...]:
    """How much of the transmission error's gap (else of the first channel's) is explained, and what remains."""
    gap = next((one for one in gaps if one.band_hz[1] > 0), None)
    if gap is None or gap.nominal.value <= 0.0:
        return ()
    scale, unit = SHOWN_UNITS.get(gap.unit, (1.0, gap.unit))
    name, final = CHANNELS.get(gap.channel, gap.channel), gap.with_effect or gap.recalibrated
    part = 1.0 - (gap.recalibrated.value / gap.nominal.value) ** 2
    sizes = f"{length(scale * gap.nominal.value)} to {length(scale * gap.recalibrated.value)} {unit} rms"
    done = f"does not close the {name}'s gap"
    if part > 0.0:
        done = f"explains {percent(part)} of the energy of the {name}'s gap"
    said = [f"Recalibration within the nominal uncertainties and the rig's structure {done} ({sizes})"]
    mine = [one for one in remaining if one.channel == gap.channel and one.band_hz != gap.band_hz]
    mine = mine or [one for one in remaining if one.channel == gap.channel]
    if not mine:
        return (*said, f"What remains of the {name} is measurement noise")
    most = max(mine, key=lambda one: one.size)
    times = f", {number(final.value / gap.floor.value, 2)} times the noise" if gap.floor and gap.floor.value else ""
    where = f", where the largest force is missing {IN_WORDS[most.place]}" if most.place != "none" else ""
    forces = [f"{length(one.size)} N {IN_WORDS[one.place]}" for one in remaining if one.channel == "force"]
    more = f"; missing forces: {', '.join(forces)}" if forces else ""
    said.append(
        f"What remains of the {name} is {length(scale * final.value)} {unit} rms{times}, most of it at"
        f" {band_in_words(most.band_hz)} ({length(most.size)} {most.unit}){where}{more}"
    )
    return tuple(said)

"""The words of a diagnosis: names of effects, places and channels, the verdict as a sentence, numbers with units."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor, isfinite, log10
from typing import TYPE_CHECKING, NamedTuple

from gearbench.diagnosis.effects.library import CHANGING, LIBRARY
from gearbench.diagnosis.words import CHANNELS, PLACES, SHOWN_UNITS, band_in_words, length, number, percent, with_parts

if TYPE_CHECKING:
    from gearbench.diagnosis.verdict import Gap, Parameter, Range, Verdict

__all__ = [
    "CHANNELS",
    "PLACES",
    "SHOWN_UNITS",
    "band_in_words",
    "basis",
    "confidence",
    "detectable_in_words",
    "effects_in_words",
    "explained",
    "headline",
    "interval",
    "length",
    "meaning",
    "number",
    "parameter_in_words",
    "parameters_in_words",
    "percent",
    "places_in_words",
    "sentences",
    "shrinkage",
    "size_in_words",
    "value_in_words",
    "whole_band",
    "with_std",
]

EFFECTS = {effect.name: effect for effect in (*LIBRARY, *CHANGING)}
SHORT_CHANNELS = {
    "dte": "TE",
    "angle_driver": "angle, driver",
    "angle_driven": "angle, driven",
    "y_driver": "y, driver",
    "y_driven": "y, driven",
    "torque_driver": "torque, driver",
    "torque_driven": "torque, driven",
    "force": "missing force",
}
STAGES = ("nominal", "recalibrated", "with_effect", "floor")
STAGE_WORDS = {
    "nominal": "nominal rig",
    "recalibrated": "recalibrated",
    "with_effect": "with the effect",
    "floor": "noise floor",
}
# A gap counts as explained when this part of it, or this multiple of the noise floor, is left.
LEFT_OF_GAP, LEFT_OF_FLOOR = 0.1, 2.0
BESIDE = 0.1  # part of the gap, by energy, below which what an effect closes is the smaller matter


def effects_in_words(names: Sequence[str]) -> str:
    """`friction between the flanks and a cracked tooth`; the nominal rig alone where there is no effect."""
    words = [EFFECTS[name].noun if name in EFFECTS else name.replace("-", " ") for name in names]
    if not words:
        return "the nominal rig"
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def parameter_in_words(effect: str, name: str) -> str:
    """`coefficient of friction`, `delay (angle of the driver)`: a parameter's name in a verdict as an engineer says it;
    that of an unknown program's effect as it stands."""
    about, _, last = name.rpartition(".")
    words = EFFECTS[effect].parameters.get(last, last) if effect in EFFECTS else last
    words = words.replace("_", " ")
    return f"{words} ({CHANNELS.get(about, about).replace('_', ' ')})" if about else words


def parameters_in_words(verdict: Verdict) -> tuple[str, ...]:
    """`Friction between the flanks: coefficient of friction 0.0592 ± 0.0008.`: a sentence for each effect that is
    named, of all that it states."""
    out = []
    for effect in verdict.effects:
        parts = []
        for name, parameter in effect.parameters.items():
            value, unit = value_in_words(parameter)
            parts.append(f"{parameter_in_words(effect.name, name)} {value}{'' if unit in ('', '1') else f' {unit}'}")
        if parts:
            noun = effects_in_words([effect.name])
            out.append(f"{noun[:1].upper()}{noun[1:]}: {', '.join(parts)}.")
    return tuple(out)


def size_in_words(effect: str, parameter: str, on: Sequence[str], unit: str) -> str:
    """`run-out [um]`: the parameter that tells the size of an effect which is said to be about `on`."""
    about, _, last = parameter.rpartition(".")
    told = parameter_in_words(effect, last if about in on else parameter)
    return f"{told} [{unit}]" if unit else told


class Told(NamedTuple):
    """An effect and the part that it is about, what tells its size, and the size from which on it would have been named
    (None: at none) and of a good rig."""

    effect: str
    told: str
    found: float | None
    good: float


def detectable_in_words(verdict: Verdict) -> list[Told]:
    """From which size on each effect that is not named would have been; of several forms of one the least size."""
    named = {effect.name for effect in verdict.effects}
    out: dict[tuple[str, str], Told] = {}
    for one in verdict.detectable:
        if one.name in named:
            continue
        words = with_parts(effects_in_words([one.name]), one.on)
        parameter, size = next(iter(one.parameters.items()))
        scale, unit = SHOWN_UNITS.get(size.unit, (1.0, size.unit))
        told = Told(words, size_in_words(one.name, parameter, one.on, unit),
                    None if size.value is None else scale * size.value, scale * size.good)  # fmt: skip
        held = out.get(told[:2])
        if held is None or held.found is None or (told.found is not None and abs(told.found) < abs(held.found)):
            out[told[:2]] = told
    return list(out.values())


def value_in_words(parameter: Parameter) -> tuple[str, str]:
    """A parameter's value with its standard deviation, and the unit that is shown."""
    scale, shown = SHOWN_UNITS.get(parameter.unit, (1.0, parameter.unit))
    return with_std(scale * parameter.value, scale * parameter.std), shown


def meaning(effect: str) -> str:
    """What an effect is and where to look for it; empty for one that the library lacks."""
    return EFFECTS[effect].meaning if effect in EFFECTS else ""


def headline(verdict: Verdict) -> str:
    """The verdict in one sentence without numbers."""
    place = PLACES[verdict.place]
    if verdict.verdict == "effects":
        return _named(verdict)
    if verdict.verdict == "none":
        if not whole_band(verdict.gap):
            return "No known effect is called for; how much of the gap is left cannot be told."
        if explained(verdict):
            return "No effect is needed: within its uncertainties the nominal rig explains the records."
        if mostly(verdict):
            return "No effect is needed: recalibrated, the rig explains most of the gap, and a part of it remains."
        return "No known effect is called for, and recalibration leaves the gap much as it was."
    where = f" It arises {place}." if verdict.place != "none" else ""
    known = "explains the gap" if whole_band(verdict.gap) else "is what these records show"
    return f"None of the known effects {known}.{where}"


def _named(verdict: Verdict) -> str:
    """What is at work and whether it explains the gap, which what changes between repetitions does not."""
    lasting = _lasting(verdict)
    changing = [effect.name for effect in verdict.effects if effect.name not in lasting]
    passing = f"{effects_in_words(changing)} {_are(changing)} at work while the records are taken"
    if not lasting:
        return f"{passing[:1].upper()}{passing[1:]}."
    said = "explains the gap" if len(lasting) == 1 else "explain the gap"
    if not whole_band(verdict.gap):
        said = f"{_are(lasting)} at work"
    elif _beside(verdict):
        said = f"{_are(lasting)} at work, beside a recalibration that explains most of the gap"
    elif not explained(verdict):
        said = f"{_are(lasting)} at work, and a part of the gap remains"
    words = effects_in_words(lasting)
    return f"{words[:1].upper()}{words[1:]} {said}{f'; {passing}' if changing else ''}."


def _lasting(verdict: Verdict) -> list[str]:
    """Names of the effects that do not change between repetitions: a rig with the effects has these."""
    changing = {one.name for one in CHANGING}
    return [effect.name for effect in verdict.effects if effect.name not in changing]


def _are(several: Sequence[str]) -> str:
    return "is" if len(several) == 1 else "are"


def _beside(verdict: Verdict) -> bool:
    """Whether what is named closes only a small part of a gap that recalibration closes."""
    for one in whole_band(verdict.gap):
        if one.channel == "dte" and one.with_effect is not None:
            closed = one.recalibrated.value**2 - one.with_effect.value**2
            return closed < BESIDE * one.nominal.value**2 and one.recalibrated.value < 0.5 * one.nominal.value
    return False


def confidence(verdict: Verdict) -> str:
    """How sure, where, and how far the gap shrinks, in a sentence or two."""
    sure = getattr(verdict.probability, verdict.verdict.removesuffix("s"))
    words = {"effects": "one of the known effects", "none": "no effect", "unknown": "a cause that is not known"}
    seen = f" (by {basis(verdict.limits, verdict.calibrated_on)})" if verdict.calibrated_on else ""
    parts = [f"Probability of {words[verdict.verdict]}: {percent(sure)}{seen}."]
    if verdict.verdict == "effects" and verdict.place != "none":
        parts.append(f"It acts {PLACES[verdict.place]}.")
    shrunk = shrinkage(verdict)
    return " ".join([*parts, shrunk] if shrunk else parts)


def basis(source: str | None, rigs: int | None) -> str:
    """From what limits and probabilities are: `12 truth rigs around this one`, `19 truth rigs of other sizes`."""
    if source is None:
        return "not said"
    return f"{rigs} truth rigs {'around this one' if source == 'this rig' else 'of other sizes and structures'}"


def shrinkage(verdict: Verdict) -> str:
    """How far the gap of the first channel shrinks over the whole band; empty where no gap is given."""
    gap = next(iter(whole_band(verdict.gap)), None)
    if gap is None:
        return ""
    scale, unit = SHOWN_UNITS.get(gap.unit, (1.0, gap.unit))
    named = "" if gap.record == "held-out" else f" {gap.record}"
    record = f"the held-out record{named}" if verdict.held_out else f"record {gap.record} (not held out)"
    steps = f"to {length(scale * gap.recalibrated.value)} {unit} recalibrated"
    if gap.with_effect is not None:
        several = "effects" if len(_lasting(verdict)) > 1 else "effect"
        steps += f" and {length(scale * gap.with_effect.value)} {unit} with the {several}"
    floor = f" (noise floor {length(scale * gap.floor.value)} {unit})" if gap.floor else ""
    rest = ""
    if gap.with_effect is not None and gap.floor is not None and not explained(verdict):
        times = gap.with_effect.value / max(gap.floor.value, 1e-300)
        rest = f" What remains is {number(times, 2)} times the floor: the rig's own structure, or another cause."
        if (kept := verdict.signs.get("along")) is not None:
            rest = (
                f" What remains is {number(times, 2)} times the floor, and {number(kept * times, 2)} times it where the"
                " rig is kept on the record's way, in which flanks part."
            )
    return (
        f"On {record} the rms gap of the {CHANNELS.get(gap.channel, gap.channel)} goes from"
        f" {length(scale * gap.nominal.value)} {unit} {steps}{floor}.{rest}"
    )


def sentences(verdict: Verdict) -> tuple[str, ...]:
    """Why the verdict is what it is, each as a whole sentence."""
    return tuple(f"{one[:1].upper()}{one[1:].rstrip('.')}." for one in verdict.because)


def places_in_words(verdict: Verdict) -> str:
    """Which places the shares of the gap by place put first, as the picture beside it shows them."""
    ranked = sorted((one for one in verdict.where if one.kind == "place"), key=lambda one: -one.share)
    if not ranked:
        return "" if verdict.place == "none" else f"The force that the simulation lacks acts {PLACES[verdict.place]}. "
    first = ranked[0]
    words = f"Most of what recalibration does not close arises {PLACES.get(first.name, first.name)}"
    words += f" ({percent(first.share)})"
    if verdict.place not in ("none", first.name):
        share = next((one.share for one in ranked if one.name == verdict.place), 0.0)
        words += f"; {percent(share)} {PLACES[verdict.place]}, where the verdict has its cause"
    return f"{words}. "


def explained(verdict: Verdict) -> bool:
    """Whether little of the gap of the first channel is left in the end, as far as there is one: a tenth of it, or what
    noise makes."""
    gap = next(iter(whole_band(verdict.gap)), None)
    if gap is None:
        return False
    floor = gap.floor.value if gap.floor else 0.0
    last = gap.with_effect or gap.recalibrated
    return last.value <= max(LEFT_OF_GAP * gap.nominal.value, LEFT_OF_FLOOR * floor)


def mostly(verdict: Verdict) -> bool:
    """Whether less than half of the gap of the first channel is left in the end."""
    gap = next(iter(whole_band(verdict.gap)), None)
    return gap is not None and (gap.with_effect or gap.recalibrated).value < 0.5 * gap.nominal.value


def whole_band(gaps: Sequence[Gap]) -> list[Gap]:
    """One gap a channel: the widest band that is not the mean."""
    best: dict[str, Gap] = {}
    for gap in gaps:
        width = gap.band_hz[1] - gap.band_hz[0]
        held = best.get(gap.channel)
        if width > 0 and (held is None or width > held.band_hz[1] - held.band_hz[0]):
            best[gap.channel] = gap
    return list(best.values())


def with_std(value: float, std: float) -> str:
    """`0.0584 ± 0.0012`: both to the second significant digit of the standard deviation."""
    if not (isfinite(std) and std > 0):  # a tooth's number has none
        return f"{value:.0f}" if std == 0 and value == round(value) else number(value)
    power = floor(log10(max(abs(value), std)))
    if power < -3 or power >= 6:
        return f"({with_std(value / 10.0**power, std / 10.0**power)})e{power}"
    digits = 1 - floor(log10(std))
    return f"{round(value, digits):.{max(0, digits)}f} ± {round(std, digits):.{max(0, digits)}f}"


def interval(value: Range | None, unit: str) -> str:
    """`1.23 (1.10-1.40)` in the unit that is shown; a dash where there is none."""
    if value is None:
        return "–"
    scale = SHOWN_UNITS.get(unit, (1.0, unit))[0]
    return f"{length(scale * value.value)} ({length(scale * value.low, 2)}–{length(scale * value.high, 2)})"

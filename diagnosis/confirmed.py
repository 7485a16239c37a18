"""What finite elements say of a diagnosis, as the verdict tells it: gaps, each named effect, sentences, advice."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from gearbench.bench.nonlinear.followed import follows
from gearbench.diagnosis.account import LINES
from gearbench.diagnosis.effects.library import LIBRARY
from gearbench.diagnosis.judging.closing import Closing
from gearbench.diagnosis.judging.elements import HELD, ByElements, by_elements
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.judging.naming import parameters_of
from gearbench.diagnosis.replay.gap import gaps_of
from gearbench.diagnosis.selection.weighing import Weighed
from gearbench.diagnosis.verdict import Confirmation, Confirmed, Effect, Gap, Parameter
from gearbench.diagnosis.words import CHANNELS, SHOWN_UNITS, length, number

Report = Callable[[str], None]


def confirmed_by_elements(judged: Judged | None, named: Sequence[Effect], report: Report) -> Confirmed:
    """What the reduced finite-element model says of what was found on the judged record; a model that cannot answer
    costs the confirmation, not the verdict."""
    if judged is None:
        return Confirmed(because=("finite elements were not asked: the records cannot be simulated",))
    try:
        found = by_elements(judged, bool(named), report)
    except ValueError as error:
        return Confirmed(because=(f"finite elements could not answer the records: {error}",))
    rig = judged.found.layout.nominal.rig
    given = "angle_driven" if follows(rig, judged.measured.record) else None
    gap = gaps_of(judged.measured, list(found.signals.values()), given)
    effects = _effects(judged, found)
    because = (*_sentence_of_gap(gap), *_sentences(judged, found), *_sentence_of_lacks(found))
    return Confirmed(gap=gap, effects=effects, lacks=found.lacks, because=because)


def advice_on(confirmed: Confirmed | None) -> tuple[str, ...]:
    """What to do about effects that finite elements do not confirm."""
    if confirmed is None:
        return ()
    return tuple(
        f"Do not act on {_noun(one.name)} yet: finite elements close the gap without it. Records at another mean torque"
        " and another speed tell an effect from what the lumped model lacks."
        for one in confirmed.effects
        if not one.confirmed
    )


def _effects(judged: Judged, found: ByElements) -> tuple[Confirmation, ...]:
    """Each named effect by finite elements; one at work in two places counts once, by the one that shows it better."""
    out: dict[str, Confirmation] = {}
    for one in judged.found.selection.entered:
        effect, closing = one.effect, found.closings.get(one.hypothesis.name)
        if closing is None:
            continue
        before = out.get(effect.name)
        parameters = {**(before.parameters if before else {}), **_parameters(judged, found, one)}
        if before is not None and before.growth > closing.growth:
            out[effect.name] = before.model_copy(update={"parameters": parameters})
            continue
        out[effect.name] = Confirmation(
            name=effect.name, confirmed=closing.due, growth=closing.growth, gain=closing.gain, parameters=parameters
        )
    return tuple(out.values())


def _parameters(judged: Judged, found: ByElements, one: Weighed) -> dict[str, Parameter]:
    """Parameters of an effect as finite elements fit them; none of one that they hold as the lumped model has it."""
    layout, best = judged.found.layout, found.optimum
    if best is None or one.hypothesis.wide[0].key in HELD:
        return {}
    estimates = one.effect.add(layout.nominal.rig, one.hypothesis, layout.fitted(best.p, best.std))[1]
    return parameters_of(one.effect, estimates)


def _sentences(judged: Judged, found: ByElements) -> list[str]:
    """Whether finite elements confirm each named effect."""
    said = []
    for one in judged.found.selection.entered:
        closing = found.closings.get(one.hypothesis.name)
        if closing is None:
            continue
        noun = one.effect.noun
        if closing.due:
            times = f"the gap of the {_part(closing)} is {number(closing.growth, 2)} times as large"
            said.append(f"finite elements confirm {noun}: fitted again without it, {times}")
        elif closing.growth <= 1.0:
            said.append(f"finite elements do not confirm {noun}: fitted again without it, no part of the gap is larger")
        else:
            said.append(
                f"finite elements do not confirm {noun}: fitted again without it, the gap of the {_part(closing)} is"
                f" {number(closing.growth, 2)} times as large, and no other part's is more, with"
                f" {number(closing.gain, 2)} nats in its favour"
            )
    return said


def _part(closing: Closing) -> str:
    channel, part = closing.part
    return f"{CHANNELS.get(channel, channel)} {LINES.get(part, f'at {part} Hz')}"


def _sentence_of_gap(gaps: Sequence[Gap]) -> tuple[str, ...]:
    """How far the gap of the first channel shrinks by finite elements."""
    gap = next((one for one in gaps if one.band_hz[1] > 0), None)
    if gap is None:
        return ()
    scale, unit = SHOWN_UNITS.get(gap.unit, (1.0, gap.unit))
    steps = f"{length(scale * gap.nominal.value)} to {length(scale * gap.recalibrated.value)} {unit} rms recalibrated"
    if gap.with_effect is not None:
        steps += f" and {length(scale * gap.with_effect.value)} {unit} with what was found"
    floor = f" (noise floor {length(scale * gap.floor.value)} {unit})" if gap.floor else ""
    name = CHANNELS.get(gap.channel, gap.channel)
    return (f"by finite elements, fitted again by themselves, the gap of the {name} goes from {steps}{floor}",)


def _sentence_of_lacks(found: ByElements) -> tuple[str, ...]:
    left = f"not in the finite-element model, and left out there: {', '.join(found.lacks)}"
    return (*found.said, *((left,) if found.lacks else ()))


def _noun(name: str) -> str:
    return next((effect.noun for effect in LIBRARY if effect.name == name), name)

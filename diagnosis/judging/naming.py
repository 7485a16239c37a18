"""The named effects as a verdict tells them: how likely, with which parameters, and what each closes of the gap."""

from __future__ import annotations

from collections.abc import Sequence

from gearbench.diagnosis.effects.effect import Effect as Library
from gearbench.diagnosis.effects.effect import Estimate
from gearbench.diagnosis.effects.temperature_drift import TEMPERATURE_DRIFT
from gearbench.diagnosis.intake.signals import UNITS
from gearbench.diagnosis.judging.chances import Chances
from gearbench.diagnosis.judging.closing import Closing, rms_closed
from gearbench.diagnosis.judging.decided import Decided
from gearbench.diagnosis.judging.judged import Judged
from gearbench.diagnosis.verdict import NINE_OF_TEN, Effect, Parameter, Range
from gearbench.diagnosis.words import SHOWN_UNITS


def parameters_of(
    effect: Library, estimates: Sequence[Estimate], *, by_forces: bool = False
) -> dict[str, Parameter]:
    """Values with the interval that a normal distribution of the stated deviation has, of what has no sign the part of
    it above nothing; `by_forces`: found by the force residuals alone."""
    out = {}
    for e in estimates:
        reach = NINE_OF_TEN * effect.stated(e, by_forces=by_forces)
        low = e.value - reach
        if e.sized and not e.signed and e.value >= 0.0:
            low = max(low, 0.0)
        out[e.name] = Parameter(value=e.value, low=low, high=e.value + reach, unit=e.unit)
    return out


def effects_of(judged: Judged, decided: Decided, chances: Chances) -> tuple[Effect, ...]:
    """The named effects with their parameters and what they close; one at work in two places counts once."""
    found = judged.found
    values = found.layout.fitted(found.selection.best.p, found.std)
    out: dict[str, Effect] = {}
    for one in decided.named:
        effect = one.effect
        estimates = effect.add(found.layout.nominal.rig, one.hypothesis, values)[1]
        other = out.get(effect.name)
        closing = judged.closings[one.hypothesis.name]
        here = Effect(
            name=effect.name,
            probability=chances.named[one.hypothesis.name],
            due=closing.due,
            parameters=parameters_of(effect, estimates),
            share=judged.share_of(one.hypothesis),
            closes=_closes(judged, closing),
            grows=closing.growth,
        )
        out[effect.name] = here if other is None else _together(other, here)
    return tuple(out.values())


def _together(one: Effect, other: Effect) -> Effect:
    """An effect that is named in two places: as likely as where it is likelier, with what it closes where it closes
    more."""
    more = max(one, other, key=lambda each: each.share or 0.0)
    return more.model_copy(
        update={
            "probability": max(one.probability, other.probability),
            "due": one.due or other.due,
            "parameters": {**one.parameters, **other.parameters},
            "grows": max(one.grows or 0.0, other.grows or 0.0),
        }
    )


def drifts_of(decided: Decided, changing: float, chances: Chances) -> tuple[Effect, ...]:
    """The drift that is named; of the gap it has what changes."""
    drift, effect = decided.drift, TEMPERATURE_DRIFT
    if drift is None:
        return ()
    of = "" if drift.place == "mesh" else f"{drift.place.removesuffix('-support')}."
    estimate = Estimate(f"{of}stiffness_drift", drift.value, drift.std, "1", signed=True)
    return (
        Effect(
            name=effect.name,
            probability=chances.named[effect.name],
            due=True,
            parameters=parameters_of(effect, (estimate,)),
            share=min(changing**2 * drift.share, 1.0),
            grows=drift.grows,
        ),
    )


def _closes(judged: Judged, closing: Closing) -> dict[str, Range]:
    """By channel, rms in um or N m that comes back without an effect."""
    out = {}
    for channel in judged.sizes:
        sizes = rms_closed(judged.measured, channel, closing.without[channel], judged.answer[channel], judged.top)
        scale = SHOWN_UNITS.get(UNITS[channel], (1.0, ""))[0]
        value, low, high = (scale * size for size in sizes)
        out[channel] = Range(value=value, low=low, high=high)
    return out

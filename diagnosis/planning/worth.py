"""What a plan lacks and what each of its records and channels is worth, in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isinf

from gearbench.diagnosis.effects.library import LIBRARY
from gearbench.diagnosis.planning.row import BOTH, LONGER, Cost, Row
from gearbench.diagnosis.words import CHANNELS, number, with_parts

NOUNS = {effect.name: effect.noun for effect in LIBRARY}
# A smallest size that grows, or a standard deviation that grows, by these factors counts as carried by what was left
# out.
HARDER, VAGUER = 1.25, 2.0
FOR_NOTHING = 1.1  # below which nothing is lost
TOLD = 3  # effects in a sentence
FORMS = {"flanks": "along the flanks", "slope": "slope and barrelling"}


def said_of(
    rows: Sequence[Row], groups: Sequence[tuple[str, ...]], parting: Sequence[str], judged: str
) -> tuple[str, ...]:
    """Sentences about what this plan carries, lacks and could do without; `parting`: records whose flanks part,
    `judged`: the one that a verdict is judged on."""
    said = []
    lost = [row for row in rows if row.found is None and row.effect != "backlash"]
    if lost:
        said.append(f"This plan does not find {_listed([words_of(row) for row in lost])}, whatever the size.")
    if not parting:
        said.append(
            "Flanks stay together in every record, so that backlash stays hidden: add a light load with a multisine"
            " that swings beyond it."
        )
    elif any(row.effect == "backlash" and row.found is None for row in rows):
        said.append(
            f"Flanks part in {_listed(parting, 'and')} but not in {judged}, on which a verdict is judged: backlash"
            f" would not be named. Let the torque of {judged} swing as far, or hold out a record whose flanks part."
        )
    for group in groups:
        said.append(f"Records of this plan cannot tell {_listed([NOUNS[name] for name in group], 'and')} apart.")
    names = dict.fromkeys(name for row in rows for name in row.costs)
    said += [one for one in (_of(name, rows) for name in names) if one]
    poor = _poor(rows)
    if any(row.found is not None for row in rows) and not poor:
        said.append(
            "Of every effect that is found no other plan would find much less: what a good rig has of it sets the"
            " limit, not these records."
        )
    elif poor:
        said.append(f"Better records would find smaller sizes of {_listed([words_of(row) for row in poor[:TOLD]])}.")
    return tuple(said)


def is_poor(rows: Sequence[Row]) -> bool:
    """Whether other records could find more: smaller sizes, or effects that this plan mixes up."""
    return bool(_poor(rows)) or any(row.rivals for row in rows)


def _poor(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row.over_best is not None and row.over_best > HARDER]


def sentence_of_more(words: str, smaller: Mapping[str, float], told: Sequence[tuple[str, str]]) -> str:
    """What a record in addition brings: by how many times `smaller` sizes of effects are found, by their words, and
    which pairs of effects are `told` apart; empty where that is nothing."""
    better = sorted((one for one in smaller if smaller[one] > HARDER), key=lambda one: -smaller[one])
    parts = [f"{one} ({'at all' if isinf(smaller[one]) else f'{number(smaller[one], 2)} times'})" for one in better]
    said = [f"find smaller sizes of {_listed(parts[:TOLD], 'and')}"] if parts else []
    said += [f"tell {NOUNS[one]} from {NOUNS[other]}" for one, other in dict.fromkeys(told)]
    return f"A further record {words} would {_listed(said, 'and')}." if said else ""


def words_of(row: Row) -> str:
    """`run-out of a gear (driver)`: an effect, and which part it is about."""
    return words_of_effect(row.effect, row.name, row.on)


def words_of_effect(effect: str, name: str, on: Sequence[str]) -> str:
    """The same of a hypothesis by its name; where it is about no part, the rest of its name tells it from another one
    of the same effect."""
    return with_parts(NOUNS[effect], on, FORMS.get(name.removeprefix(effect).strip(), ""))


def _of(name: str, rows: Sequence[Row]) -> str:
    """What leaving out (or adding) that is worth."""
    costs = {words_of(row): row.costs[name] for row in rows if name in row.costs}
    if name == LONGER:
        better = [words for words, one in costs.items() if one.size is not None and one.size < 1 / HARDER]
        return f"With {name} smaller sizes would be found of {_listed(better[:TOLD])}." if better else ""
    words = CHANNELS.get(name, name)
    words = words if name.startswith("record ") else f"the {words.removeprefix('both ')}" if name != BOTH else name
    harder = {one: cost for one, cost in costs.items() if cost.size is None or cost.size > HARDER}
    if harder:
        ranked = sorted(harder, key=lambda one: -_size(harder[one]))
        parts = [f"{one} ({_times(harder[one])})" for one in ranked[:TOLD]]
        more = f" and {len(harder) - TOLD} more" if len(harder) > TOLD else ""
        return f"Without {words} larger effects only would be found: {_listed(parts)}{more}."
    vaguer = {one: cost.std for one, cost in costs.items() if cost.std > VAGUER}
    if vaguer:
        ranked = sorted(vaguer, key=lambda one: -vaguer[one])
        parts = [f"{one} ({number(vaguer[one], 2)} times)" for one in ranked[:TOLD]]
        return f"Without {words} as much would be found, but known less well: {_listed(parts)}."
    if all(cost.std < FOR_NOTHING for cost in costs.values()):
        return f"Leaving out {words} would cost nothing."
    return ""


def _size(cost: Cost) -> float:
    return float("inf") if cost.size is None else cost.size


def _times(cost: Cost) -> str:
    return "not at all" if cost.size is None else f"{number(cost.size, 2)} times"


def _listed(words: Sequence[str], last: str = "or") -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}" if words else ""

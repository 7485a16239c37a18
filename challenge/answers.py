"""The answers of a challenge: what was withheld from each case. They alone hold the seed.

File: `{"ID": {"kind": "effect" | "none" | "foreign", "effects": [names], "place": name, "parameters": {effect: {name:
{"value", "unit"}}}, "severity": {effect: number}, "family", "seed", "number", "places": [name of each effect],
"traces": {effect: number}}}`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from gearbench.challenge.errors import ChallengeError
from gearbench.files import write_text
from gearbench.rig.contract import PLACES

KINDS = ("effect", "none", "foreign")


@dataclass(frozen=True)
class Answer:
    """What is true of one case. `number` is its place in the plan, from which with `seed` its draws follow."""

    kind: str
    effects: tuple[str, ...] = ()
    place: str = "none"
    parameters: Mapping[str, Mapping[str, Mapping[str, Any]]] = field(default_factory=dict)
    severity: Mapping[str, float] = field(default_factory=dict)
    family: str = ""
    seed: int = 0
    number: int = 0
    places: tuple[str, ...] = ()  # of every effect, in their order
    # By how much the held-out record changes without each effect, over its noise (`making.traces`).
    traces: Mapping[str, float] = field(default_factory=dict)

    @property
    def everywhere(self) -> tuple[str, ...]:
        """Places that a verdict may rightly give: of any of the effects."""
        return self.places or (self.place,)


def write_answers(answers: Mapping[str, Answer], path: Path) -> None:
    """Write the answers in one step. Raises FileError."""
    tree = {name: asdict(answer) for name, answer in answers.items()}
    write_text(path, json.dumps(tree, indent=1, allow_nan=False) + "\n")


def read_answers(path: Path) -> dict[str, Answer]:
    """Answers by case. Raises ChallengeError: one sentence with file and key."""
    if not path.is_file():
        raise ChallengeError(f"answers {path} do not exist")
    try:
        tree = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ChallengeError(f"answers {path} are truncated or no JSON ({error})") from None
    if not isinstance(tree, dict) or not tree:
        raise ChallengeError(f"answers {path} must be a JSON object with a key for each case")
    return {name: _answer(entry, f"answers {path}: {name}") for name, entry in tree.items()}


def _answer(entry: Any, where: str) -> Answer:
    if not isinstance(entry, dict):
        raise ChallengeError(f"{where} must be an object")
    for key in ("kind", "effects", "place", "parameters"):
        if key not in entry:
            raise ChallengeError(f"{where} lacks the key {key}")
    effects = entry["effects"]
    if entry["kind"] not in KINDS:
        raise ChallengeError(f"{where}: kind = {entry['kind']!r} must be one of {', '.join(KINDS)}")
    if not isinstance(effects, list) or not all(isinstance(name, str) for name in effects):
        raise ChallengeError(f"{where}: effects must be a list of names")
    if bool(effects) == (entry["kind"] == "none"):
        raise ChallengeError(f"{where}: effects = {effects} do not go with kind = {entry['kind']}")
    if entry["place"] not in PLACES:
        raise ChallengeError(f"{where}: place = {entry['place']!r} must be one of {', '.join(PLACES)}")
    if not all(isinstance(entry.get(key, {}), dict) for key in ("parameters", "severity", "traces")):
        raise ChallengeError(f"{where}: parameters, severity and traces must be objects")
    return Answer(
        kind=entry["kind"],
        effects=tuple(effects),
        place=entry["place"],
        parameters=entry["parameters"],
        severity=entry.get("severity", {}),
        family=str(entry.get("family", "")),
        seed=int(entry.get("seed", 0)),
        number=int(entry.get("number", 0)),
        places=tuple(str(one) for one in entry.get("places", ())),
        traces={str(name): float(size) for name, size in entry.get("traces", {}).items()},
    )

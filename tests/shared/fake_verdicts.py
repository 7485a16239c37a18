"""Verdicts made by hand, and a diagnosis that always says the same: where processes of their own can import it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def verdict(
    said: str = "effect", *effects: str, place: str = "mesh", stated: float = 0.9, **more: Any
) -> dict[str, Any]:
    rest = (1 - stated) / 2
    probability = {key: stated if key == said else rest for key in ("effect", "none", "unknown")}
    named = [{"name": name, "probability": stated, "parameters": {}} for name in effects]
    return {
        "schema": "gearbench-verdict/1",
        "verdict": said,
        "probability": probability,
        "effects": named,
        "place": place,
        "candidates": [],
        "indistinguishable": [],
        "gap": [],
        **more,
    }


def says_friction(records: Any, nominal: Path, folder: Path, left_out: Any) -> str | None:
    """A diagnosis that always finds the same, or refuses where that is left out; it fails on the last case."""
    if folder.name == "c3" or folder.parent.name == "c3":
        return "no wish to"
    made = verdict("unknown") if "friction" in left_out else verdict("effect", "friction")
    (folder / "verdict.json").write_text(json.dumps({**made, "seen": [p.name for p in records]}), encoding="utf-8")
    return None

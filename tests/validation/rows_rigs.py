"""Random rigs over the valid space: each runs to a finite, balanced record or is refused in one sentence.

GEARBENCH_FUZZ multiplies their number.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from shared.hunting import scale
from shared.random_rigs import Outcome, outcome, random_rig

from gearbench.commands.house.checks import Check, Got

COUNT = 24
SEED = 7


def ending(number: int, folder: Path) -> Outcome:
    """How a rig ends, whatever is raised."""
    try:
        return outcome(random_rig(np.random.default_rng([number, SEED])), folder)
    except Exception as error:
        return Outcome("wrong", f"{type(error).__name__}: {error}")


def random_rigs() -> Got:
    """Number of rigs that end in neither; the note tells how the others do."""
    count = round(COUNT * scale())
    with tempfile.TemporaryDirectory() as made:
        endings = [ending(number, Path(made)) for number in range(count)]
    wrong = [f"{number}: {end.said}" for number, end in enumerate(endings) if end.kind == "wrong"]
    kinds = [end.kind for end in endings]
    told = ", ".join(f"{kinds.count(kind)} {kind}" for kind in ("ran", "refused", "refused at rest", "refused late"))
    return Got(float(len(wrong)), "; ".join([told, *wrong]))


CHECKS = [
    Check("random-rigs", "random rigs without a finite, balanced record or a sentence", 0, "", random_rigs),
]

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
LATE = "refused late"
ONCE_LATE = ((19, 31415),)  # rigs and seeds that have been refused late, the DTE beyond 0.05 modules


def ending(number: int, seed: int, folder: Path) -> Outcome:
    """How a rig ends, whatever is raised."""
    try:
        return outcome(random_rig(np.random.default_rng([number, seed])), folder)
    except Exception as error:
        return Outcome("wrong", f"{type(error).__name__}: {error}")


def random_rigs() -> Got:
    """Number of rigs that end in neither, or after work has begun; the note tells how the others do."""
    rigs = [*((number, SEED) for number in range(round(COUNT * scale()))), *ONCE_LATE]
    with tempfile.TemporaryDirectory() as made:
        endings = [ending(*rig, Path(made)) for rig in rigs]
    wrong = [f"{rig}: {end.said}" for rig, end in zip(rigs, endings, strict=True) if end.kind in ("wrong", LATE)]
    kinds = [end.kind for end in endings]
    told = ", ".join(f"{kinds.count(kind)} {kind}" for kind in ("ran", "refused", "refused at rest", LATE))
    return Got(float(len(wrong)), "; ".join([told, *wrong]))


CHECKS = [
    Check("random-rigs", "random rigs without a finite, balanced record or a sentence", 0, "", random_rigs),
]

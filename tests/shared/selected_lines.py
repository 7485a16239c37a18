"""A selection on lines made by hand: what its unknowns do, and the effects that it may find."""

from __future__ import annotations

import numpy as np
from shared.fake_simulator import (
    FakeSimulator,
    chosen,
    noisy,
    sensitivities,
    target,
)

from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.selection.by_forces import Start
from gearbench.diagnosis.selection.selection import Selection

MATRIX = sensitivities(3)
FRICTION = Hypothesis("friction", "mesh", (Wide("friction"),))
RIPPLE = Hypothesis("torque-ripple", "drive", (Wide("ripple"),))
CRACKS = tuple(Hypothesis(f"tooth-crack {i}", "mesh", (Wide("crack", i),), choices=2) for i in range(2))
LISTED = (FRICTION, RIPPLE, *CRACKS)


def selected(true: dict[int, float], starts: dict[str, Start] | None = None) -> Selection:
    p = np.array([0.08, -0.1, 0.02, 0.004, -0.005, 0.006, 0.0, 0.0])
    for number, value in true.items():
        p[number] = value
    simulator = FakeSimulator(lambda q: q @ MATRIX, target(noisy(p @ MATRIX)))
    found = chosen(simulator, LISTED, [np.zeros(8)], starts or {})
    assert found is not None
    return found


def names(found: Selection) -> list[str]:
    return [one.hypothesis.name for one in found.entered]

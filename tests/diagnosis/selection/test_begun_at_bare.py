"""Effects beside which a fit lost the rig that is found without them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shared.fake_simulator import ACROSS, LINES, FakeSimulator, beyond_a_hill, sensitivities, target

from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.fitting.fit import Optimum, fit_afresh
from gearbench.diagnosis.selection import selection as module
from gearbench.diagnosis.selection.weighing import Weighed

FRICTION = Hypothesis("friction", "mesh", (Wide("friction"),))


def test_a_fit_with_effects_is_begun_again_where_the_rig_without_them_answers_better() -> None:
    """Run-out shows at orders of its shaft alone; beside it the fit had lost the structure that the rig without has."""
    lines_at = np.arange(LINES) % 6
    matrix = sensitivities(3) * np.where((np.arange(8)[:, None] == 3) == (lines_at >= 4), 1.0, 0.0)
    unknowns, lines_of = beyond_a_hill(matrix)
    plain = target(lines_of(ACROSS))
    kinds = ("excited",) * 4 + ("operating",) * 2
    blocks = tuple(replace(one, kind=kind) for one, kind in zip(plain.blocks, kinds, strict=True))
    simulator: Any = FakeSimulator(lines_of, replace(plain, blocks=blocks), layout=SimpleNamespace(unknowns=unknowns))
    sd = unknowns.prior()
    base = fit_afresh(simulator, np.where(np.arange(8) == 3, 0.0, ACROSS), sd, renewals=4)
    lost = fit_afresh(simulator, np.where(np.arange(8) > 3, 0.0, ACROSS), FRICTION.widened(unknowns, sd), renewals=4)
    assert base is not None and lost is not None and lost.p[4] < 0.1

    def begun(best: Optimum) -> Optimum:
        kept = (Weighed(FRICTION, 100.0, best),)
        _, bare, found, stay = module._begun_at_bare(simulator, base, best, kept, lambda step: None, apart=False)
        assert [one.hypothesis.name for one in stay] == ["friction"] and bare.p[3] == 0.0
        return found

    found = begun(lost)
    assert found.p[[3, 4, 5]] == pytest.approx([0.4, 0.23, 0.21], abs=0.01)
    assert begun(found) is found

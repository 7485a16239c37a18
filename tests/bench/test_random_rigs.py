"""Rigs from anywhere in the valid space: one that runs, one that is refused; the row random-rigs has more."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shared.random_rigs import outcome, random_rig


@pytest.mark.parametrize(("number", "kind"), [pytest.param(1, "ran", marks=pytest.mark.validation), (4, "refused")])
def test_a_random_rig_runs_balanced_or_is_refused_in_words(tmp_path: Path, number: int, kind: str) -> None:
    """Finite channels, and teeth that carry the mean torque; or one sentence before work starts."""
    found = outcome(random_rig(np.random.default_rng([number, 7])), tmp_path)
    assert found.kind == kind, found.said

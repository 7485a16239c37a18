"""What the rigs that unknowns make have in their mesh."""

from __future__ import annotations

import numpy as np
import pytest
from shared.simulated_lines import demonstration

from gearbench.diagnosis.effects.backlash import KEY as BACKLASH
from gearbench.geometry import pair


def test_no_unknown_but_backlash_opens_the_flanks() -> None:
    """Material that working flanks lack is backlash by another name, which a mean that no fit holds would not tell."""
    layout = demonstration().layout
    nominal = layout.case(np.zeros(layout.size)).rig
    rng = np.random.default_rng(5)
    for _ in range(3):
        p = np.clip(2.0 * layout.unknowns.prior() * rng.standard_normal(layout.size), *layout.unknowns.bounds())
        p[layout.unknowns[BACKLASH]] = 2e-5
        rig = layout.case(p).rig
        assert rig.mesh.error_mean == nominal.mesh.error_mean
        assert pair(rig).backlash_normal - pair(nominal).backlash_normal == pytest.approx(2e-5, rel=1e-3)

"""What the rigs that unknowns make have in their mesh."""

from __future__ import annotations

import numpy as np
import pytest
from shared.simulated_lines import demonstration

from gearbench.diagnosis.effects.backlash import KEY as BACKLASH
from gearbench.diagnosis.effects.contact_nonlinearity import KEY as CONTACT
from gearbench.diagnosis.effects.contact_nonlinearity import unknowns
from gearbench.diagnosis.effects.mesh_damping import KEY as RATIO
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


def test_three_deviations_more_of_a_damping_ratio_are_those_of_its_prior() -> None:
    """Known to 40 %: 2.2 times the ratio, the largest that a sound rig has, and no prior of an effect's own."""
    layout = demonstration().layout
    group = layout.unknowns.group(RATIO)
    assert layout.model.sd_mesh_ratio == pytest.approx(0.4)
    p = np.zeros(layout.size)
    p[layout.unknowns[RATIO]] = 3.0 * group.sd
    nominal, moved = (layout.case(one).rig.damping.mesh_ratio for one in (0.0 * p, p))
    assert moved == pytest.approx(2.2 * nominal)
    assert group.wide.tolist() == group.sd.tolist()


def test_an_exponent_of_the_mesh_is_known_better_by_simulation_than_by_forces() -> None:
    layout = demonstration().layout
    group = layout.unknowns.group(CONTACT)
    (forces,) = unknowns(layout.model, ())
    assert group.sd[0] == 0.5 * forces.sd[0]
    assert group.wide[0] == forces.wide[0] > group.sd[0]

"""Root stress against CalculiX's own nodal stress in the fillets of both gears (calculix/root_stress.py)."""

from __future__ import annotations

import pytest
from shared.root_stresses import FINEST, POSITIONS, roots

pytestmark = pytest.mark.validation

REACH = 0.01


@pytest.mark.parametrize("position", FINEST, ids=[f"{one['pair']}:{one['phase']:+.2f}" for one in FINEST])
def test_largest_tension_of_every_loaded_root(position: dict) -> None:
    for root in roots(position):
        assert root.own_stress == pytest.approx(root.stress, rel=REACH)
        # Where a maximum is flat its place is soft: a tenth of a millimetre is 0.1 % of stress.
        assert root.own_radius == pytest.approx(root.radius, abs=0.1)


@pytest.mark.parametrize("position", FINEST, ids=[f"{one['pair']}:{one['phase']:+.2f}" for one in FINEST])
def test_the_reference_has_converged(position: dict) -> None:
    """Fillets half as coarse again move it by less than a third of what is to be reached."""
    coarser = [one for one in POSITIONS if one["pair"] == position["pair"] and one["size"] > position["size"]]
    assert coarser
    for other in coarser:
        for one, two in zip(position["roots"], other["roots"], strict=True):
            assert one["stress"] == pytest.approx(two["stress"], rel=REACH / 3)

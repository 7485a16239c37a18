"""A crack's loss of stiffness as the lumped model takes it, and which models take which kind of crack."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from gearbench.bench.elastic.crack import crack_lines, stiffness_loss
from gearbench.bench.errors import BenchError
from gearbench.bench.plan.schedule import cycles_to_repeat
from gearbench.bench.refusals.effects import ELASTIC_KEYS, refuse_effects, refuse_unknown
from gearbench.fem.gear.body import condense
from gearbench.geometry.tooth.profile import profile
from gearbench.lumped.stiffness.potential_energy import tooth_compliance
from gearbench.rig import Crack, Gear, Material, Rig, Support, Supports


def gear(crack: Crack | None = None) -> Gear:
    return Gear(teeth=20, module=3e-3, face_width=0.02, hub_radius=0.02, thinning=40e-6, crack=crack)


def rig(driver: Crack | None = None, driven: Crack | None = None) -> Rig:
    support = Support(stiffness=2e8)
    return Rig(driver=gear(driver), driven=gear(driven), support=Supports(driver=support, driven=support))


CUT = Crack(tooth=3, length=1.2e-3, direction=radians(60))


@pytest.mark.validation
def test_the_loss_makes_the_lumped_tooth_grow_by_what_the_crack_adds() -> None:
    wheel, material = gear(CUT), Material()
    shape = profile(wheel)
    loss = stiffness_loss(wheel, shape, material, 0.5e-3, 0)
    condensed = condense(wheel, material, 0.5e-3, 0)
    assert condensed.crack is not None
    s = (shape.reference_radius**2 - shape.base_radius**2) / (2 * shape.base_radius)
    own = np.diag(condensed.crack.extra[3, 3, 0, 0])
    added = np.interp(s, condensed.s, own) / wheel.face_width
    sound = tooth_compliance(shape, wheel.hub_radius, wheel.face_width, material, shape.roll([s])).total.item()
    # The lumped model: compliance times 1/(1 - loss).
    assert sound / (1 - loss) - sound == pytest.approx(added, rel=0.01)
    assert "stiffness_loss" in crack_lines(rig(CUT), 0.5e-3, 0)[0]


def test_each_model_takes_its_kind_of_crack() -> None:
    refuse_effects(rig(CUT), "model", represented=ELASTIC_KEYS)
    with pytest.raises(BenchError, match=r"rig\.driver\.crack\.stiffness_loss: give the crack itself, length_mm"):
        refuse_effects(rig(Crack(tooth=3, stiffness_loss=0.2)), "model", represented=ELASTIC_KEYS)
    refuse_unknown(rig(Crack(tooth=3, stiffness_loss=0.2)))
    with pytest.raises(BenchError, match=r"rig\.driven\.crack\.length_mm: give the crack's stiffness_loss"):
        refuse_unknown(rig(None, CUT))


def test_a_crack_passes_once_a_revolution() -> None:
    assert cycles_to_repeat(rig()) == 1
    assert cycles_to_repeat(rig(CUT)) == 20

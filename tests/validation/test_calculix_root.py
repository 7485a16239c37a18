"""Root stress against CalculiX's own nodal stress in the fillets of both gears (calculix/root_stress.py)."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import pytest

from gearbench.fem.body import condense
from gearbench.fem.fields import elastic_gear
from gearbench.fem.law import Law, elastic_pair, make_law
from gearbench.fem.loaded import pair_loads
from gearbench.fem.root import RootKernel, peak, root_kernel, root_stress
from gearbench.rig import Gear, Material, Rig, Support, Supports

pytestmark = pytest.mark.validation

FOLDER = Path(__file__).parent / "calculix"
PAIRS = json.loads((FOLDER / "positions.json").read_text(encoding="utf-8"))["pairs"]
POSITIONS = json.loads((FOLDER / "root_stress.json").read_text(encoding="utf-8"))["positions"]
FINEST = [one for one in POSITIONS if one["size"] == min(other["size"] for other in POSITIONS)]
REACH = 0.01


@cache
def solved(name: str) -> tuple[Law, tuple[RootKernel, RootKernel], Rig]:
    stored = PAIRS[name]["rig"]
    idle = Support(stiffness=1e8)
    rig = Rig(
        centre_distance=stored["centre_distance"],
        driver=Gear(**stored["driver"]),
        driven=Gear(**stored["driven"]),
        material=Material(**stored["material"]),
        support=Supports(driver=idle, driven=idle),
    )
    gears = condense(rig.driver, rig.material, None, 0), condense(rig.driven, rig.material, None, 0)
    kernels = [root_kernel(elastic_gear(gear, rig.material), gear.face_width) for gear in (rig.driver, rig.driven)]
    return make_law(elastic_pair(rig), *gears, rig.material), (kernels[0], kernels[1]), rig


@pytest.mark.parametrize("position", FINEST, ids=[f"{one['pair']}:{one['phase']:+.2f}" for one in FINEST])
def test_largest_tension_of_every_loaded_root(position: dict) -> None:
    law, kernels, rig = solved(position["pair"])
    pairs = pair_loads(law, position["phase"], position["dte"])
    assert len(position["roots"]) == 2 * len(pairs)
    for root in position["roots"]:
        number = ("driver", "driven").index(root["gear"])
        teeth = (rig.driver, rig.driven)[number].teeth
        stress, radius, _ = peak(kernels[number], root_stress(kernels[number], pairs, teeth, number, root["tooth"]))
        assert 1e-6 * stress == pytest.approx(root["stress"], rel=REACH)
        # Where a maximum is flat its place is soft: a tenth of a millimetre is 0.1 % of stress.
        assert 1e3 * radius == pytest.approx(root["radius"], abs=0.1)


@pytest.mark.parametrize("position", FINEST, ids=[f"{one['pair']}:{one['phase']:+.2f}" for one in FINEST])
def test_the_reference_has_converged(position: dict) -> None:
    """Fillets half as coarse again move it by less than a third of what is to be reached."""
    coarser = [one for one in POSITIONS if one["pair"] == position["pair"] and one["size"] > position["size"]]
    assert coarser
    for other in coarser:
        for one, two in zip(position["roots"], other["roots"], strict=True):
            assert one["stress"] == pytest.approx(two["stress"], rel=REACH / 3)

"""Root stress as CalculiX found it in the fillets of both gears (validation/calculix/root_stress.py), and ours."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from gearbench.fem.contact.law import Law, elastic_pair, make_law
from gearbench.fem.gear.body import condense
from gearbench.fem.stress.fields import elastic_gear
from gearbench.fem.stress.loaded import pair_loads
from gearbench.fem.stress.root import RootKernel, peak, root_kernel, root_stress
from gearbench.rig import Gear, Material, Rig, Support, Supports

FOLDER = Path(__file__).parents[1] / "validation" / "calculix"
PAIRS = json.loads((FOLDER / "positions.json").read_text(encoding="utf-8"))["pairs"]
POSITIONS: list[dict[str, Any]] = json.loads((FOLDER / "root_stress.json").read_text(encoding="utf-8"))["positions"]
FINEST = [one for one in POSITIONS if one["size"] == min(other["size"] for other in POSITIONS)]


@dataclass(frozen=True)
class Root:
    """Largest tension [MPa] and its radius [mm] in the fillet of a loaded tooth: CalculiX's and ours."""

    stress: float
    radius: float
    own_stress: float
    own_radius: float


def roots(position: dict[str, Any]) -> list[Root]:
    """The fillets of all loaded teeth of a stored position. Raises ValueError where other teeth carry than with us."""
    law, kernels, rig = solved(position["pair"])
    pairs = pair_loads(law, position["phase"], position["dte"])
    if len(position["roots"]) != 2 * len(pairs):
        raise ValueError(f"{len(pairs)} pairs carry, CalculiX has {len(position['roots'])} roots")
    found = []
    for root in position["roots"]:
        number = ("driver", "driven").index(root["gear"])
        teeth = (rig.driver, rig.driven)[number].teeth
        stress, radius, _ = peak(kernels[number], root_stress(kernels[number], pairs, teeth, number, root["tooth"]))
        found.append(Root(root["stress"], root["radius"], 1e-6 * stress, 1e3 * radius))
    return found


@cache
def solved(name: str) -> tuple[Law, tuple[RootKernel, RootKernel], Rig]:
    """Contact law and roots of a stored pair, at the default mesh."""
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

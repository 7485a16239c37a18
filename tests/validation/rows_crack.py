"""A cracked tooth against the stored CalculiX models."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from gearbench.commands.house.checks import Check
from gearbench.fem.gear.body import condense
from gearbench.fem.gear.elasticity import plane_moduli
from gearbench.fem.gear.patch import patch_compliance
from gearbench.geometry.tooth.profile import profile
from gearbench.rig import Crack, Gear, Material

REFERENCE = Path(__file__).parent / "calculix" / "crack_reference.json"


def stiffness_loss() -> float:
    """Largest relative departure of a cracked tooth's stiffness loss, two gears with three cracks each."""
    worst = 0.0
    for case in json.loads(REFERENCE.read_text(encoding="utf-8"))["cases"].values():
        known = {r["length"]: r["compliance"] for r in case["results"] if r["level"] == 1.0 and r["opening"] == 5e-4}
        material = Material(**case["material"], state=case["state"])
        for length in case["lengths"]:
            crack = Crack(tooth=0, length=length, direction=np.deg2rad(case["direction_deg"]))
            gear = Gear(**case["gear"], crack=crack)
            shape = profile(gear)
            s = (shape.reference_radius**2 - shape.base_radius**2) / (2 * shape.base_radius)
            condensed = condense(gear, material, None, 0)
            sound, added = patch_compliance(condensed, plane_moduli(material), s, case["half_width"])
            worst = max(worst, abs(added / (sound + added) / (1 - known[0.0] / known[length]) - 1))
    return worst


CHECKS = [Check("crack", "stiffness loss of a cracked tooth against CalculiX", 0.01, "1", stiffness_loss)]

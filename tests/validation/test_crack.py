"""Teeth with a root crack against CalculiX; the reference is computed by calculix/make_crack_reference.py, with another
mesher, a notch in place of doubled nodes and tractions in place of kernels."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gearbench.fem.gear.body import condense
from gearbench.fem.gear.elasticity import plane_moduli
from gearbench.fem.gear.patch import patch_compliance
from gearbench.geometry.tooth.profile import profile
from gearbench.rig import Crack, Gear, Material

pytestmark = pytest.mark.validation

CASES = json.loads((Path(__file__).parent / "calculix" / "crack_reference.json").read_text(encoding="utf-8"))["cases"]
ALL = [(name, length) for name, case in CASES.items() for length in case["lengths"]]


def stored(case: dict[str, Any], length: float, level: float = 1.0, opening: float = 5e-4) -> float:
    wanted = {"length": length, "level": level, "opening": opening}
    (found,) = (r for r in case["results"] if all(r[key] == value for key, value in wanted.items()))
    return float(found["compliance"])


@pytest.mark.parametrize(("name", "length"), ALL)
def test_stiffness_loss_of_a_cracked_tooth(name: str, length: float) -> None:
    """Compliance of the sound tooth, what the crack adds, and the loss of stiffness: each within 1 % (found: 0.03 %,
    0.2 % and 0.2 % at most)."""
    case = CASES[name]
    crack = Crack(tooth=0, length=length, direction=np.deg2rad(case["direction_deg"]))
    gear = Gear(**case["gear"], crack=crack)
    material = Material(**case["material"], state=case["state"])
    shape = profile(gear)
    s = (shape.reference_radius**2 - shape.base_radius**2) / (2 * shape.base_radius)
    condensed = condense(gear, material, None, 0)
    sound, added = patch_compliance(condensed, plane_moduli(material), s, case["half_width"])
    before, after = stored(case, 0.0), stored(case, length)
    assert sound == pytest.approx(before, rel=2e-3)
    assert added == pytest.approx(after - before, rel=1e-2)
    assert 1 - sound / (sound + added) == pytest.approx(1 - before / after, rel=1e-2)


def test_the_reference_has_converged() -> None:
    """Elements 0.6 times as large, and a notch a quarter as wide."""
    for name, length in (("z20", 1.5e-3), ("z38", 1.2e-3)):
        case = CASES[name]
        added = [stored(case, length, level) - stored(case, 0.0, level) for level in (1.0, 0.6)]
        assert added[0] == pytest.approx(added[1], rel=2e-3)
    narrow = stored(CASES["z20"], 1.5e-3, opening=1.25e-4)
    assert narrow == pytest.approx(stored(CASES["z20"], 1.5e-3), rel=1e-4)

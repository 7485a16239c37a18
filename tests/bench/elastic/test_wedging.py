"""Static: teeth without backlash and with errors wedge; the backlash that is named frees them."""

from __future__ import annotations

import re

import numpy as np
import pytest

import gearbench as gb
from gearbench.geometry import pair

ERRORS = ["rig.driver.iso_grade=8", "rig.driven.iso_grade=9"]


def said(thinning_um: float) -> tuple[str, float]:
    """Warnings of the static response, and the smallest sum of load shares of the working flanks."""
    settings = [*ERRORS, f"rig.driver.thinning_um={thinning_um}", "rig.driven.thinning_um=0"]
    found = gb.static(gb.read_case("quick_fe", settings), torque=[2.0], positions=2, cycles=20)
    return str(found.attrs.get("warnings", "")), float(found["load_share"].sum("pair").min())


@pytest.mark.validation
def test_wedged_teeth_are_said_and_the_backlash_named_frees_them() -> None:
    words, least = said(0.0)
    assert "the teeth wedge" in words and least < 0.9
    needed = float(re.search(r"normal backlash of ([\d.]+) um", words)[1])  # type: ignore[index]
    # Thinning takes from the transverse arc: the normal backlash is that times the cosine of the pressure angle.
    meshing = pair(gb.read_case("quick_fe").rig)
    arc = needed / np.cos(meshing.working_pressure_angle)
    assert said(1.01 * arc) == ("", 1.0)
    assert "the teeth wedge" in said(0.5 * arc)[0]

"""Where contact begins and ends on gears that run out, against the contact of gears whose centres are displaced."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.effect_rig import ALPHA, make_model, make_rig
from shared.ends_of_contact import last_on_line

from gearbench.geometry import pair
from gearbench.lumped.nonlinear.ends import ends_of, turnings

ECCENTRICITY = 10e-6


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("rotation", [0.0, 1.1, 2.3, 4.0])
def test_ends_of_contact_are_those_of_displaced_gears(side: int, rotation: float) -> None:
    """`rotation` beyond the phase of the run-out; first order in the eccentricity over the line of action, 1e-3."""
    meshing = pair(make_rig())
    assert meshing.working_pressure_angle == pytest.approx(ALPHA)
    model = replace(make_model(make_rig()), path=meshing.path)
    alpha = meshing.working_pressure_angle
    polar = (np.pi / 2 - alpha + rotation, -np.pi / 2 - alpha - rotation)[side]
    off = ECCENTRICITY * np.array([np.cos(polar), np.sin(polar)])
    still = np.array([meshing.centre_distance, 0.0])
    found = []
    for low, high in ((-0.3, meshing.path[0] - 0.1), (0.3, meshing.path[1] + 0.1)):
        places = still, still + (2 * side - 1) * off
        centred, displaced = (last_on_line(meshing, lambda *_, at=at: (at[0], at[1]), low, high)[1] for at in places)
        # The mesh is turned back by as much as contact begins or ends later.
        found.append((centred - displaced) / meshing.driven.pitch_angle)
    proud, leant = ECCENTRICITY * np.cos(rotation), (2 * side - 1) * ECCENTRICITY * np.sin(rotation)
    turned = turnings(np.array(meshing.path), ends_of(model)) @ (proud, leant)
    np.testing.assert_allclose(turned, found, atol=4e-3 * ECCENTRICITY / meshing.base_pitch)


def test_between_the_ends_the_mesh_turns_linearly() -> None:
    model = make_model(make_rig())
    begin, end = model.path
    for part in (0.0, 0.25, 0.5, 1.0):
        here = turnings(np.array([begin + part * ((end - begin) % 1.0)]), ends_of(model))[0]
        assert here[0] * model.law.base_pitch == pytest.approx(-part, abs=1e-12)

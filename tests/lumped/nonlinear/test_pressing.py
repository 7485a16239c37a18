"""What the mesh carries at an instant: arrays against the compiled loop of the integrator, which stands apart."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.bench.nonlinear.law_table import mesh_law
from gearbench.cases import case_files
from gearbench.geometry import pair
from gearbench.lumped.nonlinear.forces import apart_of, entry, mesh
from gearbench.lumped.nonlinear.model import nonlinear_model
from gearbench.lumped.nonlinear.pressing import pressed
from gearbench.lumped.nonlinear.tables import Motion, instants, tables
from gearbench.rig import read_case

ERRORS = [f"rig.mesh.{key}" for key in ("error_mean_um=-7", "error_cos_um=[2.0]", "error_sin_um=[0.0]")]


@pytest.mark.parametrize("uneven", [False, True])
def test_flanks_of_both_sides_carry_what_the_integrator_has(uneven: bool) -> None:
    """Errors stand on the working flanks and leave the back ones where they are; run-out moves both."""
    case = read_case(case_files()["gap_demo"], [*ERRORS, "rig.driver.runout_um=12"])
    gear = case.rig.driver
    if uneven:
        gear = gear.model_copy(update={"pitch_error": tuple(3e-6 * np.cos(np.arange(gear.teeth)))})
    rig = case.rig.model_copy(update={"driver": gear})
    law = mesh_law(rig, case.simulation, 200.0)
    model = nonlinear_model(rig, pair(rig), law)
    table = tables(model, Motion(cycles=7.0, entries=240, step=1e-4, first_phase=0.3))
    phase = table.position[:-1] / law.phases
    at = instants(model, table, -1)
    secant, constants, apart = np.ascontiguousarray(law.secant), model.constants(), apart_of(table, law)
    sides = set()
    for travel in (law.approach[-1] + 20e-6, 12e-6, -0.2 * law.backlash, -law.backlash + 3e-6, -law.backlash - 9e-6):
        found = pressed(law, at, np.full(phase.size, travel)).force
        wanted = [mesh(travel, -table.excess_rate[i], entry(table, i), secant, apart, constants) for i in range(240)]
        sides |= set(np.sign(wanted))
        # The back flanks' damping takes the rate of the deflection alone.
        still = [mesh(travel, 0.0, entry(table, i), secant, apart, constants) for i in range(240)]
        expected = np.where(np.array(still) < 0.0, still, wanted)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    assert sides == {-1.0, 0.0, 1.0}

"""Forces that a simulated rig lacks: at the place where the measured one differs, and nowhere for what both have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr

from gearbench.bench import simulate
from gearbench.bench.nonlinear.replay import replay
from gearbench.cases import case_files
from gearbench.diagnosis.evidence.problem import Problem, problem_of
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.intake.measurements import measurement
from gearbench.diagnosis.remainder.missing import Missing, missing_forces
from gearbench.rig import Case, Housing, Ripple, read_case


@dataclass(frozen=True)
class Bench:
    nominal: Case
    record: xr.Dataset

    def with_rig(self, **update: object) -> Case:
        return self.nominal.model_copy(update={"rig": self.nominal.rig.model_copy(update=update)})

    def missing(self, real: Case, simulated: Case) -> Missing:
        """Of a simulated rig in a record of the real one."""
        measured = measurement(replay(real, self.record), "base", self.nominal)
        problem: Problem = problem_of([measured], self.nominal)
        return missing_forces(problem, self.nominal, [measured], lambda one: replay(simulated, one.record))


@pytest.fixture(scope="module")
def bench() -> Bench:
    case = read_case(case_files()["gap_demo"], ["condition.0.multisine.amplitude_nm=20"])
    nominal = case.under(case.conditions[0])
    return Bench(nominal, simulate(nominal))


@pytest.mark.parametrize("place", ["driver-support", "drive", "mesh"])
def test_what_differs_is_missing_at_its_own_place(bench: Bench, place: str) -> None:
    rig = bench.nominal.rig
    softer = rig.support.driver.model_copy(update={"stiffness": 0.85e8})
    ripple = Ripple(orders=(7, 33), amplitude=(8.0, 8.0), phase=(0.2, 0.4))
    changed = {
        "driver-support": {"support": rig.support.model_copy(update={"driver": softer})},
        "drive": {"drive": rig.drive.model_copy(update={"ripple": ripple})},
        "mesh": {"mesh": rig.mesh.model_copy(update={"stiffness_cos": (0.3,)})},
    }[place]
    found = bench.missing(bench.with_rig(**changed), bench.nominal)
    assert PLACES[int(np.argmax(found.shares))] == place and found.shares.sum() == pytest.approx(1.0)
    assert found.shares.max() > 0.6
    if place == "drive":  # 8 N m at either order, over the base radius: rms of both together
        radius = 0.5 * 0.06 * np.cos(np.radians(20))
        assert found.in_band((0.0, 3000.0))[PLACES.index("drive")] == pytest.approx(8.0 / radius, rel=0.1)


def test_a_housing_that_both_have_is_not_missing(bench: Bench) -> None:
    housed = bench.with_rig(housing=Housing(mass=40.0, stiffness=1.67e9, damping=2e4))
    assert bench.missing(housed, housed).excess.max() < 1e-6
    lacking = bench.missing(housed, bench.nominal)
    assert lacking.shares[[PLACES.index(f"{gear}-support") for gear in ("driver", "driven")]].sum() > 0.6

"""The static response of a lumped pair against statics."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.bench import BenchError
from gearbench.bench.statics import static
from gearbench.cases import case_path
from gearbench.geometry import pair
from gearbench.rig import Case, read_case


@pytest.fixture(scope="module")
def case() -> Case:
    settings = ["simulation.mesh_stiffness=rectangular", "simulation.stiffness_edge=0"]
    settings += ["simulation.stiffness_single_n_per_m=2e8", "simulation.stiffness_double_n_per_m=3e8"]
    return read_case(case_path("paper_lumped"), settings)


def test_torque_over_base_radius_is_stiffness_times_deflection(case: Case) -> None:
    found = static(case, torque=[100.0, 250.0], positions=90)
    base_radius = 0.062 * np.cos(np.radians(20))
    deflections = [torque / base_radius / k for torque in (100.0, 250.0) for k in (2e8, 3e8)]
    error = found["transmission_error"].values
    assert np.unique(error.round(15)) == pytest.approx(sorted(deflections), rel=1e-9)
    # One pair carries around the pitch point, for 2 - contact ratio of the cycle.
    single = error[0] == error[0].max()
    assert single[0] and single[-1] and not single[45]
    assert single.mean() == pytest.approx(2 - pair(case.rig).contact_ratio, abs=1 / 90)
    assert found["torque"].values[1] == pytest.approx(np.full(90, 250.0))
    assert (found["load"].attrs["units"], found.attrs["schema"]) == ("N m", "gearbench-static/1")


def test_dte_loads_give_the_torque_that_they_need(case: Case) -> None:
    found = static(case, dte=[1e-6], positions=8)
    assert found["transmission_error"].values == pytest.approx(np.full((1, 8), 1e-6))
    assert found["torque"].values[0, 0] == pytest.approx(
        2e8 * 1e-6 * 0.062 * np.cos(np.radians(20)), rel=1e-12
    )
    assert found["load"].attrs["units"] == "m"


def test_default_load_is_the_mean_torque(case: Case) -> None:
    assert static(case, positions=4)["load"].values == [case.experiment.torque_mean]


@pytest.mark.parametrize(
    ("loads", "words"),
    [
        ({"torque": [1.0], "dte": [1e-6]}, "one kind"),
        ({"torque": [0.0]}, "torque_nm = 0 must be finite and greater than 0"),
        ({"dte": [float("nan")]}, "dte_um = nan"),
        ({"positions": 1}, "positions = 1 must be at least 2"),
        ({"model": "cast-iron"}, "cast-iron"),
    ],
)
def test_bad_loads_are_refused(case: Case, loads: dict, words: str) -> None:
    with pytest.raises(BenchError, match=words):
        static(case, **loads)

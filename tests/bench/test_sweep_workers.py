"""Both directions of a sweep side by side: the same bits on any number of threads, each direction begun at rest."""

from __future__ import annotations

import numpy as np
import pytest
from shared.rectangular import NONLINEAR

from gearbench.bench import BenchError
from gearbench.bench import sweep as sweep_module
from gearbench.bench.sweep import sweep
from gearbench.cases import case_path
from gearbench.rig import read_case

SETTINGS = (
    *NONLINEAR,
    "rig.support.stiffness_n_per_m=1e9",
    "rig.support.damping_n_s_per_m=2e4",
    "rig.damping.mesh_ratio=0.1",
)
SPEEDS = [150.0, 200.0, 260.0]  # below resonance: one answer at every speed


def test_it_is_the_same_on_any_number_of_workers() -> None:
    case = read_case(case_path("rig_62"), SETTINGS)
    heard: list[float] = []
    one = sweep(case, SPEEDS, progress=lambda fraction, note: heard.append(fraction), workers=1)
    for workers in (2, 5, None):
        other = sweep(case, SPEEDS, workers=workers)
        assert other.identical(one)
    assert heard == sorted(heard) and 0.8 < heard[-1] < 1.0
    up, down = one["dte_rms"].values
    assert np.ptp(up) > 0.2 * up.min()  # or the order of speeds would not show
    assert down == pytest.approx(up, rel=2e-3)
    with pytest.raises(BenchError, match="workers = 0 must be at least 1"):
        sweep(case, SPEEDS, workers=0)


def test_a_direction_that_fails_ends_the_other_one(monkeypatch: pytest.MonkeyPatch) -> None:
    case = read_case(case_path("rig_62"), SETTINGS)
    begun: list[float] = []
    whole = sweep_module._look

    def look(*given: object) -> object:
        begun.append(float(given[2]))  # type: ignore[arg-type]
        if given[2] == SPEEDS[-1]:
            raise BenchError("no contact at the highest speed")
        return whole(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(sweep_module, "_look", look)
    with pytest.raises(BenchError, match="no contact at the highest speed"):
        sweep(case, [*np.linspace(20.0, 100.0, 40), SPEEDS[-1]], workers=2)
    assert len(begun) < 20  # of the 41 upwards

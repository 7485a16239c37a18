"""How long a sweep waits for free vibrations: as long as they take, up to a limit that it states."""

from __future__ import annotations

from math import exp

import pytest
from shared.rectangular import NONLINEAR

from gearbench.bench import sweep as sweep_module
from gearbench.bench.sweep import CYCLES, SAMPLES, TRANSIENT, sweep, waiting
from gearbench.cases import case_path
from gearbench.rig import read_case

SETTINGS = (
    *NONLINEAR,
    "rig.support.stiffness_n_per_m=1e9",
)


@pytest.mark.parametrize("settling", [3.0, 40.0, 900.0])
def test_free_vibrations_die_out_within_the_wait(settling: float) -> None:
    rate = 64000.0
    wait = waiting(settling, rate)
    look = SAMPLES * CYCLES / rate
    assert exp(-settling * wait * look) <= TRANSIENT < exp(-settling * (wait - 1) * look) or wait == 1


def test_a_rig_that_hardly_damps_is_not_waited_for_and_that_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep_module, "WAIT", 3)
    monkeypatch.setattr(sweep_module, "LOOKS", 2)
    heard: list[float] = []

    def listening(settling: float, rate: float) -> int:
        heard.append(settling)
        return waiting(settling, rate)

    monkeypatch.setattr(sweep_module, "waiting", listening)
    weak = read_case(case_path("rig_62"), [*SETTINGS, "rig.support.damping_n_s_per_m=10"])
    found = sweep(weak, [200.0, 210.0])
    # Equal gears on equal supports: both centres together swing beside the mesh, and die out at c/(2 m).
    assert heard == pytest.approx([10.0 / (2 * 1.736)] * 4, rel=1e-6)
    assert "at 4 of 4 speeds" in found.attrs["warnings"] and "48 mesh periods" in found.attrs["warnings"]
    stiff = ("rig.support.damping_n_s_per_m=2e4", "rig.damping.mesh_ratio=0.1")
    strong = read_case(case_path("rig_62"), [*SETTINGS, *stiff])
    assert sweep(strong, [200.0, 210.0]).attrs["warnings"] == ""

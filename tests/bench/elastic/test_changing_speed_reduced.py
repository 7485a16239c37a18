"""Run-ups of the reduced model: balances of momentum and energy, and beside the lumped model on the same tables."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest
from shared.twins import HEAVY, supports, twin_case

from gearbench.bench.experiment import simulate
from gearbench.rig import Case

RUN_UP = """speed_table = { time_s = [0.05, 0.2], driver_rpm = [60.0, 600.0] }
sampling_rate_hz = 4096.0
samples_per_period = 1024
"""
SHAFT = "{inertia_kg_m2=2e-3, stiffness_nm_per_rad=2e4, damping_nm_s_per_rad=20.0}"
FREE = "rig.load.boundary=torque"
RIGS: dict[str, tuple[str, ...]] = {
    "held load": (),
    "held drive": (FREE, "rig.drive.boundary=speed"),
    "free": (FREE,),
    "free, shaft of the load": (FREE, f"rig.load.coupling={SHAFT}"),
    "held load, both shafts": (f"rig.load.coupling={SHAFT}", f"rig.drive.coupling={SHAFT}"),
}
FIRST, LAST = 60 * pi / 30, 600 * pi / 30


def make_case(tmp_path: Path, *settings: str) -> Case:
    return twin_case(tmp_path, *HEAVY, *supports("2e8", "2e4"), *settings, experiment=RUN_UP)


@pytest.mark.parametrize("rig", sorted(RIGS))
def test_momentum_energy_and_the_lumped_model(tmp_path: Path, rig: str) -> None:
    case = make_case(tmp_path, *RIGS[rig])
    found, lumped = simulate(case), simulate(case, "lumped")
    time = found["time"].values
    one, two = (found[f"torque_{gear}"].values[0] for gear in ("driver", "driven"))
    inertia = 4e-3 + 2e-3 * sum("coupling" in setting for setting in RIGS[rig])
    assert np.trapezoid(one - two, time) == pytest.approx(inertia * (LAST - FIRST), rel=0.02)
    if FREE in RIGS[rig] and "drive" not in rig:
        # Torques at free ends do not ring, so that samples of them tell the work: it becomes kinetic energy.
        speed = np.interp(time, [0.05, 0.2], [FIRST, LAST])
        work = np.trapezoid((one - two) * speed, time)
        assert work == pytest.approx(0.5 * inertia * (LAST**2 - FIRST**2), rel=0.01)
    for name in ("torque_driver", "torque_driven", "dte", "y_driver", "mesh_phase"):
        same, other = (record[name].values[0][100:] for record in (found, lumped))
        assert same.mean() == pytest.approx(other.mean(), rel=2e-3), name
    slow = slice(None, 200)  # before the table's first entry
    same, other = (record["dte"].values[0][slow] for record in (found, lumped))
    # Handovers ring in shafts.
    assert np.std(same - other) < (0.1 if "shaft" in rig else 2e-2) * np.ptp(other)
    for gear in ("driver", "driven"):
        apart = found[f"angle_{gear}"].values[0] - lumped[f"angle_{gear}"].values[0]
        assert np.abs(apart).max() < (5e-5 if "shaft" in rig else 2e-5)  # 2 % of what the shafts twist


def test_viscous_friction_grows_with_the_speed_as_in_the_lumped_model(tmp_path: Path) -> None:
    """Far below v0 friction is proportional to the sliding speed of the moment."""
    rough = ("rig.friction.coefficient=0.3", "rig.friction.transition_speed_m_per_s=1")
    lost = []
    for model in ("reduced", "lumped"):
        records = [simulate(make_case(tmp_path, *more), model) for more in ((), rough)]
        lost.append(np.subtract(*(record["torque_driven"].values[0] for record in records)))
    fast = slice(-100, None)
    reduced, lumped = (one[fast].mean() for one in lost)
    assert reduced == pytest.approx(lumped, rel=0.05)
    assert reduced > 5 * lost[0][slice(0, 200)].mean() > 0

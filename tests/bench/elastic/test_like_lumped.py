"""The reduced model against the non-linear lumped one on the same finite-element tables, slowly turning.

Both have every effect from their own equations. At handovers they differ by what lumped pairs cannot do (they share one
spring, and know no tilt of the normal at tip edges): 0.15 % of the swing of the dte without any effect.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shared.twins import supports, twin_case

from gearbench.bench.experiment import simulate

SUPPORTS = supports("2e8", "2e4")
SHAFT = "{inertia_kg_m2=0.01, stiffness_nm_per_rad=2e4, damping_nm_s_per_rad=20.0}"
RIPPLE = "rig.drive.ripple={orders=[20], amplitude_nm=[5.0], phase_deg=[20.0]}"
SIDE = "{stiffness_n_per_m=1e8, damping_n_s_per_m=1e4, coupling_n_per_m=2e7}"
ROCKING = "{mass_kg=20.0, stiffness_n_per_m=8e8, damping_n_s_per_m=3e5, driver_share=1.0, driven_share=-0.6}"
SEATED = "{mass_kg=20.0, stiffness_n_per_m=1e8, damping_n_s_per_m=1e5, driven_share=0.3, sensor_share=0.8}"
OBLIQUE = "{mass_kg=20.0, stiffness_n_per_m=8e8, damping_n_s_per_m=2e5, driven_share=-0.3, driver_share_across=0.7}"
SIDEWAYS = "rig.housing.sensor_share=1.0"

# Settings, bound of the difference of means, and of the rms of the swings over their range.
EFFECTS: dict[str, tuple[list[str], float, float]] = {
    "friction": (["rig.friction.coefficient=0.08"], 5e-4, 5e-3),
    "exponent": (["rig.support.driver.exponent=0.5"], 5e-4, 3e-3),
    "ripple": ([f"rig.drive.coupling={SHAFT}", RIPPLE], 5e-4, 3e-3),
    "series": (["rig.mesh.stiffness_cos=[0.1]", "rig.mesh.stiffness_sin=[0.05]"], 5e-4, 3e-3),
    "error": (["rig.mesh.error_cos_um=[1.0]", "rig.mesh.error_sin_um=[0.5]", "rig.mesh.error_mean_um=2.0"], 5e-4, 3e-3),
    "shaft": ([f"rig.load.coupling={SHAFT}"], 5e-4, 3e-3),
    "housing": (["rig.housing={mass_kg=20.0, stiffness_n_per_m=1e8, damping_n_s_per_m=1e5}"], 5e-4, 3e-3),
    "rocking": ([f"rig.housing={ROCKING}"], 5e-4, 3e-3),
    "oblique": ([f"rig.housing={OBLIQUE}", f"rig.support.driver.across={SIDE}", SIDEWAYS], 2e-3, 1e-2),
    "seated": ([f"rig.housing={SEATED}"], 5e-4, 3e-3),
    # Teeth that bear 800 N in the mean: the force at which nothing changes lies far below.
    "hardening": (["rig.mesh.exponent=0.2", "rig.mesh.reference_force_n=300"], 5e-4, 3e-3),
    "across": ([f"rig.support.driver.across={SIDE}"], 2e-3, 1e-2),
    "held": (["rig.load.boundary=torque", "rig.drive.boundary=speed"], 5e-4, 4e-3),
    "held by a shaft": (
        [f"rig.drive.coupling={SHAFT}", "rig.load.boundary=torque", "rig.drive.boundary=speed"], 5e-4, 4e-3
    ),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("case")


@pytest.mark.parametrize("effect", sorted(EFFECTS))
def test_both_models_have_the_same_effect(folder: Path, effect: str) -> None:
    settings, mean, swing = EFFECTS[effect]
    case = twin_case(folder, *SUPPORTS, *settings)
    found, lumped = simulate(case), simulate(case, "lumped")
    channels = {"dte", "y_driver", "y_driven", "torque_driven", "torque_driver", "x_driver"} & set(lumped.data_vars)
    for name in sorted(channels):
        one, two = found[name].values[0], lumped[name].values[0]
        size = np.abs(two.mean())
        # The tilt of the normal at tip edges is felt across the supports before all.
        bound = 5 * mean if name == "x_driver" else mean
        assert one.mean() == pytest.approx(two.mean(), abs=bound * size, rel=0), name
    one, two = (record["dte"].values[0] for record in (found, lumped))
    assert np.std(one - two) < swing * np.ptp(two)
    assert found.attrs["divided_steps"] == 0 and "friction acts on the hubs" in found.attrs["limits"]


@pytest.mark.parametrize("stiffness", ["2e7", "1e7"])
def test_soft_supports_turn_the_mesh_on(folder: Path, stiffness: str) -> None:
    """Centres that move turn the line between them, and the contact with it: else 14 and 27 % of the dte are off."""
    case = twin_case(folder, *supports(stiffness, "2e4"))
    one, two = (simulate(case, model)["dte"].values[0] for model in ("reduced", "lumped"))
    assert np.std(one - two) < 5e-3 * np.std(one)


def test_free_gears_keep_their_mean_speed(folder: Path) -> None:
    """The load takes up what friction and contact off the line of action take: both gears turn on at their speeds."""
    shaft = f"rig.load.coupling={SHAFT}"
    case = twin_case(folder, *SUPPORTS, "rig.load.boundary=torque", "rig.friction.coefficient=0.08", shaft)
    record = simulate(case)
    angle, time = record["angle_driven"].values[0], record["time"].values
    speed = np.polyfit(time, angle, 1)[0]
    assert speed == pytest.approx(2 * np.pi * 4.0 / 20, rel=1e-3)
    load = record["torque_driven"].values[0]
    # Friction of the tooth pairs: a percent or so of the torque on either side of the pitch point.
    assert load.mean() == pytest.approx(50.0, rel=2e-2) and np.ptp(load) > 0.5

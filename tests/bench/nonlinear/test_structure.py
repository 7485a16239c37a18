"""Experiments on rigs with structure: channels, boundaries, drift, and replays of their records."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from shared.small_case import small_case

from gearbench.bench import BenchError, simulate
from gearbench.bench.nonlinear.replay import replay
from gearbench.records import validate_record
from gearbench.records.transmission_error import dte_of_channels, force_of_torques
from gearbench.rig import (
    Across,
    Case,
    Coupling,
    Drive,
    Friction,
    Housing,
    Load,
    MeshCorrection,
    OutputShaft,
    Sensors,
    Support,
    Supports,
)

SAMPLES, RATE = 1536, 5120.0
ACROSS = Across(stiffness=1.2e8, damping=2e3, coupling=-1e7)
FULL: dict[str, Any] = {
    "support": Supports(
        driver=Support(stiffness=1e8, damping=3e3, across=ACROSS), driven=Support(stiffness=1.3e8, damping=3e3)
    ),
    "housing": Housing(mass=20.0, stiffness=8e8, damping=4e3),
    "drive": Drive(coupling=Coupling(inertia=2e-3, stiffness=3e4, damping=1.0)),
    "load": Load(coupling=OutputShaft(stiffness=4e4, damping=2.0)),
    "friction": Friction(coefficient=0.04),
}


def make_case(experiment: dict[str, Any] | None = None, **rig: Any) -> Case:
    settling = {"settling_tolerance": 1e-7, "settling_periods_max": 50}
    return small_case(experiment=settling | (experiment or {}), **rig)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_sensors_on_the_housing_show_the_supports_deflection(share: float) -> None:
    """Slowly turned, a support of 1e8 N/m deflects by its force; the housing's rocking is that of both over 2e8 N/m."""
    housing = Housing(mass=2.0, stiffness=2e8, damping=1e5, driver_share=1.0, driven_share=-0.5, sensor_share=share)
    supports = Supports(driver=Support(stiffness=1e8, damping=3e4), driven=Support(stiffness=1.3e8, damping=3e4))
    case = make_case({"mesh_frequency": 20.0, "multisine": None}, support=supports, housing=housing)
    record = simulate(case)
    push = np.cos(case.rig.driver.pressure_angle) * 100.0 / record.attrs["base_radius_driver"]
    rocked = push * (-0.5 - 1.0) / 2e8
    feet = {"y_driver": -push / 1e8 + (1.0 - share) * rocked, "y_driven": push / 1.3e8 - 0.5 * (1.0 - share) * rocked}
    for name, value in feet.items():
        assert record[name].values.mean() == pytest.approx(value, rel=2e-3), name
    np.testing.assert_allclose(record["dte"].values, dte_of_channels(record).values, atol=1e-12)


def test_a_record_has_the_motion_across_and_its_dte_too() -> None:
    record = simulate(make_case(**FULL))
    validate_record(record)
    assert np.ptp(record["x_driver"].values) > 1e-7 and not record["x_driven"].values.any()
    np.testing.assert_allclose(record["dte"].values, dte_of_channels(record).values, atol=1e-12)
    assert "across" not in record.attrs["limits"] and "centres move along" in record.attrs["limits"]
    along = simulate(
        make_case(**{**FULL, "support": Supports(driver=Support(stiffness=1e8), driven=Support(stiffness=1e8))})
    )
    assert "x_driver" not in along


@pytest.mark.parametrize(
    "coupling", [None, OutputShaft(inertia=0.01), OutputShaft(inertia=0.01, stiffness=3e4, damping=2.0)]
)
def test_a_free_load_swings_about_its_steady_rotation(coupling: OutputShaft | None) -> None:
    case = make_case(load=Load(boundary="inertia", coupling=coupling), friction=Friction(coefficient=1e-9))
    record = simulate(case)
    np.testing.assert_allclose(record["torque_driven"].values, 150.0, rtol=1e-6)
    time = record["time"].values
    for gear, teeth in (("driver", 20), ("driven", 30)):
        swing = record[f"angle_{gear}"].values[0] - 2 * np.pi * 200 / teeth * time
        first, second = swing.reshape(2, -1)
        np.testing.assert_allclose(second, first, atol=1e-4 * np.ptp(first))
    # All inertias together, under what the multisine adds to the mean torque.
    r1, r2 = record.attrs["base_radius_driver"], record.attrs["base_radius_driven"]
    inertias = 5e-4 / r1**2, (3e-3 + (coupling.inertia if coupling else 0.0)) / r2**2
    swing1 = r1 * (record["angle_driver"].values[0, :SAMPLES] - 2 * np.pi * 200 / 20 * time[:SAMPLES])
    swing2 = r2 * (record["angle_driven"].values[0, :SAMPLES] - 2 * np.pi * 200 / 30 * time[:SAMPLES])
    torque = np.fft.rfft(record["torque_driver"].values[0, :SAMPLES])
    if coupling is None or coupling.stiffness is None:
        centre = np.fft.rfft(inertias[0] * swing1 + inertias[1] * swing2)
        line = slice(6, 400)
        omega = 2 * np.pi * np.fft.rfftfreq(SAMPLES, 1 / RATE)[line]
        np.testing.assert_allclose(
            -(omega**2) * centre[line] * r1, torque[line], atol=1e-4 * np.abs(torque[line]).max()
        )


def test_at_a_driver_of_prescribed_speed_the_driver_torque_is_the_reaction() -> None:
    fields = {"drive": Drive(boundary="speed"), "load": Load(boundary="torque")}
    record = simulate(make_case({"multisine": None}, **fields))
    assert record["torque_driver"].values.mean() == pytest.approx(100.0, rel=1e-3)
    assert np.ptp(record["torque_driver"].values) > 1.0
    np.testing.assert_array_equal(record["torque_driven"].values, 150.0)
    np.testing.assert_allclose(record["angle_driver"].values[0], 2 * np.pi * 10 * record["time"].values, atol=1e-12)
    assert np.ptp(record["dte"].values) > 1e-7
    np.testing.assert_allclose(record["force"].values, force_of_torques(record).values, rtol=1e-9)
    with pytest.raises(BenchError, match=r'a replay imposes .* rig\.drive\.boundary = "speed"'):
        replay(make_case({"multisine": None}, **fields), record)


def test_a_constant_torque_on_a_free_end_is_a_torque_without_multisine() -> None:
    fields = {"load": Load(boundary="torque"), "mesh": MeshCorrection(stiffness_scale=0.9)}
    one, two = (
        simulate(make_case({"multisine": None}, **fields, drive=Drive(boundary=boundary)))
        for boundary in ("torque", "inertia")
    )
    assert one["dte"].values.tobytes() == two["dte"].values.tobytes()


def test_the_mesh_drifts_from_its_first_to_its_last_stiffness() -> None:
    # So slow a mesh rests at every instant: its deflection is force over stiffness.
    slow = {"multisine": None, "mesh_frequency": 10.0, "settling_periods_max": 200}
    drifting, steady = (
        simulate(make_case(slow, mesh=MeshCorrection(stiffness_scale=0.9, stiffness_drift=drift)))["dte"].values[0]
        for drift in (-0.2, 0.0)
    )
    passed = np.arange(drifting.size) / (drifting.size - 1)
    expected = steady / (1 - 0.2 * passed)
    np.testing.assert_allclose(drifting, expected, atol=2e-3 * steady.mean())
    assert drifting[-512:].mean() > 1.2 * drifting[:512].mean()


SEEN = Sensors(
    delay_y_driver=60e-6,
    delay_torque_driver=40e-6,
    filter=2300.0,
    gain_torque_driver=1.03,
    gain_torque_driven=0.98,
    encoder_runout_driver=15e-6,
    encoder_runout_driver_phase=0.7,
)


def differs(found: xr.Dataset, record: xr.Dataset) -> float:
    """Largest departure from the record's beginning, over each channel's range."""
    stop, worst = found.sizes["time"], 0.0
    assert set(found.data_vars) == set(record.data_vars)
    for name in found.data_vars:
        expected = record[name].values[0, :stop]
        worst = max(worst, float(np.abs(found[name].values[0] - expected).max() / max(np.ptp(expected), 1e-12)))
    return worst


@pytest.mark.parametrize("load", ["speed", "torque", "inertia"])
def test_a_rig_with_structure_and_its_sensors_is_replayed(load: str) -> None:
    shaft = OutputShaft(inertia=5e-3, stiffness=4e4, damping=2.0)
    case = make_case(**{**FULL, "load": Load(boundary=load, coupling=shaft)}, sensors=SEEN)
    record = simulate(case)
    assert differs(replay(case, record), record) < 2e-5
    other = make_case(**{**FULL, "load": Load(boundary=load, coupling=shaft), "housing": None}, sensors=SEEN)
    assert differs(replay(other, record), record) > 1e-3
    assert record["y_driver"].attrs["filter_hz"] == 2300.0
    assert record["y_driver"].attrs["delay"] == pytest.approx(5.126 / (2 * np.pi * 2300.0), rel=1e-3)


def test_a_drift_is_replayed_over_the_whole_record() -> None:
    case = make_case(mesh=MeshCorrection(stiffness_drift=0.03), sensors=Sensors(delay_y_driver=60e-6))
    record = simulate(case)
    found = replay(case, record)
    assert found.sizes["time"] == record.sizes["time"]
    assert differs(found, record) < 1e-4
    first, second = record["dte"].values[0].reshape(2, -1)
    assert np.abs(first - second).max() > 0.005 * np.ptp(first)

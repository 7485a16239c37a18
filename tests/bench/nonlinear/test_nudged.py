"""A replay whose driver is nudged towards its recorded motion: nothing where the rig is the record's, on the record's
way where it is another whose flanks part, and led altogether by a damper without limit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from shared.small_case import small_case

from gearbench.bench import simulate
from gearbench.bench.nonlinear.replay import replay, steady_motion
from gearbench.rig import (
    Case,
    Coupling,
    Drive,
    Friction,
    Load,
    Multisine,
    OutputShaft,
    Sensors,
    Support,
    Supports,
)

MESH = 4e8  # stiffness of the mesh, about [N/m]


def make_case(swing: float, **rig: Any) -> Case:
    """A case whose torque swings by so much [N m]."""
    experiment = {
        "sampling_rate": 20480.0,
        "samples_per_period": 6144,
        "periods": 1,
        "realisations": 1,
        "settling_tolerance": 1e-9,
        "settling_periods_max": 50,
        "multisine": Multisine(amplitude=swing, band=(20.0, 2000.0), crest=2.2),
    }
    rest = {"drive": Drive(coupling=Coupling(inertia=2e-3)), "friction": Friction(coefficient=0.05)} | rig
    return small_case({"inertia": 4e-4, "runout": 6e-6}, experiment=experiment, **rest)


# As stiff as the mesh where the driver and its rotor vibrate on it [N s/m].
DAMPER = float(np.sqrt(MESH * (4e-4 + 2e-3)) / (30e-3 * np.cos(np.radians(20.0))))


def swing(record: xr.Dataset, channel: str) -> np.ndarray:
    values = record[channel].values[0]
    if channel.startswith("angle"):
        values = values - 2 * np.pi * record.mesh_phase.values[0] / record.attrs["teeth_" + channel.split("_")[1]]
    return np.asarray(values - values.mean())


def off(found: xr.Dataset, record: xr.Dataset, channel: str) -> float:
    """Rms by which a channel's swing is off, over that of the record."""
    true = swing(record, channel)
    return float(np.std(swing(found, channel) - true) / np.std(true))


@pytest.mark.parametrize(
    "rig",
    [
        {},
        {"drive": Drive(coupling=Coupling(inertia=2e-3, stiffness=4e4, damping=1.0))},
        {"load": Load(boundary="torque")},
        {"load": Load(coupling=OutputShaft(inertia=2e-3, stiffness=4e4, damping=1.0))},
    ],
    ids=["speed", "elastic coupling", "torque", "elastic shaft"],
)
def test_the_rig_of_the_record_needs_no_nudge(rig: dict[str, Any]) -> None:
    case = make_case(20.0, **rig)
    record = simulate(case)
    nudged, free = (replay(case, record, nudge=nudge) for nudge in (DAMPER, 0.0))
    for channel in ("angle_driver", "y_driver", "torque_driven", "dte"):
        assert off(free, record, channel) < 1e-4, channel
        # Between its samples the record's motion is a trigonometric sum.
        assert off(nudged, record, channel) < 1e-3, channel


def test_what_the_drivers_sensor_does_is_taken_off_the_motion_that_nudges() -> None:
    sensors = Sensors(delay_angle_driver=80e-6, encoder_runout_driver=2e-4, encoder_runout_driver_phase=0.7)
    case = make_case(20.0, sensors=sensors)
    record = simulate(case)
    nudged = replay(case, record, nudge=10 * DAMPER)
    for channel in ("angle_driver", "torque_driven"):
        assert off(nudged, record, channel) < 2e-3, channel


def test_a_rattling_rig_that_is_a_little_off_stays_on_the_records_way() -> None:
    """Free, impacts that are met otherwise leave a motion of its own; damping and backlash are those of the record."""
    record = simulate(make_case(150.0))
    lost = record.attrs["contact_lost_samples"] / record.sizes["time"]
    assert lost > 0.05
    other = make_case(150.0, support=Supports(driver=Support(stiffness=1.05e8, damping=3e3), driven=Support(
        stiffness=0.96e8, damping=3.3e3)))  # fmt: skip
    left = {}
    for nudge in (0.0, DAMPER):
        found = replay(other, record, nudge=nudge)
        left[nudge > 0.0] = [off(found, record, channel) for channel in ("dte", "torque_driven")]
    assert all(nudged < 0.25 * free for nudged, free in zip(left[True], left[False], strict=True)), left


@pytest.mark.parametrize("thinning", [0.0, 60e-6])
def test_working_flanks_part_whether_the_back_ones_touch_or_not(thinning: float) -> None:
    """Without backlash, but for what run-out leaves, contact is never lost; with it impacts on back flanks are rare."""
    case = make_case(150.0)
    gears = {side: getattr(case.rig, side).model_copy(update={"thinning": thinning}) for side in ("driver", "driven")}
    case = case.model_copy(update={"rig": case.rig.model_copy(update=gears)})
    record = simulate(case)
    found = replay(case, record)
    unloaded, lost = (found.attrs[name] for name in ("unloaded_samples", "contact_lost_samples"))
    assert unloaded > 0.1 * record.sizes["time"]
    assert lost > 0.8 * unloaded if thinning else lost < 0.2 * unloaded


def test_a_damper_without_limit_leads_the_driver() -> None:
    """On another rig: v1 goes to the recorded rate as one over the damper."""
    record = simulate(make_case(20.0))
    other = make_case(20.0, drive=Drive(coupling=Coupling(inertia=3e-3)), friction=Friction())
    gaps = []
    for times in (30.0, 300.0):
        found = replay(other, record, nudge=times * DAMPER)
        change = np.gradient(swing(found, "angle_driver") - swing(record, "angle_driver"))
        gaps.append(np.std(change) / np.std(np.gradient(swing(record, "angle_driver"))))
    assert gaps[0] < 0.05
    assert gaps[1] == pytest.approx(gaps[0] / 10, rel=0.2)


def test_a_nudged_motion_is_the_steady_one_of_its_own_equations() -> None:
    """From period to period nothing changes, which an excitation that does not repeat would not allow."""
    case = make_case(20.0, support=Supports(driver=Support(stiffness=1.2e8, damping=3e3), driven=Support(
        stiffness=1e8, damping=3e3)))  # fmt: skip
    steady = steady_motion(case, simulate(make_case(20.0)), nudge=DAMPER)
    assert steady.residual < 1e-6
    assert steady.setup.table is not None
    assert np.ptp(steady.setup.table.led) > 0.0

"""Replays by finite elements against the simulation that made the record, and against the lumped model's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from shared.twins import HEAVY, supports, twin_case

from gearbench.bench.errors import BenchError
from gearbench.bench.experiment import simulate
from gearbench.bench.nonlinear.law_table import teeth_law
from gearbench.bench.nonlinear.replay import replay as lumped
from gearbench.bench.replays.carried import damped_alike, on_elements
from gearbench.bench.replays.reduced import replay
from gearbench.geometry import pair
from gearbench.rig import Case, Drive

SHORT = """sampling_rate_hz = 5120.0
samples_per_period = 512
mesh_frequency_hz = 200.0
periods = 2
settling_tolerance = 1e-6
multisine = { amplitude_nm = 15.0, band_hz = [20.0, 1500.0], crest = 2.6 }
"""
CHANNELS = ("torque_driven", "angle_driver", "angle_driven", "y_driver", "y_driven", "dte")
EFFECTS = ("rig.driver.runout_um=5", "rig.friction.coefficient=0.05", "rig.sensors.delay_y_driver_us=40")


def case_of(folder: Path, *settings: str) -> Case:
    return twin_case(folder, *HEAVY, *supports("1e8", "1e4"), *settings, experiment=SHORT)


def turning_of(case: Case, channel: str) -> float:
    """Radians that a channel turns in a sample, 0 for one that does not."""
    rate = case.experiment.sampling_rate
    return 2 * np.pi * case.experiment.mesh_frequency_for(20) / 20 / rate if channel.startswith("angle") else 0.0


def apart(case: Case, found: xr.Dataset, record: xr.Dataset, channels: tuple[str, ...] = CHANNELS) -> float:
    """Largest departure of a replay from the first period of a record, over the fluctuation of the channel."""
    worst = 0.0
    for name in channels:
        wanted = record[name].values[0, : found.sizes["time"]]
        swing = wanted - turning_of(case, name) * np.arange(wanted.size)
        off = np.abs(found[name].values[0] - wanted).max()
        # An angle that is given does not swing.
        worst = max(worst, float(off / max(swing.std(), 1e-7)))
    return worst


def test_a_replay_gives_back_the_record_of_its_own_rig(tmp_path: Path) -> None:
    case = case_of(tmp_path, *EFFECTS)
    record = simulate(case)
    found = replay(case, record)
    assert found.attrs["model"] == "reduced" and found.attrs["settling_residual"] < 1e-4
    assert apart(case, found, record) < 1e-3
    assert found["mesh_phase"].values[0] == pytest.approx(record["mesh_phase"].values[0, : found.sizes["time"]])
    # What the record lacks shows.
    assert apart(case, replay(case_of(tmp_path, *EFFECTS[1:]), record), record) > 0.1


def test_a_driven_gear_that_is_followed_makes_up_for_a_load_that_yields(tmp_path: Path) -> None:
    shaft = "rig.load.coupling={inertia_kg_m2=0, stiffness_nm_per_rad=5e4, damping_nm_s_per_rad=20}"
    yielding, held = case_of(tmp_path, shaft), case_of(tmp_path)
    record = simulate(yielding)
    swing = record["angle_driven"].values[0] - turning_of(held, "angle_driven") * np.arange(record.sizes["time"])
    assert swing.std() > 2e-5  # against 1e-5 of the driver on the mesh
    found = replay(held, record)
    channels = ("angle_driver", "angle_driven", "y_driver", "y_driven")
    # The largest departure over the rms; the DTE is the small difference of both angles.
    assert apart(held, found, record, channels) < 0.01 and apart(held, found, record, ("dte",)) < 0.03


def test_damping_of_the_mesh_is_that_of_a_material_at_its_resonance(tmp_path: Path) -> None:
    """How far the mesh swings at its resonance, which the excitation covers, depends on the damping alone."""
    damped = ("rig.damping.mesh_ratio=0.15", "rig.damping.material_ratio=0.02")
    wide = ("experiment.sampling_rate_hz=10240", "experiment.samples_per_period=1024",
            "experiment.multisine.band_hz=[20.0, 2500.0]")  # fmt: skip
    # On rigid supports nothing else resonates.
    case = twin_case(tmp_path, *HEAVY, *damped, *wide, experiment=SHORT)
    law = teeth_law(case.rig, case.simulation, 50.0)
    stiffness = law.evaluate(law.approach[-1], np.arange(law.phases) / law.phases)[1].mean()
    resonance = float(np.sqrt(stiffness / 2e-3)) * pair(case.rig).driver.base_radius / (2 * np.pi)
    assert 1500.0 < resonance < 2300.0
    record = simulate(case)

    def swing(found: xr.Dataset) -> float:
        """Rms of the DTE about the resonance."""
        lines = np.abs(np.fft.rfft(found["dte"].values[0]))
        frequency = np.fft.rfftfreq(found.sizes["time"], 1 / 10240)
        return float(np.sqrt((lines[np.abs(frequency - resonance) < 300.0] ** 2).sum()))

    same, plain = (swing(replay(one, record)) for one in (on_elements(case, resonance).case, case))
    # Bodies that swing and a stiffness that changes over the phase make some per cent; the material's own ratio at
    # 1250 Hz would damp by a half more.
    assert same == pytest.approx(swing(lumped(case, record)), rel=0.1)
    assert plain > 1.5 * same


def test_what_elements_lack_is_left_out_and_named(tmp_path: Path) -> None:
    damped = ("rig.damping.mesh_exponent=0.5", "rig.mesh.stiffness_drift=0.01", "rig.mesh.stiffness_cos=[0.02]",
              "rig.mesh.stiffness_sin=[0.0]")  # fmt: skip
    carried = on_elements(case_of(tmp_path, *damped), 500.0)
    assert set(carried.lacks) == {"rig.damping.mesh_exponent", "rig.mesh.stiffness_drift"} and not carried.said
    rig = carried.case.rig
    assert rig.damping.mesh_exponent == 0.0 == rig.mesh.stiffness_drift and rig.mesh.stiffness_cos == (0.02,)
    assert rig.damping == damped_alike(case_of(tmp_path).rig.damping, 500.0)


def test_a_crack_is_the_one_that_loses_as_much(tmp_path: Path) -> None:
    from gearbench.bench.elastic.crack import stiffness_loss
    from gearbench.geometry import profile

    case = case_of(tmp_path, "rig.driver.crack={tooth=3, stiffness_loss=0.25}")
    carried = on_elements(case, 500.0)
    gear = carried.case.rig.driver
    assert gear.crack is not None and gear.crack.tooth == 3 and gear.crack.meshed and not carried.lacks
    size = case.simulation.element_size
    assert stiffness_loss(gear, profile(gear), case.rig.material, size) == pytest.approx(0.25, rel=0.05)
    assert "a crack of" in carried.said[0] and "tooth 3 of the driver" in carried.said[0]


def test_a_replay_that_leaves_the_modelled_flanks_is_refused(tmp_path: Path) -> None:
    case = case_of(tmp_path)
    record = simulate(case)
    record["torque_driver"] *= 60.0
    with pytest.raises(ValueError, match=r"modelled|carry|contact"):
        replay(case, record)
    rig = case.rig.model_copy(update={"drive": Drive(boundary="speed")})
    with pytest.raises(BenchError, match=r"rig\.drive\.boundary"):
        replay(case.model_copy(update={"rig": rig}), record)

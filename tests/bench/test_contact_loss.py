"""What a linear analysis hides: teeth that part at light load, found on lines that no linear machine answers on."""

from __future__ import annotations

from functools import lru_cache

import pytest
import xarray as xr

from gearbench.bench import simulate
from gearbench.cases import read_case
from gearbench.identification import distortion

# One multisine of +-10 N m on both mean torques; 1 urad and 0.05 um of noise on each sample.
COSET = [
    "experiment.realisations=3",
    "experiment.periods=3",
    "experiment.mesh_frequency_hz=20.48",
    "experiment.samples_per_period=8000",
    "experiment.settling_periods_max=40",
    "experiment.multisine.grid=coset",
    "experiment.multisine.band_hz=[1,3000]",
    "experiment.multisine.amplitude_nm=10",
    "rig.sensors.noise_angle_urad=1",
    "rig.sensors.noise_displacement_um=0.05",
    "simulation.mesh_stiffness=finite-element",
]


@lru_cache
def split(torque: float) -> tuple[xr.Dataset, str]:
    record = simulate(read_case("quick_lumped", [*COSET, f"experiment.torque_mean_nm={torque}"]))
    return distortion([record]), str(record.attrs.get("warnings", ""))


@pytest.mark.validation
def test_teeth_that_part_at_light_load_are_found() -> None:
    found, said = split(14.0)
    assert "out of contact" in said
    assert found.attrs["share"] > 0.3
    assert (found["rms"] > 20 * found["limit"]).sel(part=["even", "odd"]).all()


@pytest.mark.validation
def test_a_well_loaded_mesh_shows_nothing_above_the_noise() -> None:
    found, said = split(200.0)
    assert "out of contact" not in said
    assert (found["rms"] < found["limit"]).sel(part=["even", "odd"]).all()
    assert float(found["rms"].sel(part="signal")) > 30 * float(found["limit"].sel(part="odd"))

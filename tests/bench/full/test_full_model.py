"""`simulate --model full`: a record like the others, and what the model refuses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.bench import BenchError, simulate
from gearbench.bench.models import model_for
from gearbench.bench.plan.schedule import schedule
from gearbench.cases import case_path
from gearbench.rig import Case, read_case

GEAR = ("teeth=20", "module_mm=3.0", "hub_radius_mm=21.0", "thinning_um=40.0", "inertia_kg_m2=0.002")
SETTINGS = (
    *(f"rig.{side}.{value}" for side in ("driver", "driven") for value in GEAR),
    "rig.support.stiffness_n_per_m=1e9",
    "rig.support.damping_n_s_per_m=1e5",
    "rig.damping.material_ratio=0.01",
    "experiment.mesh_frequency_hz=1024.0",
    "experiment.sampling_rate_hz=16384.0",
    "experiment.samples_per_period=16",
    "experiment.periods=1",
    "experiment.realisations=1",
    "experiment.torque_mean_nm=60.0",
    "experiment.settling_tolerance=0.99",
    "experiment.settling_periods_max=20",
    "experiment.multisine.band_hz=[1000.0, 3000.0]",
    "experiment.multisine.crest=2.5",
    "identification.band_hz=[1000.0, 3000.0]",
    "simulation.element_size_um=1500.0",
)


def case_with(*settings: str) -> Case:
    return read_case(case_path("quick_fe"), [*SETTINGS, *settings])


@pytest.mark.validation
def test_record_is_close_to_the_reduced_model_s() -> None:
    case = case_with()
    full, reduced = simulate(case, "full"), simulate(case, "reduced")
    assert full.attrs["model"] == "full" and set(full.data_vars) == set(reduced.data_vars)
    assert full.attrs["substeps"] == reduced.attrs["substeps"]
    one, two = full["dte"].to_numpy()[0], reduced["dte"].to_numpy()[0]
    assert np.std(one - two) < 0.01 * np.std(one)
    assert np.mean(one) == pytest.approx(np.mean(two), rel=1e-3)


@pytest.mark.parametrize(
    ("setting", "key"),
    [
        ("rig.driver.crack.length_mm=1.0", "rig.driver.crack"),
        ("rig.friction.coefficient=0.1", "rig.friction.coefficient"),
        ("rig.drive.coupling.stiffness_nm_per_rad=1e4", "rig.drive.coupling"),
    ],
)
def test_what_it_lacks_is_refused_by_name(setting: str, key: str) -> None:
    settings: list[Any] = [setting]
    if "crack" in setting:
        settings += ["rig.driver.crack.tooth=0", "rig.driver.crack.direction_deg=10.0"]
    if "coupling" in setting:
        settings.append("rig.drive.coupling.inertia_kg_m2=1e-3")
    case, model = model_for(case_with(*settings), "full")
    with pytest.raises(BenchError, match=f"full finite-element model does not represent {key}"):
        model.refuse(case)


def test_contact_of_surfaces_is_the_full_model_s_alone() -> None:
    """By name, before work begins; flanks with errors are refused beside it."""
    penalty = 'simulation.contact="penalty"'
    for name in ("reduced", "lumped"):
        with pytest.raises(BenchError, match=f'simulation.contact = "penalty" is of the model "full" only.*{name}'):
            model_for(case_with(penalty), name)
    case, model = model_for(case_with(penalty, "rig.driver.runout_um=5.0"), "full")
    with pytest.raises(BenchError, match=r'simulation.contact = "penalty" does not represent rig\.driver\.runout'):
        model.refuse(case)


@pytest.mark.validation
def test_contact_of_surfaces_is_prepared() -> None:
    case, model = model_for(case_with('simulation.contact="penalty"'), "full")
    model.refuse(case)
    prepared = model.prepare(case, schedule(case.experiment, case.rig), lambda note: None)
    assert prepared.settings["contact"] == "penalty" and prepared.integrator.machine.surfaces

"""Vibrations that do not die out: the error names the keys that damp the rig; light damping is waited for."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.bench import BenchError, simulate
from gearbench.bench.plan.damping import dampers, damping_advice
from gearbench.bench.plan.settling import FEW
from gearbench.cases import case_path
from gearbench.rig import Case, read_case

SHORT = (
    "experiment.realisations=1",
    "experiment.samples_per_period=512",
    "experiment.mesh_frequency_hz=64",
    "experiment.multisine.band_hz=[64, 3500]",
    "identification.band_hz=[64, 3500]",
)


def quick(*settings: str) -> Case:
    return read_case(case_path("quick_lumped"), [*SHORT, *settings])


def test_without_damping_the_keys_are_named() -> None:
    case = quick("rig.support.damping_n_s_per_m=0")
    expected = "rig.support.driver.damping_n_s_per_m = 0, rig.support.driven.damping_n_s_per_m = 0"
    assert damping_advice(case) == expected
    notes: list[str] = []
    words = rf"free vibrations do not die out: damp the rig \(raise one of {expected}\)"
    with pytest.raises(BenchError, match=words):
        simulate(case, progress=lambda _, note: notes.append(note))
    assert not [note for note in notes if note.startswith("integrating")]


def test_the_record_of_a_rig_that_is_not_linear_tells_what_is_not_damped() -> None:
    """Its teeth may part, so that nothing grows for ever."""
    hardening = ("rig.mesh.exponent=0.01", "rig.mesh.reference_force_n=3e3")
    record = simulate(quick("rig.support.damping_n_s_per_m=0", *hardening))
    assert record.attrs["settling_residual"] > 1e-3 and np.isfinite(record["dte"].values).all()
    assert "not damped (rig.support.driver.damping_n_s_per_m = 0, rig.support." in record.attrs["warnings"]


def test_all_of_a_rigs_dampers_are_known() -> None:
    case = quick(
        "rig.support.driver.across={stiffness_n_per_m=1e9}",
        "rig.housing={mass_kg=3, stiffness_n_per_m=1e8, damping_n_s_per_m=7}",
        "rig.load.coupling={inertia_kg_m2=1e-3, stiffness_nm_per_rad=1e4}",
        "rig.drive.coupling={inertia_kg_m2=1e-3}",
    )
    assert {damper.key.removesuffix("_n_s_per_m") for damper in dampers(case)} == {
        "rig.support.driver.damping",
        "rig.support.driver.across.damping",
        "rig.support.driven.damping",
        "rig.housing.damping",
        "rig.load.coupling.damping_nm_s_per_rad",
        "rig.damping.mesh_ratio",
    }
    none = "rig.support.driver.across.damping_n_s_per_m = 0, rig.load.coupling.damping_nm_s_per_rad = 0"
    assert damping_advice(case) == none


def test_the_linear_model_waits_as_long_as_its_vibrations_need() -> None:
    """Both centres on their supports alone swing for e-foldings of 2 m/c: a period is 1/8 s."""
    case = quick("rig.support.damping_n_s_per_m=20")
    record = simulate(case)
    period = record.attrs["samples_per_period"] / record.attrs["sampling_rate"]
    needed = np.log(1 / case.experiment.settling_tolerance) / (period * 20 / (2 * 1.736))
    settled = record.attrs["settling_periods"]
    assert FEW < settled <= 1.5 * needed

"""`diagnose` as the library has it: what it takes, what it says while it works, what it hands back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from shared.fake_diagnosis import at_rest, friction_found
from shared.measured import channels, nominal, record, written

from gearbench.bench.errors import BenchError
from gearbench.cases import case_files
from gearbench.diagnosis import Diagnosis, DiagnosisError, diagnose
from gearbench.diagnosis import diagnosis as module
from gearbench.diagnosis.diagnosis import take_in
from gearbench.diagnosis.forces.nominal import model_for
from gearbench.rig import Case, read_case


@pytest.fixture(autouse=True)
def stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stand in for the search and the replay."""
    monkeypatch.setattr(module, "find_cause", lambda measurements, case, **asked: friction_found(case))
    monkeypatch.setattr(module, "replays_of", lambda case, measurements: at_rest)


def sets() -> list[xr.Dataset]:
    return [
        record(channels(), condition="base"),
        record(channels(torque=40.0, seed=2), condition="light", torque_mean=40.0),
        record(channels(torque=80.0, seed=3), condition="held-out", torque_mean=80.0),
    ]


def test_datasets_and_files_are_diagnosed_alike(tmp_path: Path) -> None:
    made = diagnose(sets(), nominal())
    assert isinstance(made, Diagnosis) and made.verdict.verdict == "effects"
    assert [one.name for one in made.inputs.measurements] == ["base", "light"]
    assert made.inputs.held_out is not None and made.verdict.held_out == "held-out"
    assert list(made.stages) == ["nominal", "recalibrated", "with_effect"]
    assert made.updated.rig.friction.coefficient == 0.0581
    files = [
        written(tmp_path, "record-base"),
        written(tmp_path, "record-light", channels(torque=40.0, seed=2)),
        written(tmp_path, "record-held-out", channels(torque=80.0, seed=3)),
    ]
    assert diagnose(files, nominal()).verdict == made.verdict


def test_steps_are_told_and_quick_leaves_the_division_out() -> None:
    steps: list[str] = []
    whole = diagnose(sets(), nominal(), progress=steps.append)
    assert steps == ["cause", "how far the gap shrinks", "where the gap is", "how small an effect would show"]
    quick = diagnose(sets(), nominal(), quick=True)
    assert {share.kind for share in quick.verdict.where} == {"place"}
    assert {share.kind for share in whole.verdict.where} > {"place", "channel", "tooth"}
    assert quick.verdict.effects == whole.verdict.effects


def test_what_is_asked_is_checked() -> None:
    with pytest.raises(DiagnosisError, match="without = gremlins is no effect of the library: backlash, friction"):
        diagnose(sets(), nominal(), without=["gremlins"])
    with pytest.raises(DiagnosisError, match="held_out = x names 0 records"):
        diagnose(sets(), nominal(), held_out="x")
    with pytest.raises(DiagnosisError, match="at least one is needed"):
        diagnose([], nominal())
    assert take_in(sets(), nominal(), without=["friction", "friction"]).without == ("friction",)


def demonstration(*settings: str) -> Case:
    return read_case(case_files()["gap_demo"], list(settings))


def test_a_rig_of_finite_elements_is_replayed_on_their_law_and_what_no_replay_has_is_refused_at_once() -> None:
    law = 'simulation.mesh_stiffness="potential-energy"'
    reduced = demonstration('simulation.model="reduced"', law)
    assert take_in(sets(), reduced).nominal.simulation.mesh_stiffness == "finite-element"
    plain = demonstration(law)
    assert take_in(sets(), plain).nominal.simulation.mesh_stiffness == "potential-energy"
    assert take_in(sets(), demonstration("rig.driver.profile_slope_um=6")).nominal.rig.driver.profile_slope == 6e-6
    worn = demonstration(f"rig.driver.profile_slope_tooth_um={[1.0] * 19 + [0.0]}")
    with pytest.raises(BenchError, match=r"lumped model does not represent rig\.driver\.profile_slope_tooth_um"):
        take_in(sets(), worn)


def test_replays_of_a_rig_of_finite_elements_have_the_damping_of_its_material() -> None:
    """At the mesh's own resonance 2 zeta sqrt(k m) over k is the material's beta."""
    damped = ("rig.damping.material_ratio=0.03", "rig.damping.material_frequency_hz=1000", "rig.damping.mesh_ratio=0.2")
    inputs = take_in(sets(), demonstration('simulation.model="reduced"', *damped))
    model = model_for(inputs.nominal, inputs.measurements)
    beta = 0.03 / (np.pi * 1000.0)
    wanted = 0.5 * beta * np.sqrt(model.mesh_stiffness / model.mesh_mass)
    assert inputs.nominal.rig.damping.mesh_ratio == pytest.approx(wanted, rel=1e-6) != 0.2
    assert inputs.damped(inputs.nominal).rig.damping.beta == pytest.approx(beta, rel=1e-9)
    plain = take_in(sets(), demonstration(*damped))
    assert plain.resonance is None and plain.damped(plain.nominal).rig.damping.mesh_ratio == 0.2


def test_two_datasets_without_a_condition_get_names_of_their_own() -> None:
    bare = [one.assign_attrs(condition="") for one in sets()]
    assert [one.name for one in take_in(bare, nominal()).all] == ["record-1", "record-2", "record-3"]

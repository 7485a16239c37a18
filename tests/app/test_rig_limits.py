"""Calibration for the rig at hand: truth rigs under the records' own torque and noise, kept for the next time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
from shared.truth_plants import CASES

from gearbench.bench import simulate
from gearbench.challenge.making.around import mix_of
from gearbench.diagnosis.diagnosis import Inputs, take_in
from gearbench.diagnosis.population import POPULATION
from gearbench.diagnosis.verdict import Candidate, Probabilities, Verdict
from gearbench.diagnosis.verdict_file import write_verdict
from gearbench.records import read_record
from gearbench.rig import read_case
from gearbench.rig_limits import SEED, limits_of, noise_of

SETTINGS = (
    "experiment.mesh_frequency_hz=512",
    "experiment.samples_per_period=1200",
    "simulation.mesh_stiffness=potential-energy",
)
SIGNS = {"lines": 300.0, "unknown": 0.5, "left": 0.4, "remains": 0.08, "changing": 0.01, "over mesh": 0.5}


def inputs_of(noise: str = "1") -> Inputs:
    case = read_case(CASES / "gap_demo.toml", (*SETTINGS, f"rig.sensors.noise_angle_urad={noise}"))
    case = case.model_copy(update={"conditions": ()})
    return take_in([simulate(case)], case)


def say(records: Sequence[Path], nominal: Path, folder: Path, without: Sequence[str]) -> str | None:
    """A diagnosis by hand, which says the same of every rig."""
    assert read_record(records[0]).sizes["time"] == 2400 and read_case(nominal).conditions
    verdict = Verdict(
        verdict="none",
        probability=Probabilities(effect=0.1, none=0.8, unknown=0.1),
        candidates=(Candidate(effects=("friction",), log_evidence=1.0),),
        place="none",
        signs=SIGNS,
    )
    write_verdict(verdict, folder / "verdict.json")
    return None


def refuse(records: Sequence[Path], nominal: Path, folder: Path, without: Sequence[str]) -> str | None:
    raise AssertionError("this has been diagnosed before")


@pytest.mark.validation  # six truth rigs are made: 10 s of processor time
def test_limits_of_a_rig_are_made_once(tmp_path: Path) -> None:
    inputs = inputs_of()
    told: list[float] = []
    found = limits_of(inputs, 6, say, lambda part, note: told.append(part), workers=0, folder=tmp_path)
    mix = mix_of(6, SEED)
    assert (found.source, found.rigs) == ("this rig", mix.cases) and told[-1] == 1.0
    assert found.structure == pytest.approx(1.25 * 0.08) and found.outstanding == pytest.approx({"mesh": 0.625})
    # One candidate a rig, and those that are sound or foreign, beside what the population has taught.
    assert found.effect.cases == POPULATION.effect.cases + mix.cases
    assert found.unknown.cases == POPULATION.unknown.cases + mix.controls + mix.foreign
    assert limits_of(inputs, 6, refuse, workers=0, folder=tmp_path) == found
    with pytest.raises(AssertionError, match="before"):
        limits_of(inputs_of("3"), 6, refuse, workers=0, folder=tmp_path)


def test_noise_is_that_of_the_records() -> None:
    seen = noise_of(inputs_of("5"))
    assert seen["angle"] == pytest.approx(5e-6, rel=0.1) and seen["displacement"] == pytest.approx(5e-8, rel=0.1)

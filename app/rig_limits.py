"""Limits and probabilities of a diagnosis for the rig and experiment at hand, from truth rigs around them."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearbench.files import fingerprint, write_text

if TYPE_CHECKING:
    from gearbench.challenge.answers import Answer
    from gearbench.challenge.making.around import Measured
    from gearbench.diagnosis.diagnosis import Inputs
    from gearbench.diagnosis.odds import Calibration, Known, Odds
    from gearbench.diagnosis.verdict import Verdict

SEED = 1  # of the truth rigs: the same rig and experiment have the same limits
FAMILY = "calibration"
MAKING = 0.1  # part of the time that making them takes
NOISES = {"angle": "angle_", "displacement": "y_", "torque": "torque_"}
Diagnose = Callable[[Sequence[Path], Path, Path, Sequence[str]], "str | None"]


def limits_of(
    inputs: Inputs,
    rigs: int,
    diagnose: Diagnose,
    progress: Callable[[float, str], None] | None = None,
    *,
    workers: int | None = None,
    folder: Path | None = None,
) -> Calibration:
    """The calibration of `rigs` truth rigs drawn around the nominal rig of a diagnosis, under its records' torques,
    speeds and noise; kept in the cache folder, with what was made of them, and gone on with where it was stopped.
    `workers`: processes (absent: as there are processors); `folder`: where it is kept (absent: the cache folder).

    Raises ChallengeError for a nominal rig that no truth rig can be built around, and for too few rigs.
    """
    from gearbench.challenge.making.around import mix_of, nominal_under
    from gearbench.challenge.making.cases import make_challenge
    from gearbench.challenge.scoring.judge import score_folder
    from gearbench.commands.measured.challenge import read
    from gearbench.diagnosis.odds import calibrated
    from gearbench.diagnosis.population import POPULATION
    from gearbench.diagnosis.verdict_file import parse_verdict
    from gearbench.kernels.folders import cache_folder
    from gearbench.rig import dump_case

    records, noise = measured(inputs), noise_of(inputs)
    nominal = nominal_under(inputs.nominal, records, noise)
    home = (folder or cache_folder()) / f"limits-{fingerprint(*_identity(dump_case(nominal), records, rigs))[:32]}"
    kept = home / "limits.json"
    if kept.is_file():
        return _read(kept)
    home.mkdir(parents=True, exist_ok=True)
    cases, answers = home / "cases", home / "answers.json"
    torques = {one.name: one.torque for one in records}

    def making(part: float, note: str) -> None:
        if progress:
            progress(MAKING * part, f"truth rigs, {note}")

    def diagnosing(part: float, note: str) -> None:
        if progress:
            progress(MAKING + (1.0 - MAKING) * part, f"diagnosing, {note}")

    make_challenge(nominal, mix_of(rigs, SEED), SEED, cases, answers, FAMILY, making, torques=torques)
    outcomes, _ = score_folder(cases, answers, read, diagnose, resume=True, workers=workers, progress=diagnosing)
    known = [
        known_of(parse_verdict(json.dumps(one.verdict)), one.answer) for one in outcomes if one.verdict is not None
    ]
    found = calibrated(POPULATION, known)
    write_text(kept, json.dumps(asdict(found), indent=1) + "\n")
    return found


def known_of(verdict: Verdict, answer: Answer) -> Known:
    """A diagnosed truth rig as a calibration learns from it: what its record does not show was not there."""
    from gearbench.challenge.scoring.due import kind_shown
    from gearbench.diagnosis.odds import Known

    return Known(verdict, kind_shown(answer), answer.effects)


def measured(inputs: Inputs) -> list[Measured]:
    """The records of a diagnosis as truth rigs are run under them, the held-out one last."""
    from gearbench.challenge.making.around import Measured

    out = []
    for one in inputs.all:
        name = "held-out" if one is inputs.held_out else one.name
        out.append(Measured(name, one.mean("torque_driver"), one.sampling_rate, one.mesh_frequency))
    return out


def noise_of(inputs: Inputs) -> dict[str, float]:
    """Rms of one sample by kind of sensor: the largest that any record shows between its repetitions, else the nominal
    rig's."""
    sensors = inputs.nominal.rig.sensors
    out = {}
    for kind, start in NOISES.items():
        seen = [value for one in inputs.all for name, value in one.noise.items() if name.startswith(start)]
        out[kind] = max(seen, default=getattr(sensors, f"noise_{kind}"))
    return out


def _identity(case: str, records: Sequence[Measured], rigs: int) -> list[str]:
    from gearbench.records.provenance import source_digest

    torques = [f"{one.name} {one.torque.tobytes().hex()}" for one in records]
    return [case, source_digest(), str(rigs), *torques]


def _read(path: Path) -> Calibration:
    from gearbench.diagnosis.odds import Calibration, Odds

    tree: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))

    def odds(entry: dict[str, Any]) -> Odds:
        covariance = tuple(tuple(row) for row in entry["covariance"])
        return Odds(tuple(entry["weights"]), covariance, entry["cases"], entry["true"])

    return Calibration(**{**tree, "effect": odds(tree["effect"]), "unknown": odds(tree["unknown"])})

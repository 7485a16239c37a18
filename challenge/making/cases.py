"""Make a challenge: folders of records of truth rigs and their nominal rig, and the answers somewhere else.

Nothing in the folders tells cases apart but the channels' values: names are random, cases are made in the order of
their names, every file has the same size, attributes and time stamp, and the nominal rig is the same text.
"""

from __future__ import annotations

import os
import secrets
import shutil
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gearbench.bench.plan.workers import processors
from gearbench.bench.statics import static
from gearbench.challenge.answers import Answer, read_answers, write_answers
from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.making.nominal import nominal_text
from gearbench.challenge.making.plan import MOST_CASES, Mix, Plan, make_plan
from gearbench.challenge.truth.effects import EFFECTS, FOREIGN, Drawn
from gearbench.challenge.truth.levels import background
from gearbench.challenge.truth.measure import measure
from gearbench.challenge.truth.rigs import Bench, check_nominal, conditions_of, make_bench
from gearbench.challenge.truth.structure import FAMILIES, Structure, draw_structure, family_named
from gearbench.records import write_record
from gearbench.rig import Case

STAMP = 946684800  # 2000-01-01: of every file and folder
POSITIONS = 64  # mesh phases of the nominal stiffness
NAME_BYTES = 6

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Truth:
    """One truth rig complete: structure and levels, and the answer that belongs to it."""

    structure: Structure
    drawn: Drawn
    answer: Answer


def draw_truth(nominal: Case, family: str, seed: int, number: int, plan: Plan) -> tuple[Truth, np.random.Generator]:
    """The truth rig of case `number` of a challenge, and the stream that its noise comes from."""
    stream = np.random.SeedSequence([seed, list(FAMILIES).index(family), number])
    rngs = [np.random.default_rng(child) for child in stream.spawn(4)]
    structure = draw_structure(nominal, family, rngs[0])
    drawn = Drawn(background((nominal.rig.driver.teeth, nominal.rig.driven.teeth), rngs[1]), "none", 0.0, {})
    places, parameters, severity = [], {}, {}
    for name, size in zip(plan.effects, plan.severity, strict=True):
        drawn = (EFFECTS.get(name) or FOREIGN[name])(drawn.levels, size, rngs[2])
        places.append(drawn.place)
        parameters[name] = drawn.parameters
        severity[name] = drawn.severity
    answer = Answer(
        plan.kind, plan.effects, places[0] if places else "none", parameters, severity, family, seed, number
    )
    return Truth(structure, drawn, answer), rngs[3]


def nominal_stiffness(nominal: Case) -> float:
    """Mean tangent stiffness [N/m] of the nominal mesh, finite elements, at the first condition's mean torque."""
    condition = conditions_of(nominal)[0]
    result = static(nominal.under(condition), "reduced", positions=POSITIONS)
    return float(result["stiffness_tangent"].mean())


def make_challenge(
    nominal: Case,
    mix: Mix,
    seed: int,
    out: Path,
    answers_file: Path,
    family: str = "test",
    progress: Progress | None = None,
) -> Mapping[str, Answer]:
    """Make all cases that are not there yet; their answers by name.

    Raises ChallengeError for an unknown family, bad numbers, answers inside `out`, or files of another challenge.
    """
    family_named(family)
    check_nominal(nominal)
    if not 1 <= mix.cases <= MOST_CASES:
        raise ChallengeError(f"a challenge of {mix.cases} cases cannot be made: at least 1, at most {MOST_CASES}")
    plans = make_plan(mix, np.random.default_rng(np.random.SeedSequence([seed, list(FAMILIES).index(family)])))
    check_apart(out, answers_file)
    truths = [draw_truth(nominal, family, seed, i, plan)[0].answer for i, plan in enumerate(plans)]
    answers = _claim(out, answers_file, truths)
    bench = make_bench(nominal, nominal_stiffness(nominal))
    text = nominal_text(nominal)
    missing = [name for name in sorted(answers) if not (out / name).is_dir()]
    stop = threading.Event()

    def run(name: str) -> None:
        if not stop.is_set():
            number = answers[name].number
            truth, rng = draw_truth(nominal, family, seed, number, plans[number])
            _write_case(bench, truth, name, text, out, rng)

    with ThreadPoolExecutor(processors()) as pool:
        futures = [pool.submit(run, name) for name in missing]
        try:
            for done, future in enumerate(as_completed(futures), start=1):
                future.result()
                if progress:
                    progress(done / len(missing), f"case {done} of {len(missing)}")
        finally:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
    os.utime(out, (STAMP, STAMP))
    return answers


def check_apart(out: Path, answers_file: Path) -> None:
    """Refuse answers inside the challenge's folder. Raises ChallengeError."""
    if answers_file.resolve().is_relative_to(out.resolve()):
        raise ChallengeError(f"--answers {answers_file} lies inside --out {out}: answers must lie somewhere else")


def _claim(out: Path, answers_file: Path, truths: list[Answer]) -> Mapping[str, Answer]:
    """Names for the cases: those of an earlier run of the same challenge, or new random ones, written down first."""
    present = sorted(path.name for path in out.iterdir()) if out.is_dir() else []
    if answers_file.exists():
        answers = read_answers(answers_file)
        held = sorted(answers.values(), key=lambda answer: answer.number)
        if [_comparable(a) for a in held] != [_comparable(a) for a in truths]:
            raise ChallengeError(
                f"--answers {answers_file} holds the answers of another challenge: choose another name"
            )
    else:
        answers = {secrets.token_hex(NAME_BYTES): truth for truth in truths}
        if len(answers) != len(truths):
            raise ChallengeError("two cases drew the same name: try again")
    for name in present:
        if name.startswith(".") and (out / name).is_dir():
            shutil.rmtree(out / name)
        elif name not in answers:
            raise ChallengeError(f"--out {out} holds {name}, which is no case of this challenge: choose another folder")
    out.mkdir(parents=True, exist_ok=True)
    write_answers(dict(sorted(answers.items())), answers_file)
    return answers


def _comparable(answer: Answer) -> tuple[object, ...]:
    return (answer.kind, answer.effects, answer.place, dict(answer.severity), answer.family, answer.seed, answer.number)


def _write_case(bench: Bench, truth: Truth, name: str, text: str, out: Path, rng: np.random.Generator) -> None:
    """All files of a case, in a folder that takes its name when it is complete."""
    folder = out / f".{name}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    (folder / "nominal.toml").write_text(text, encoding="utf-8")
    for condition in conditions_of(bench.nominal):
        record = measure(bench, truth.structure, truth.drawn.levels, condition, name, rng)
        write_record(record, folder / f"record-{condition.name}.nc")
    for path in sorted(folder.iterdir()):
        os.utime(path, (STAMP, STAMP))
    os.utime(folder, (STAMP, STAMP))
    os.replace(folder, out / name)

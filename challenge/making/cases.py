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
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.nonlinear.law_table import mesh_law
from gearbench.bench.plan.workers import processors
from gearbench.bench.statics import static
from gearbench.challenge.answers import Answer, read_answers, write_answers
from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.making.drawn import drawn_nominal
from gearbench.challenge.making.nominal import nominal_text
from gearbench.challenge.making.plan import MOST_CASES, Mix, Plan, make_plan
from gearbench.challenge.making.traces import Recorder, traces_of
from gearbench.challenge.truth.effects import EFFECTS, FOREIGN, Drawn
from gearbench.challenge.truth.elastic import measure_elastic, within_uncertainty
from gearbench.challenge.truth.levels import background
from gearbench.challenge.truth.measure import measure
from gearbench.challenge.truth.rigs import Bench, check_nominal, conditions_of, make_bench
from gearbench.challenge.truth.scale import Scale, scale_of
from gearbench.challenge.truth.stated import stated
from gearbench.challenge.truth.structure import FAMILIES, Structure, draw_structure, family_named, loosened
from gearbench.geometry import pair
from gearbench.records import write_record
from gearbench.rig import Case, Condition

STAMP = 946684800  # 2000-01-01: of every file and folder
Array = NDArray[np.float64]

POSITIONS, DEPTHS = 64, 512  # mesh phases and deflections of the nominal stiffness
NAME_BYTES = 6

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Truth:
    """One truth rig complete: structure and levels, and the answer that belongs to it; `elastic`: in place of the
    structure the nominal case within its uncertainty, to be simulated by finite elements; `soft`: its coupling
    yields."""

    structure: Structure
    drawn: Drawn
    answer: Answer
    elastic: Case | None = None
    soft: bool = False


def draw_truth(
    nominal: Case, family: str, seed: int, number: int, plan: Plan, scale: Scale | None = None, left_out: str = ""
) -> tuple[Truth, np.random.Generator]:
    """The truth rig of case `number` of a challenge, and the stream that its noise comes from; `scale`: of a rig that
    is not of the demonstration's size, whose housing then is as soft as housings are. `left_out`: an effect of the plan
    that the rig lacks, all else being drawn as with it."""
    stream = np.random.SeedSequence([seed, list(FAMILIES).index(family), number])
    rngs = [np.random.default_rng(child) for child in stream.spawn(6)]
    structure = draw_structure(nominal, family, rngs[0])
    if scale is not None:
        structure = loosened(structure, rngs[4])
    elastic = within_uncertainty(nominal, rngs[5]) if plan.elastic else None
    drawn = Drawn(background((nominal.rig.driver.teeth, nominal.rig.driven.teeth), rngs[1]), "none", 0.0, {})
    places, parameters, severity = [], {}, {}
    for name, size in zip(plan.effects, plan.severity, strict=True):
        before = drawn.levels
        drawn = (EFFECTS.get(name) or FOREIGN[name])(before, size, rngs[2])
        places.append(drawn.place)
        parameters[name] = drawn.parameters
        severity[name] = drawn.severity
        if name == left_out:
            drawn = replace(drawn, levels=before)
    if scale is not None:
        structure, drawn = scale.structure(structure), replace(drawn, levels=scale.levels(drawn.levels))
        parameters = scale.parameters(parameters)
    parameters = stated(parameters, structure, nominal)
    answer = Answer(
        plan.kind,
        plan.effects,
        places[0] if places else "none",
        parameters,
        severity,
        family,
        seed,
        number,
        tuple(places),
    )
    return Truth(structure, drawn, answer, elastic, "coupling" in {*plan.effects} - {left_out}), rngs[3]


def nominal_stiffness(nominal: Case) -> float:
    """Mean tangent stiffness [N/m] of the nominal mesh, finite elements or the analytic law that the case asks for, at
    the first condition's mean torque."""
    condition = conditions_of(nominal)[0]
    if nominal.simulation.mesh_stiffness == "potential-energy":
        return _of_law(nominal, condition.experiment.torque_mean)
    result = static(nominal.under(condition), "reduced", positions=POSITIONS)
    return float(result["stiffness_tangent"].mean())


def _of_law(nominal: Case, torque: float) -> float:
    """Mean tangent stiffness [N/m] of the case's own mesh law under a torque [N m]."""
    law = mesh_law(nominal.rig, nominal.simulation, 2.0 * torque)
    # The tangent jumps at the first touch: no node lies there.
    depth = law.approach[-1] * np.arange(1, DEPTHS + 1)[:, None] / DEPTHS
    force, tangent = law.evaluate(depth, np.arange(POSITIONS) / POSITIONS)
    load = torque / pair(nominal.rig).driver.base_radius
    return float(np.interp(load, force.mean(axis=1), tangent.mean(axis=1)))


def make_challenge(
    nominal: Case,
    mix: Mix,
    seed: int,
    out: Path,
    answers_file: Path,
    family: str = "test",
    progress: Progress | None = None,
    *,
    drawn: bool = False,
    torques: Mapping[str, Array] | None = None,
) -> Mapping[str, Answer]:
    """Make all cases that are not there yet; their answers by name. `drawn`: every case has a nominal rig of its own,
    of any size (`making.drawn`), as uncertain as `nominal`. `torques`: what was measured in the conditions named, one
    excitation period (N,) [N m] each, in place of a multisine; effects then have the nominal rig's size.

    Raises ChallengeError for an unknown family, bad numbers, answers inside `out`, or files of another challenge.
    """
    family_named(family)
    check_nominal(nominal)
    if mix.reduced and torques:
        raise ChallengeError("reduced: finite elements are not run under a measured torque, only under a multisine")
    if not 1 <= mix.cases <= MOST_CASES:
        raise ChallengeError(f"a challenge of {mix.cases} cases cannot be made: at least 1, at most {MOST_CASES}")
    plans = make_plan(mix, np.random.default_rng(np.random.SeedSequence([seed, list(FAMILIES).index(family)])))
    check_apart(out, answers_file)
    rigs = [_rig_of(nominal, family, seed, number, drawn, bool(torques)) for number in range(len(plans))]
    truths = [draw_truth(rig, family, seed, i, plan, scale)[0].answer for i, (plan, (rig, scale)) in
              enumerate(zip(plans, rigs, strict=True))]  # fmt: skip
    answers = _claim(out, answers_file, truths)
    shared = None
    if not drawn:
        scale = scale_of(nominal) if torques else None
        shared = make_bench(nominal, nominal_stiffness(nominal), scale, torques), nominal_text(nominal)
    missing = [name for name, one in sorted(answers.items()) if not (out / name).is_dir() or _untraced(one)]
    stop = threading.Event()

    def run(name: str) -> tuple[str, dict[str, float]]:
        if stop.is_set():
            return name, {}
        number = answers[name].number
        rig, scale = rigs[number]
        plan = plans[number]
        truth, rng = draw_truth(rig, family, seed, number, plan, scale)
        bench, text = shared or (make_bench(rig, nominal_stiffness(rig), scale), nominal_text(rig))
        if not (out / name).is_dir():
            _write_case(bench, truth, name, text, out, rng)
        fewer = {one: draw_truth(rig, family, seed, number, plan, scale, one)[0] for one in plan.effects}
        return name, traces_of(bench, _recorder(truth), {one: _recorder(rest) for one, rest in fewer.items()})

    with ThreadPoolExecutor(processors()) as pool:
        futures = [pool.submit(run, name) for name in missing]
        try:
            for done, future in enumerate(as_completed(futures), start=1):
                name, traces = future.result()
                answers[name] = replace(answers[name], traces=traces)
                write_answers(answers, answers_file)
                if progress:
                    progress(done / len(missing), f"case {done} of {len(missing)}")
        finally:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
    os.utime(out, (STAMP, STAMP))
    return answers


def _rig_of(nominal: Case, family: str, seed: int, number: int, drawn: bool, scaled: bool) -> tuple[Case, Scale | None]:
    """The nominal rig of case `number`, and its scale where effects go with the rig's size."""
    if not drawn:
        return nominal, scale_of(nominal) if scaled else None
    rng = np.random.default_rng(np.random.SeedSequence([seed, list(FAMILIES).index(family), number, 1]))
    rig = drawn_nominal(nominal, family, rng)
    check_nominal(rig)
    return rig, scale_of(rig)


def check_apart(out: Path, answers_file: Path) -> None:
    """Refuse answers inside the challenge's folder. Raises ChallengeError."""
    if answers_file.resolve().is_relative_to(out.resolve()):
        raise ChallengeError(f"--answers {answers_file} lies inside --out {out}: answers must lie somewhere else")


def _untraced(answer: Answer) -> bool:
    """Whether it is not known yet how far the effects of a case show."""
    return bool(answer.effects) and not answer.traces


def _claim(out: Path, answers_file: Path, truths: list[Answer]) -> dict[str, Answer]:
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
    answers = dict(sorted(answers.items()))
    write_answers(answers, answers_file)
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
        record = _record(bench, truth, condition, name, rng)
        write_record(record, folder / f"record-{condition.name}.nc")
    for path in sorted(folder.iterdir()):
        os.utime(path, (STAMP, STAMP))
    os.utime(folder, (STAMP, STAMP))
    os.replace(folder, out / name)


def _record(bench: Bench, truth: Truth, condition: Condition, name: str, rng: np.random.Generator) -> xr.Dataset:
    levels = truth.drawn.levels
    if truth.elastic is None:
        return measure(bench, truth.structure, levels, condition, name, rng)
    return measure_elastic(bench, truth.elastic, levels, condition, truth.soft, name, rng)


def _recorder(truth: Truth) -> Recorder:
    """How a bench measures that truth rig."""
    return lambda bench, condition: _record(bench, truth, condition, "", np.random.default_rng(0))

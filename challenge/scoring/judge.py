"""Score a challenge's folder: run the diagnosis on each case, or read the verdicts that are there."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from gearbench.bench.plan.workers import processors
from gearbench.challenge.answers import Answer, read_answers
from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.scoring.outcomes import VERDICTS, Outcome, judge, said, without

VERDICT = "verdict.json"
# Diagnoses the records with the nominal case and writes verdict.json into a folder: (records, nominal, folder,
# effects left out of the library) -> None, or one sentence why it failed. Must be a module's function: it runs in
# another process.
Diagnose = Callable[[Sequence[Path], Path, Path, Sequence[str]], "str | None"]
# Reads and checks a verdict file; raises ValueError with one sentence.
Read = Callable[[Path], Mapping[str, Any]]
Progress = Callable[[float, str], None]


def score_folder(
    folder: Path,
    answers_file: Path,
    read: Read,
    diagnose: Diagnose | None = None,
    *,
    resume: bool = False,
    withheld: str | None = None,
    rig: Path | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> tuple[list[Outcome], dict[str, str]]:
    """Outcomes of all cases in the order of their names, and why those failed that did.

    Verdicts are read where every case has one, and made by `diagnose` where none has; where some have, `resume` says
    to make the rest. `withheld`: only cases of that effect, which the library must then lack; their verdicts lie in
    folders of their own. `rig` replaces the cases' nominal rigs. Raises ChallengeError.
    """
    answers = read_answers(answers_file)
    check_folder(folder, answers)
    if withheld is not None:
        answers = {name: answer for name, answer in answers.items() if withheld in answer.effects}
        if not answers:
            raise ChallengeError(f"--without {withheld}: no case of {answers_file} has that effect")
    homes = {name: _home(folder / name, withheld) for name in sorted(answers)}
    missing = [name for name, home in homes.items() if not (home / VERDICT).is_file()]
    failed: dict[str, str] = {}
    if missing:
        _check_missing(folder, missing, len(homes), diagnose, resume)
        assert diagnose is not None
        leave = (withheld,) if withheld else ()
        cases = {name: folder / name for name in missing}
        jobs = {
            name: (records_of(case), rig or case / "nominal.toml", homes[name], leave) for name, case in cases.items()
        }
        failed = _run(jobs, diagnose, processors() if workers is None else workers, progress)
    outcomes = []
    for name, home in homes.items():
        verdict = None if name in failed else _read(home / VERDICT, read)
        outcomes.append(judge(name, without(answers[name], withheld), verdict))
    return outcomes, failed


def _home(case: Path, withheld: str | None) -> Path:
    return case / f"without-{withheld}" if withheld else case


def records_of(case: Path) -> list[Path]:
    """Records of a case, in the order of their names."""
    return sorted(case.glob("record-*.nc"))


def check_folder(folder: Path, answers: Mapping[str, Answer]) -> None:
    """Refuse a folder that is not that of the answers. Raises ChallengeError."""
    if not folder.is_dir():
        raise ChallengeError(f"challenge folder {folder} does not exist")
    cases = {path.name for path in folder.iterdir() if path.is_dir() and not path.name.startswith(".")}
    lost = sorted(set(answers) - cases)
    if lost:
        raise ChallengeError(
            f"{folder} lacks {len(lost)} of the {len(answers)} cases of the answers, such as {lost[0]}"
        )
    unknown = sorted(cases - set(answers))
    if unknown:
        raise ChallengeError(f"{folder} holds {unknown[0]}, of which the answers say nothing")


def _check_missing(folder: Path, missing: list[str], total: int, diagnose: Diagnose | None, resume: bool) -> None:
    if diagnose is None:
        raise ChallengeError(f"{len(missing)} of {total} cases in {folder} have no {VERDICT}, such as {missing[0]}")
    if len(missing) < total and not resume:
        raise ChallengeError(
            f"{total - len(missing)} of {total} cases in {folder} have a {VERDICT}: add --resume to diagnose the rest,"
            " or remove them"
        )


def _run(
    jobs: Mapping[str, tuple[Sequence[Path], Path, Path, Sequence[str]]],
    diagnose: Diagnose,
    workers: int,
    progress: Progress | None,
) -> dict[str, str]:
    """Diagnose all cases, each in a process of a pool (or in this one without workers); what failed, by case."""
    failed: dict[str, str] = {}

    def done(number: int, name: str, reason: str | None) -> None:
        if reason:
            failed[name] = reason
        if progress:
            progress(number / len(jobs), f"case {number} of {len(jobs)}")

    for job in jobs.values():
        job[2].mkdir(exist_ok=True)
    if workers == 0:
        for number, (name, job) in enumerate(jobs.items(), start=1):
            done(number, name, diagnose(*job))
        return failed
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        futures = {pool.submit(diagnose, *job): name for name, job in jobs.items()}
        try:
            for number, future in enumerate(as_completed(futures), start=1):
                done(number, futures[future], future.result())
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return failed


def _read(path: Path, read: Read) -> Mapping[str, Any]:
    try:
        verdict = read(path)
    except ValueError as error:
        sentence = str(error)
        raise ChallengeError(sentence if str(path) in sentence else f"{path}: {sentence}") from None
    if said(verdict) not in VERDICTS or "place" not in verdict:
        raise ChallengeError(f"{path} must give verdict, one of {', '.join(VERDICTS)}, and place")
    return verdict

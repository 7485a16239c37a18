"""A study of a case from its words to its folder: members, table, indices, pictures, report."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearbench.files import fingerprint
from gearbench.shell.failure import InputError, say
from gearbench.shell.output import Output, claimed
from gearbench.shell.progress import Silent, Steps

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.study.against import Reference
    from gearbench.bench.study.design import Design
    from gearbench.bench.study.indices import Effects
    from gearbench.bench.study.member import Found, Task
    from gearbench.bench.study.quantities import Ask
    from gearbench.rig import Case, Study

@dataclass(frozen=True)
class Plan:
    """A study before anything is computed: its base case, what it varies and asks, and each member's task, or the
    sentence for which there is none."""

    base: Case
    study: Study
    design: Design
    ask: Ask
    tasks: tuple[Task, ...]
    refused: dict[int, str]

    @property
    def identity(self) -> str:
        """What tells it from another study: the sources, every member, what is asked."""
        from gearbench.records.provenance import source_digest

        asked = json.dumps([list(self.ask), self.design.sample, self.study.seed])
        members = [task.case or self.refused[task.number] for task in self.tasks]
        return fingerprint(source_digest(), asked, *members)


def campaign(
    case: str | Path | Case,
    out: str | Path,
    vary: Sequence[str] = (),
    *,
    of: Sequence[str] = (),
    sample: str | None = None,
    size: int | None = None,
    seed: int | None = None,
    torque: float | None = None,
    positions: int | None = None,
    cycles: int | None = None,
    against: str | Path | xr.Dataset | None = None,
    settings: Sequence[str] = (),
    workers: int | None = None,
    cluster: str | None = None,
    force: bool = False,
    progress: Steps | None = None,
) -> xr.Dataset:
    """Many members of a case, each with other values of what `vary` names, and what comes out of them.

    `vary`: "KEY=V1,V2,..", "KEY=LOW:HIGH:COUNT" (levels), "KEY=LOW:HIGH", "KEY=normal(MEAN,SD)" (drawn); KEY1+KEY2 move
    together. `of`: results (docs/campaigns.md). `sample`: grid, lhs (`size` members) or sobol (`size` base points, a
    power of 2). `against`: the measured record that the result "gap" is told from. What is not given is the case's
    [study]. Members run on `workers` processes of this machine (absent:
    as many as it has processors), or on `cluster`: the address of a dask scheduler, or "slurm". `settings` are those of
    `read_case`.

    Returns the table over `member`, which the folder `out` holds as study.csv and study.nc beside pictures, report and
    a folder for each member. A member that fails is a row with a `sentence`. Resumes in the folder of the same study
    and sources; another's is refused unless `force`. Raises CaseError, BenchError or InputError, one sentence.

    >>> import gearbench as gb
    >>> widths = ["rig.driver.face_width_mm=10:20:3"]
    >>> table = gb.campaign("quick_lumped", "out_study", widths, of=["te-mean"], workers=1)
    >>> table["te_mean_um"].values.round(1)
    array([16.6, 11.1,  8.3])
    """
    given: dict[str, Any] = {"vary": tuple(vary) or None, "of": tuple(of) or None, "sample": sample, "size": size}
    given |= {"seed": seed, "torque": torque, "positions": positions, "cycles": cycles}
    teller = progress or Silent()
    teller.step("cases")
    stated = {name: value for name, value in given.items() if value is not None}
    plan = plan_of(case, settings, stated, teller, against)
    if workers is not None and workers < 1:
        raise InputError(f"--workers {workers} must be at least 1")
    if cluster:
        from gearbench.bench.study.cluster import check_cluster

        check_cluster(cluster)
    with claimed(Path(out), "campaign", plan.identity, force) as output:
        table, fresh = members(plan, output, workers, cluster, teller)
        if fresh or not all(output.has(name) for name in _expected(table)):
            teller.step("table, pictures, report")
            products(plan, table, output)
    return table


def plan_of(
    source: str | Path | Case, settings: Sequence[str], given: dict[str, Any], teller: Steps,
    against: str | Path | xr.Dataset | None = None,
) -> Plan:  # fmt: skip
    """The study that `given` options make of a case, held `against` a record. Raises CaseError, RecordError or
    BenchError."""
    from gearbench.bench.refusals.stated import mean_torque
    from gearbench.bench.study.design import design_of
    from gearbench.bench.study.quantities import QUANTITIES, Ask, check_quantities
    from gearbench.rig import CaseError

    with reader(source) as read:
        base = read(settings)
        study = _study(base, given)
        design = design_of(study)
        ask = Ask(check_quantities(study.of), study.torque, study.positions, study.cycles)
        ask = ask._replace(against=_reference(ask, against))
        if ask.torque is None and any(QUANTITIES[name].stage == "static" for name in ask.of):
            mean_torque(base)
        from gearbench.bench.study.member import Task

        tasks, refused = [], {}
        for number in range(len(design.members)):
            teller(number / len(design.members))
            text = ""
            try:
                text = member_text(read([*settings, *design.settings(number)]))
            except CaseError as reason:
                refused[number] = str(reason)
            tasks.append(Task(number, text, ask))
    return Plan(base, study, design, ask, tuple(tasks), refused)


def _reference(ask: Ask, against: str | Path | xr.Dataset | None) -> Reference | None:
    """What the study holds its members against. Raises InputError where it is missing or not asked for."""
    wanted = "gap" in ask.of
    if against is None:
        if wanted:
            raise InputError("the result gap needs the measured record: give it with --against RECORD")
        return None
    if not wanted:
        raise InputError("--against belongs to the result gap: ask for it with --of gap")
    from gearbench.bench.results.compare import load_results, results_of
    from gearbench.bench.study.against import reference_of

    given = load_results(Path(against)) if isinstance(against, str | Path) else results_of("against", against)
    if given.record is None:
        raise InputError(f"--against {given.name} is not a record")
    for doubt in given.doubts:
        say(f"warning: {doubt}")
    return reference_of(given.record)


def members(
    plan: Plan, output: Output, workers: int | None, cluster: str | None, teller: Steps
) -> tuple[xr.Dataset, bool]:
    """The table of all members, those that the folder holds read and the others computed; whether any was computed."""
    from gearbench.bench.study.store import Shelf

    shelf = Shelf(output.folder, len(plan.tasks))
    shelf.clear(range(len(plan.tasks)))
    found: dict[int, Found] = {}
    for task in plan.tasks:
        kept = shelf.load(task)
        if kept is not None:
            found[task.number] = kept
    missing = [task for task in plan.tasks if task.number not in found]
    teller.step("members")
    for one in _found(plan, missing, workers, cluster):
        found[one.number] = one
        # One whose process died says nothing of its case: the same command tries it again.
        if one.sources:
            names = [factor.name for factor in plan.design.factors]
            values = dict(zip(names, plan.design.members[one.number], strict=True))
            shelf.save(plan.tasks[one.number], one, values, plan.study.seed)
        failed = sum(bool(each.sentence) for each in found.values())
        note = f"{len(found)} of {len(plan.tasks)}" + (f", {failed} failed" if failed else "")
        teller(len(found) / len(plan.tasks), note)
    return _table(plan, [found[number] for number in range(len(plan.tasks))]), bool(missing)


def _found(plan: Plan, missing: Sequence[Task], workers: int | None, cluster: str | None) -> Iterator[Found]:
    """What each missing member gives, as it comes. Raises BenchError for a worker with other sources."""
    from gearbench.bench.errors import BenchError
    from gearbench.bench.plan.workers import processors
    from gearbench.bench.study.cluster import compute_there
    from gearbench.bench.study.member import Found
    from gearbench.bench.study.processes import compute_here
    from gearbench.records.provenance import source_digest

    ours = source_digest()
    for task in missing:
        if not task.case:
            yield Found(task.number, {}, plan.refused[task.number], sources=ours)
    wanted = [task for task in missing if task.case]
    if not wanted:
        return
    count = workers or processors()
    stream = compute_there(wanted, cluster, count) if cluster else compute_here(wanted, count)
    with closing(stream):  # type: ignore[type-var]
        for one in stream:
            if one.sources not in ("", ours):
                raise BenchError("a worker has other sources of gearbench than this process: install the same there")
            yield one


def _table(plan: Plan, found: Sequence[Found]) -> xr.Dataset:
    from gearbench.bench.study.quantities import columns_of
    from gearbench.bench.study.table import study_dataset
    from gearbench.records.provenance import provenance

    ask = {"of": list(plan.ask.of), "torque": plan.ask.torque, "positions": plan.ask.positions}
    asked = {**ask, "cycles": plan.ask.cycles, "vary": list(plan.study.vary), "sample": plan.study.sample}
    about = {"case": plan.base.name, "provenance": provenance(member_text(plan.base), plan.study.seed, asked)}
    return study_dataset(
        plan.design,
        columns_of(plan.ask.of),
        [one.numbers for one in found],
        [one.sentence for one in found],
        [one.warnings for one in found],
        about,
    )


def _expected(table: xr.Dataset) -> list[str]:
    """Names of the products."""
    from gearbench.bench.study.table import named

    pictures = ["scatter.png", "tornado.png"] if len(named(table, "factor")) > 1 else ["scatter.png"]
    return ["study.csv", "study.nc", "effects.csv", "report.html", *pictures]


def products(plan: Plan, table: xr.Dataset, output: Output) -> None:
    """Table, effects, pictures and report of a study, in its folder."""
    from gearbench.bench.study.indices import effects_of
    from gearbench.bench.study.table import csv_text, named
    from gearbench.figures.studies.study import draw_scatter, draw_tornado
    from gearbench.records import write_dataset
    from gearbench.report.study import study_page
    from gearbench.words.study import effects_csv

    effects = [effects_of(plan.design, table, name, plan.study.seed) for name in named(table, "result")]
    output.write_text("study.csv", csv_text(table))
    output.write("study.nc", partial(write_dataset, table))
    output.write_text("effects.csv", effects_csv(effects))
    output.write("scatter.png", partial(draw_scatter, table))
    pictures: dict[str, Any] = {"scatter": partial(draw_scatter, table)}
    if _several(effects):
        pictures["tornado"] = partial(draw_tornado, table, effects)
        output.write("tornado.png", pictures["tornado"])
    output.write_text("report.html", study_page(plan.base.name, plan.design, table, effects, pictures))


def _several(effects: Sequence[Effects]) -> bool:
    """Whether there are factors to compare."""
    return bool(effects) and len(effects[0].each) > 1


class reader:
    """Reads the case with settings on top, as often as wanted; a Case in memory goes through a file of its own."""

    def __init__(self, source: str | Path | Case) -> None:
        self.source = source
        self._folder: Any = None

    def __enter__(self) -> Any:
        from gearbench.cases import read_case
        from gearbench.rig import Case, dump_case

        source = self.source
        if isinstance(source, Case):
            from tempfile import TemporaryDirectory

            self._folder = TemporaryDirectory()
            path = Path(self._folder.name) / "case.toml"
            path.write_text(dump_case(source), encoding="utf-8")
            source = path
        return partial(read_case, source)

    def __exit__(self, *_: object) -> None:
        if self._folder is not None:
            self._folder.cleanup()


def _study(base: Case, given: dict[str, Any]) -> Study:
    """The case's own study with what is given on top. Raises CaseError."""
    from pydantic import ValidationError

    from gearbench.rig import CaseError, Study
    from gearbench.rig.casefile.case import one_sentence

    own = base.study.model_dump() if base.study is not None else {}
    try:
        return Study.model_validate({**own, **given})
    except ValidationError as error:
        raise CaseError(one_sentence(error)) from error


def member_text(case: Case) -> str:
    """A member's whole case as TOML: one experiment, no study."""
    from gearbench.rig import dump_case

    return dump_case(case.model_copy(update={"study": None, "conditions": ()}))

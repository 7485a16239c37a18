"""The main job: statics, record, frequency responses, pictures and summary of every experiment of a case."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearbench.bench.results.summary import run_numbers
from gearbench.files import fingerprint
from gearbench.geometry.pair.zones import contact_span, fewest_pairs, zone_label
from gearbench.shell.checkpoints import checkpoints_of
from gearbench.shell.failure import InputError
from gearbench.shell.output import Output, claimed
from gearbench.shell.progress import Silent, Steps
from gearbench.words.accuracy import honest_warning
from gearbench.words.distortion import distortion_numbers
from gearbench.words.summary import summary_text

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.figures.of_run import RunResults
    from gearbench.geometry import Pair
    from gearbench.report.run import RunPart
    from gearbench.rig import Case

POSITIONS = 256  # mesh phases of the static response
REPORT = "report.html"

ABOUT = {
    "case.toml": "the case with every key, defaults included",
    "static.nc": "static transmission error, stiffness and load sharing over the mesh period",
    "record.nc": "the record, as a rig would hand it back",
    "frf.nc": "frequency response identified from the record",
    "exact.nc": "exact frequency response of the lumped model",
    "frozen.nc": "frequency response with coefficients frozen at each phase (not the truth)",
    "linearised.nc": "first natural frequency of the finite-element model, linearised at each mesh phase",
    "gears.png": "gear pair and mesh",
}


@dataclass
class Job:
    """One experiment of a case in an output folder; `suffix` tells conditions apart in file names."""

    case: Case
    output: Output
    progress: Steps
    suffix: str = ""
    workers: int | None = None

    def name(self, base: str) -> str:
        """File name of a product: record.nc, or record-CONDITION.nc."""
        stem, dot, ending = base.rpartition(".")
        return f"{stem}{self.suffix}{dot}{ending}"

    def dataset(self, base: str, read: Callable[[Path], Any], make: Callable[[], Any], write: Any) -> xr.Dataset:
        """The product of an earlier run where there is one; else made, written and returned."""
        name = self.name(base)
        if self.output.has(name):
            return read(self.output.path(name))
        self.progress.step(name)
        made: xr.Dataset = make()
        self.output.write(name, lambda path: write(made, path))
        return made

    def picture(self, base: str, draw: Callable[[Path], None]) -> None:
        """A picture, drawn unless an earlier run has."""
        name = self.name(base)
        if not self.output.has(name):
            self.progress.step(name)
            self.output.write(name, draw)


def run(
    case: Case,
    out: str | Path,
    *,
    force: bool = False,
    progress: Steps | None = None,
    workers: int | None = None,
) -> list[dict[str, Any]]:
    """The main job of a case: geometry, mesh, simulation, identification, pictures and summary in the folder `out`.

    Returns the numbers of each experiment's summary (one, or one for each condition). Resumes in the folder of the same
    case and sources; another's is refused unless `force`, which removes what that run wrote. `progress` hears of steps
    and of fractions done; `workers` as in `simulate`. Raises InputError for the folder or a case without multisine, and
    what a step raises.

    >>> import gearbench as gb
    >>> short = ["realisations=4", "samples_per_period=4096", "multisine.band_hz=[900, 1500]"]
    >>> lpm = ["band_hz=[1000, 1500]", "harmonics=8", "order=1", "window=8"]
    >>> keys = [f"experiment.{key}" for key in short] + [f"identification.{key}" for key in lpm]
    >>> (numbers,) = gb.run(gb.read_case("quick_lumped", keys), "out_first")
    >>> f"{numbers['te_peak_to_peak_um']:.2f} um"
    '5.53 um'
    """
    from gearbench.bench.experiment import check_record_held
    from gearbench.bench.readiness import check_case
    from gearbench.bench.refusals.stated import check_stated
    from gearbench.records.provenance import source_digest
    from gearbench.rig import dump_case

    # What cannot be run is refused before a folder is made.
    check_stated(case, "a run")
    check_case(case)
    for _, one in case.experiments():
        if one.experiment.multisine is None:
            raise InputError(
                "experiment.multisine is missing: without excitation run has nothing to identify; `simulate` and"
                " `static` need none"
            )
        if one.experiment.changes_speed:
            raise InputError(
                "experiment.speed_end_rpm or speed_table changes the speed: run identifies a response at a constant"
                " mesh frequency; `simulate` makes the record"
            )
        check_record_held(one)
    with claimed(Path(out), "run", fingerprint(dump_case(case), source_digest()), force) as output:
        jobs = [
            Job(one, output, progress or Silent(), f"-{name}" if name else "", workers)
            for name, one in case.experiments()
        ]
        with _compiling(jobs) as ready:
            _simulate_together(jobs, workers, ready)
            done = [run_experiment(job, ready) for job in jobs]
        if not output.has(REPORT):
            jobs[0].progress.step(REPORT)
            _write_report(case, output, [part for _, part in done if part is not None])
        return [numbers for numbers, _ in done]


@contextmanager
def _compiling(jobs: list[Job]) -> Iterator[Callable[[], None]]:
    """The loop in time being compiled while gears are condensed and static positions found, where a record is still to
    be made of finite elements; what is given returns when the loop is there."""
    lacking = any(not job.output.has(job.name("record.nc")) for job in jobs)
    if not lacking or jobs[0].case.simulation.model != "reduced":
        yield lambda: None
        return
    from gearbench.bench.elastic.ahead import compiled_ahead

    with compiled_ahead(jobs[0].case.rig) as ahead:
        yield ahead.wait


def _simulate_together(jobs: list[Job], workers: int | None, ready: Callable[[], None]) -> None:
    """Records of several conditions side by side, those that an earlier run has not left."""
    from gearbench.bench.conditions import simulate_all_to

    missing = [job for job in jobs if not job.output.has(job.name("record.nc"))]
    if len(missing) < 2:
        return

    def take(number: int, _: dict[str, Any]) -> None:
        missing[number].output.note(missing[number].name("record.nc"), paths[number])

    progress, paths = missing[0].progress, [job.output.path(job.name("record.nc")) for job in missing]
    progress.step(f"records of {len(missing)} conditions")
    ready()
    with ExitStack() as folders:
        kept = [folders.enter_context(checkpoints_of(path, within=True)) for path in paths]
        cases = [job.case for job in missing]
        simulate_all_to(cases, paths, take, progress=progress, checkpoints=kept, workers=workers)


def run_experiment(job: Job, ready: Callable[[], None]) -> tuple[dict[str, Any], RunPart | None]:
    """All products of one experiment; the numbers of its summary, and its part of a report that is still to be made.
    `ready` is called before loops in time are."""
    from gearbench.bench import simulate_to
    from gearbench.bench.models import model_for
    from gearbench.bench.results.responses import identify_case, linearised_modes, reference_results
    from gearbench.bench.statics import static
    from gearbench.figures.of_run import FIGURES, RunResults
    from gearbench.geometry import pair
    from gearbench.identification import distortion, is_coset, read_frf, write_frf
    from gearbench.records import read_dataset, read_record, write_dataset
    from gearbench.rig import dump_case

    case, progress = job.case, job.progress
    meshing = pair(case.rig)
    job.output.write_text(job.name("case.toml"), dump_case(case))
    _draw_gears(job, meshing)
    statics = job.dataset(
        "static.nc", read_dataset, lambda: static(case, positions=POSITIONS, progress=progress), write_dataset
    )
    if not job.output.has(job.name("record.nc")):
        progress.step(job.name("record.nc"))
        ready()
        with checkpoints_of(job.output.path(job.name("record.nc")), within=True) as kept:
            # Piece by piece into its file: memory then holds the record, not what it is made of besides.
            simulating = partial(simulate_to, case, progress=progress, checkpoints=kept, workers=job.workers)
            job.output.write(job.name("record.nc"), simulating)
    record = read_record(job.output.path(job.name("record.nc")))
    modes: dict[str, xr.Dataset] = {}
    results = {"identified": job.dataset("frf.nc", read_frf, lambda: identify_case(case, record, progress), write_frf)}
    if not model_for(case)[1].elastic:
        made: dict[str, xr.Dataset] = {}

        def reference(kind: str) -> xr.Dataset:
            made.update(made or reference_results(case, results["identified"]))
            return made[kind]

        for kind in ("exact", "frozen"):
            results[kind] = job.dataset(f"{kind}.nc", read_frf, partial(reference, kind), write_frf)
    else:
        modes["linearised"] = job.dataset("linearised.nc", read_dataset, lambda: linearised_modes(case), write_dataset)
    span = contact_span(meshing)
    zones = fewest_pairs(span)
    numbers = run_numbers(case, statics, record, results, modes, zones)
    split = distortion([record]) if is_coset([record]) else None
    numbers |= {"distortion": distortion_numbers(split)} if split is not None else {}
    drawn = RunResults(statics, record, results, modes, zones, zone_label(span), honest_warning(numbers), split)
    for figure in (one for one in FIGURES if one.fits(drawn)):
        job.picture(figure.name, partial(figure.draw, drawn))
    about = ABOUT | {figure.name: figure.about for figure in FIGURES} | {"summary.json": "the numbers of this summary"}
    held = {*job.output.files(), job.name("summary.json")}
    numbers["files"] = {job.name(base): words for base, words in about.items() if job.name(base) in held}
    numbers["files"][REPORT] = "all of this on one page, to zoom and to ask"
    _write_summary(job, numbers)
    return numbers, None if job.output.has(REPORT) else _part(job, numbers, drawn)


def _part(job: Job, numbers: dict[str, Any], drawn: RunResults) -> RunPart:
    """The experiment's part of the report."""
    from gearbench.report.run import run_part

    digests = job.output.files()
    digests.pop(REPORT, None)  # no page holds its own
    files = {name: (words, digests[name]) for name, words in numbers["files"].items() if name in digests}
    return run_part(
        job.suffix.removeprefix("-"), numbers, drawn, lambda base: job.output.path(job.name(base)), files
    )


def _write_report(case: Case, output: Output, parts: list[RunPart]) -> None:
    from gearbench.report.parts import versions
    from gearbench.report.run import run_page

    output.write_text(REPORT, run_page(case, parts, versions()))


def _draw_gears(job: Job, meshing: Pair) -> None:
    from gearbench.figures.gears.gear import draw_pair

    def draw(path: Path) -> None:
        from gearbench.bench.models import model_for
        from gearbench.geometry import mesh_pair

        elastic = model_for(job.case)[1].elastic
        simulation = job.case.simulation
        mesh = mesh_pair(job.case.rig, simulation.element_size, simulation.element) if elastic else None
        draw_pair(path, job.case.rig, meshing, mesh)

    job.picture("gears.png", draw)


def _write_summary(job: Job, numbers: dict[str, Any]) -> None:
    from gearbench.shell.options import json_text

    job.output.write_text(job.name("summary.json"), json_text(numbers) + "\n")
    job.output.write_text(job.name("summary.md"), summary_text(numbers))

"""`diagnose RECORD... --rig CASE --out DIR`: which effect, that the simulation leaves out, causes its gap."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.shell.options import JsonOption, SetOption, load_case, print_json
from gearbench.shell.output import Output, claimed, fingerprint
from gearbench.shell.progress import Progress

if TYPE_CHECKING:
    from gearbench.commands.diagnosis_job import Diagnosis, Simulate, Taken
    from gearbench.report.diagnosis import Report
    from gearbench.rig import Case

PICTURES = {
    "where": "Shares of the gap between the records and the nominal rig.",
    "gap": "Rms gap from the nominal rig to the noise floor, channel by channel.",
    "traces": "What remains between the record and its simulations: in time, and by frequency.",
}


def diagnose(
    records: Annotated[list[Path], typer.Argument(metavar="RECORD...", help="records: one of each condition")],
    rig: Annotated[
        str, typer.Option("--rig", metavar="CASE", help="case of the nominal rig, with its uncertainties")
    ],
    out: Annotated[Path, typer.Option("--out", help="folder for verdict.json, updated.toml and report.html")],
    held_out: Annotated[
        str | None,
        typer.Option(
            "--held-out",
            metavar="NAME",
            help="record to judge the result by, not to find it; absent: the one named held-out, or of four or more"
            " the last",
        ),
    ] = None,
    without: Annotated[
        list[str] | None, typer.Option("--without", metavar="EFFECT", help="leave this effect out of the library")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="replace what another diagnosis left in the folder")
    ] = False,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Diagnose the gap between records and the nominal rig: where it is, what causes it, how far it shrinks."""
    nominal = load_case(rig, settings)
    from gearbench.commands.diagnosis_job import take_in
    from gearbench.words.diagnosis import confidence, headline

    with Progress(f"diagnose {nominal.name}") as progress:
        progress.step("reading")
        taken = take_in(records, nominal, held_out=held_out, without=without or ())
        with claimed(out, "diagnose", _identity(taken, records), force) as output:
            diagnosis = found(taken, output, progress.step)
            progress.step("report")
            write_report(diagnosis, records, output)
    if as_json:
        print_json(json.loads(output.path("verdict.json").read_text(encoding="utf-8")))
        return
    typer.echo(headline(diagnosis.verdict))
    typer.echo(confidence(diagnosis.verdict))
    typer.echo(f"{out}: report.html, verdict.json, updated.toml")


def found(
    taken: Taken,
    output: Output,
    report: Callable[[str], None] = lambda step: None,
    *,
    find: Callable[..., object] | None = None,
    simulate: Simulate | None = None,
) -> Diagnosis:
    """The diagnosis that an earlier run left in the folder; else made, and written to it."""
    from gearbench.commands.diagnosis_job import Diagnosis
    from gearbench.commands.diagnosis_job import diagnose as job
    from gearbench.diagnosis.verdict import read_verdict, verdict_json
    from gearbench.rig import read_case

    if all(output.has(name) for name in ("verdict.json", "recalibrated.toml", "updated.toml")):
        verdict = read_verdict(output.path("verdict.json"))
        updated = read_case(output.path("updated.toml")) if verdict.verdict == "effect" else None
        return Diagnosis(taken, verdict, read_case(output.path("recalibrated.toml")), updated)
    made = job(taken, find=find, simulate=simulate, report=report)
    output.write("recalibrated.toml", partial(_write_case, made.recalibrated))
    output.write("updated.toml", partial(_write_case, made.updated))
    output.write_text("verdict.json", verdict_json(made.verdict))
    return made


def write_report(
    diagnosis: Diagnosis, records: Sequence[Path], output: Output, simulate: Simulate | None = None
) -> None:
    """The pictures and report.html, unless an earlier run left them."""
    from gearbench.report.diagnosis import report_page

    wanted = ["report.html", *(f"{name}.png" for name in PICTURES)]
    mark = output.mark()
    if mark.get("complete") and all(output.has(name) for name in mark.get("files", [])) and output.has(wanted[0]):
        return
    report = report_of(diagnosis, records, simulate)
    for name, (draw, _) in report.pictures.items():
        output.write(f"{name}.png", draw)
    output.write_text("report.html", report_page(report))
    output.set_mark(output.mark() | {"complete": True})


def report_of(diagnosis: Diagnosis, records: Sequence[Path], simulate: Simulate | None = None) -> Report:
    """What the report shows of a diagnosis."""
    from gearbench.commands.diagnosis_job import default_replay, traces_of
    from gearbench.figures.diagnosis import draw_where
    from gearbench.figures.diagnosis_gap import draw_gap, draw_traces
    from gearbench.report.diagnosis import Report

    verdict = diagnosis.verdict
    draws: dict[str, Callable[[Path], None]] = {}
    if verdict.where:
        draws["where"] = partial(draw_where, shares=verdict.where)
    if verdict.gap:
        draws["gap"] = partial(draw_gap, gaps=verdict.gap, record=diagnosis.taken.judged.name)
        traces = traces_of(diagnosis, simulate or default_replay(diagnosis.taken))
        assert traces is not None
        draws["traces"] = partial(draw_traces, traces=traces)
    pictures = {name: (draw, PICTURES[name]) for name, draw in draws.items()}
    return Report(
        diagnosis.taken.nominal.name, verdict, _sources(diagnosis.taken, records), pictures, _about(diagnosis.taken)
    )


def _sources(taken: Taken, records: Sequence[Path]) -> tuple:
    from gearbench.report.diagnosis import Source

    made = []
    for path in records:
        digest = _digest(path)
        for one in (*taken.measurements, *([taken.held_out] if taken.held_out else [])):
            if one.path == path:
                used = "judging" if one is taken.held_out else "finding"
                made.append(Source(one.name, path.name, digest, used, one.warnings))
    return tuple(made)


def _about(taken: Taken) -> tuple[tuple[str, str], ...]:
    from gearbench.records.provenance import package_version, source_digest
    from gearbench.rig import dump_case

    case = hashlib.sha256(dump_case(taken.nominal).encode()).hexdigest()
    return (
        ("gearbench", package_version()),
        ("sources (SHA-256)", source_digest()[:16]),
        ("nominal rig", taken.nominal.name),
        ("its case (SHA-256)", case[:16]),
        ("left out of the library", ", ".join(taken.without) or "nothing"),
    )


def _identity(taken: Taken, records: Sequence[Path]) -> str:
    from gearbench.records.provenance import source_digest
    from gearbench.rig import dump_case

    held_out = taken.held_out.name if taken.held_out else ""
    parts = [dump_case(taken.nominal), source_digest(), held_out, ",".join(sorted(taken.without))]
    return fingerprint(*parts, *(f"{path.name} {_digest(path)}" for path in records))


def _digest(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(2**20):
            digest.update(block)
    return digest.hexdigest()


def _write_case(case: Case, path: Path) -> None:
    from gearbench.rig import dump_case, read_case

    path.write_text(dump_case(case), encoding="utf-8")
    read_case(path)  # what is written can be run

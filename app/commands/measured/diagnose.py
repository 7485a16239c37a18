"""`diagnose RECORD... --rig CASE --out DIR`: which effect, that the simulation leaves out, causes its gap."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.files import digest_of, fingerprint
from gearbench.shell.options import JsonOption, SetOption, load_case, print_json
from gearbench.shell.output import Output, claimed
from gearbench.shell.progress import Progress

if TYPE_CHECKING:
    from gearbench.diagnosis.diagnosis import Diagnosis, Inputs
    from gearbench.report.diagnosis import Report, Source
    from gearbench.rig import Case

PICTURES = {
    "waterfall": "What recalibration and each effect take off the gap, step by step; dashed: what comes back without an"
    " effect alone, where its step does not show it.",
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
    calibrate: Annotated[
        int,
        typer.Option(
            "--calibrate",
            metavar="RIGS",
            min=0,
            help="limits and probabilities from so many truth rigs around this one, under its conditions and noise (a"
            " dozen: some minutes, once for a rig and experiment); 0: from the population's",
        ),
    ] = 0,
    confirm: Annotated[
        bool,
        typer.Option(
            "--confirm/--no-confirm",
            help="ask the reduced finite-element model too: the rigs are fitted again by it and answer the judged"
            " record (one to some minutes)",
        ),
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="replace what another diagnosis left in the folder")
    ] = False,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Diagnose the gap between records and the nominal rig: where it is, what causes it, how far it shrinks."""
    nominal = load_case(rig, settings)
    from gearbench.commands.measured.challenge import diagnose_case
    from gearbench.diagnosis.diagnosis import take_in
    from gearbench.rig_limits import limits_of

    with Progress(f"diagnose {nominal.name}") as progress:
        progress.step("reading")
        inputs = take_in(records, nominal, held_out=held_out, without=without or ())
        if calibrate:
            progress.step("calibrating on truth rigs around this one")
            inputs = replace(inputs, known=limits_of(inputs, calibrate, diagnose_case, progress))
        with claimed(out, "diagnose", _identity(inputs, confirm), force) as output:
            diagnosis = diagnosis_in(output, inputs, progress, confirm)
            progress.step("report")
            write_report(diagnosis, output)
    if as_json:
        print_json(json.loads(output.path("verdict.json").read_text(encoding="utf-8")))
        return
    _tell(diagnosis, out)


def _tell(diagnosis: Diagnosis, out: Path) -> None:
    """Print what was found, and where it lies."""
    from gearbench.words.diagnosis import confidence, headline, parameters_in_words, sentences

    typer.echo(headline(diagnosis.verdict))
    typer.echo(confidence(diagnosis.verdict))
    for sentence in (*parameters_in_words(diagnosis.verdict), *sentences(diagnosis.verdict)):
        typer.echo(f"  {sentence}")
    typer.echo(f"{out}: report.html, verdict.json, updated.toml")


def diagnosis_in(
    output: Output, inputs: Inputs, progress: Progress, confirm: bool = False
) -> Diagnosis:
    """The diagnosis that an earlier run left in the folder; else made, and written to it."""
    from gearbench.diagnosis.diagnosis import Diagnosis, diagnosed
    from gearbench.diagnosis.verdict_file import read_verdict, verdict_json
    from gearbench.rig import read_case

    if all(output.has(name) for name in ("verdict.json", "recalibrated.toml", "updated.toml")):
        verdict = read_verdict(output.path("verdict.json"))
        updated = read_case(output.path("updated.toml")) if verdict.verdict == "effects" else None
        return Diagnosis(inputs, verdict, read_case(output.path("recalibrated.toml")), updated)
    made = diagnosed(inputs, progress.step, doing=progress.doing, confirm=confirm)
    output.write("recalibrated.toml", partial(_write_case, made.recalibrated))
    output.write("updated.toml", partial(_write_case, made.updated))
    output.write_text("verdict.json", verdict_json(made.verdict))
    return made


def write_report(diagnosis: Diagnosis, output: Output) -> None:
    """The pictures and report.html, unless an earlier run left them."""
    from gearbench.report.diagnosis import report_page

    wanted = ["report.html", *(f"{name}.png" for name in PICTURES)]
    mark = output.mark()
    if mark.get("complete") and all(output.has(name) for name in output.files()) and output.has(wanted[0]):
        return
    report = report_of(diagnosis)
    for name, (draw, _) in report.pictures.items():
        output.write(f"{name}.png", draw)
    output.write_text("report.html", report_page(report))
    output.set_mark(output.mark() | {"complete": True})


def report_of(diagnosis: Diagnosis) -> Report:
    """What the report shows of a diagnosis."""
    from gearbench.diagnosis.diagnosis import replays_of
    from gearbench.diagnosis.replay.traces import traces_of
    from gearbench.figures.gaps.diagnosis import draw_where
    from gearbench.figures.gaps.diagnosis_gap import draw_gap, draw_traces
    from gearbench.figures.gaps.diagnosis_waterfall import draw_waterfall
    from gearbench.report.diagnosis import Report

    verdict, inputs = diagnosis.verdict, diagnosis.inputs
    draws: dict[str, Callable[[Path], None]] = {}
    if verdict.where:
        draws["where"] = partial(draw_where, shares=verdict.where)
    if verdict.gap:
        draws["waterfall"] = partial(
            draw_waterfall, gaps=verdict.gap, effects=verdict.effects, record=diagnosis.told.name
        )
        draws["gap"] = partial(draw_gap, gaps=verdict.gap, record=diagnosis.told.name)
        simulate = replays_of(inputs.nominal, inputs.all)
        traces = traces_of(verdict.gap[0].channel, diagnosis.told, diagnosis.stages, simulate)
        draws["traces"] = partial(draw_traces, traces=traces)
    pictures = {name: (draw, PICTURES[name]) for name, draw in draws.items()}
    return Report(inputs.nominal.name, verdict, _sources(diagnosis), pictures, _about(inputs))


def _sources(diagnosis: Diagnosis) -> tuple[Source, ...]:
    from gearbench.report.diagnosis import Source

    inputs, made = diagnosis.inputs, []
    for one in inputs.all:
        assert one.path is not None
        used = "finding" if one is not inputs.held_out else "judging" if diagnosis.verdict.held_out else "nothing"
        made.append(Source(one.name, one.path.name, digest_of(one.path), used, one.warnings))
    return tuple(made)


def _about(inputs: Inputs) -> tuple[tuple[str, str], ...]:
    from gearbench.records.provenance import package_version, source_digest
    from gearbench.rig import dump_case
    from gearbench.words.diagnosis import basis

    case = fingerprint(dump_case(inputs.nominal))
    return (
        ("gearbench", package_version()),
        ("sources (SHA-256)", source_digest()[:16]),
        ("nominal rig", inputs.nominal.name),
        ("its case (SHA-256)", case[:16]),
        ("left out of the library", ", ".join(inputs.without) or "nothing"),
        ("limits and probabilities", basis(inputs.known.source, inputs.known.rigs)),
    )


def _identity(inputs: Inputs, confirm: bool = False) -> str:
    from gearbench.records.provenance import source_digest
    from gearbench.rig import dump_case

    held_out = inputs.held_out.name if inputs.held_out else ""
    parts = [dump_case(inputs.nominal), source_digest(), held_out, ",".join(sorted(inputs.without))]
    parts += [repr(inputs.known), *(["confirm"] if confirm else [])]
    return fingerprint(*parts, *(f"{one.path.name} {digest_of(one.path)}" for one in inputs.all if one.path))


def _write_case(case: Case, path: Path) -> None:
    from gearbench.rig import dump_case, read_case

    path.write_text(dump_case(case), encoding="utf-8")
    read_case(path)  # what is written can be run

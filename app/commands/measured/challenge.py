"""`challenge make` and `challenge score`: truth rigs with withheld effects, and what a diagnosis makes of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from gearbench.shell.options import JsonOption, SetOption, load_case, print_json
from gearbench.shell.progress import Progress

challenge = typer.Typer(
    name="challenge",
    help="Make truth rigs with withheld effects, and score a diagnosis of them.",
    no_args_is_help=True,
    add_completion=False,
)

AnswersOption = Annotated[Path, typer.Option("--answers", metavar="FILE", help="answers, apart from the cases")]


@challenge.command()
def make(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="folder of the cases")],
    answers: AnswersOption,
    seed: Annotated[int, typer.Option("--seed", min=0, help="seed of the random draws; written into the answers only")],
    cases: Annotated[
        int,
        typer.Option("--cases", min=1, help="number of cases: without, with a known, with a foreign effect, 60:81:30"),
    ] = 171,
    rig: Annotated[str, typer.Option("--rig", metavar="CASE", help="case of the nominal rig")] = "gap_demo",
    family: Annotated[
        str, typer.Option("--family", help="structure of the truth rigs: development, calibration or test")
    ] = "test",
    mix: Annotated[
        str | None,
        typer.Option(
            "--mix", help="numbers instead of --cases: controls=12,per-effect=4,foreign=12,pairs=2,triples=1,reduced=4"
        ),
    ] = None,
    draw_rigs: Annotated[
        bool,
        typer.Option("--draw-rigs", help="draw the nominal rig of each case too: teeth, module, torque, speeds, noise"),
    ] = False,
    settings: SetOption = None,
) -> None:
    """Make DIR/ID/{nominal.toml, record-*.nc} from truth rigs, and their answers. Goes on where it was stopped."""
    nominal = load_case(rig, settings)
    from gearbench.challenge.making.cases import make_challenge
    from gearbench.challenge.making.plan import default_mix, parse_mix

    wanted = parse_mix(mix) if mix is not None else default_mix(cases)
    with Progress("challenge make") as progress:
        progress.step("measuring truth rigs")
        made = make_challenge(nominal, wanted, seed, out, answers, family, progress, drawn=draw_rigs)
    typer.echo(f"{out}: {len(made)} cases; answers in {answers}")


@challenge.command()
def score(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="folder of the cases")],
    answers: AnswersOption,
    rig: Annotated[
        str | None, typer.Option("--rig", metavar="CASE", help="nominal rig instead of each case's nominal.toml")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="diagnose the cases that have no verdict yet")] = False,
    without: Annotated[
        str | None,
        typer.Option("--without", metavar="EFFECT", help="take it out of the library: its cases must be refused"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Score DIR/ID/verdict.json of any program; where no case has one, the diagnosis makes them first."""
    from gearbench.cases import case_files
    from gearbench.challenge.scoring.judge import score_folder
    from gearbench.challenge.scoring.score import score as tally
    from gearbench.challenge.scoring.text import score_text
    from gearbench.records.provenance import package_version, source_digest

    path = None
    if rig is not None:
        load_case(rig, None)
        path = Path(rig) if Path(rig).exists() else case_files()[rig]
    with Progress("challenge score") as progress:
        progress.step("diagnosing")
        outcomes, failed = score_folder(
            folder, answers, read, diagnose_case, resume=resume, withheld=without, rig=path, progress=progress
        )
    table = tally(outcomes)
    if as_json:
        print_json(
            {
                "version": package_version(),
                "sources": source_digest(),
                "without": without,
                "failed": failed,
                **table,
                "outcomes": {o.name: {"result": o.result, "place_right": o.place_right} for o in outcomes},
            }
        )
        return
    typer.echo(score_text(table))
    for name, reason in failed.items():
        typer.echo(f"{name} failed: {reason}")


def read(path: Path) -> Mapping[str, Any]:
    """A verdict, checked, as plain values. Raises DiagnosisError."""
    import json

    from gearbench.diagnosis.verdict_file import read_verdict, verdict_json

    verdict: Mapping[str, Any] = json.loads(verdict_json(read_verdict(path)))
    return verdict


def diagnose_case(records: Sequence[Path], nominal: Path, folder: Path, without: Sequence[str]) -> str | None:
    """Diagnose one case and write its verdict; one sentence instead when it cannot be diagnosed."""
    from gearbench.diagnosis import diagnose
    from gearbench.diagnosis.verdict_file import write_verdict
    from gearbench.rig import read_case
    from gearbench.shell.failure import user_errors

    try:
        made = diagnose(records, read_case(nominal), without=without, quick=True)
    except user_errors() as error:
        return str(error)
    write_verdict(made.verdict, folder / "verdict.json")
    return None

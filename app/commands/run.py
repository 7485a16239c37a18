"""`run CASE --out FOLDER`: the main job, from a case to its summary."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from gearbench.commands.simulate import experiments
from gearbench.shell.failure import InputError
from gearbench.shell.options import CaseArgument, JsonOption, SetOption, load_case, print_json
from gearbench.shell.output import claimed, fingerprint
from gearbench.shell.progress import Progress
from gearbench.words.summary_text import headline


def run(
    case: CaseArgument,
    out: Annotated[Path | None, typer.Option("--out", help="output folder; absent: out_NAME")] = None,
    force: Annotated[
        bool, typer.Option("--force", help="replace what another case or other sources left in the folder")
    ] = False,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a case: geometry, mesh, simulation, identification, pictures, summary. Resumes in its own folder."""
    loaded = load_case(case, settings)
    from gearbench.bench.readiness import check_case
    from gearbench.pipeline import Job, run_experiment
    from gearbench.records.provenance import source_digest
    from gearbench.rig import dump_case

    # What cannot be run is refused before a folder is made.
    check_case(loaded)
    for experiment, _ in experiments(loaded, Path("record.nc")):
        if experiment.experiment.multisine is None:
            raise InputError(
                "experiment.multisine is missing: without excitation run has nothing to identify; `simulate` and"
                " `static` need none"
            )
    folder = out or Path(f"out_{re.sub(r'[^A-Za-z0-9._-]+', '_', loaded.name)}")
    summaries = []
    with (
        claimed(folder, "run", fingerprint(dump_case(loaded), source_digest()), force) as output,
        Progress(f"run {loaded.name}") as progress,
    ):
        for experiment, path in experiments(loaded, Path("record.nc")):
            suffix = path.stem.removeprefix("record")
            summaries.append(run_experiment(Job(experiment, output, progress, suffix)))
    if as_json:
        print_json(summaries if loaded.conditions else summaries[0])
        return
    for numbers in summaries:
        typer.echo("\n".join(headline(numbers)))
    typer.echo(str(folder))

"""`run CASE --out FOLDER`: the main job, from a case to its summary."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from gearbench.shell.options import CaseArgument, JsonOption, SetOption, WorkersOption, load_case, print_json
from gearbench.shell.progress import Progress
from gearbench.words.summary import headline


def run(
    case: CaseArgument,
    out: Annotated[Path | None, typer.Option("--out", help="output folder; absent: out_NAME")] = None,
    force: Annotated[
        bool, typer.Option("--force", help="replace what another case or other sources left in the folder")
    ] = False,
    workers: WorkersOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a case: geometry, mesh, simulation, identification, pictures, summary. Resumes in its own folder."""
    loaded = load_case(case, settings)
    import gearbench as gb

    folder = out or Path(f"out_{re.sub(r'[^A-Za-z0-9._-]+', '_', loaded.name)}")
    with Progress(f"run {loaded.name}") as progress:
        summaries = gb.run(loaded, folder, force=force, progress=progress, workers=workers)
    if as_json:
        print_json(summaries if loaded.conditions else summaries[0])
        return
    for numbers in summaries:
        typer.echo("\n".join(headline(numbers)))
    typer.echo(str(folder))

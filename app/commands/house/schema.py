"""`schema`: every key of a case file."""

from __future__ import annotations

import json
from typing import Annotated

import typer


def schema(
    reference: Annotated[
        bool, typer.Option("--reference", help="print a commented case file with every key instead")
    ] = False,
) -> None:
    """Print the JSON schema of a case file: keys, units, defaults, limits."""
    if reference:
        from gearbench.rig.casefile.reference import reference_text

        typer.echo(reference_text(), nl=False)
        return
    from gearbench.rig.casefile.schema import case_schema

    typer.echo(json.dumps(case_schema(), indent=2))

"""`doctor`: what the machine lacks."""

from __future__ import annotations

from dataclasses import asdict

import typer

from gearbench.shell.failure import BAD_INPUT, say
from gearbench.shell.options import JsonOption, print_json


def doctor(as_json: JsonOption = False) -> int | None:
    """Tell in sentences what this machine has and lacks. Exit code 2 where something needed is missing."""
    from gearbench.doctor import examine

    say("looking; this takes some seconds")
    findings = examine()
    if as_json:
        print_json([asdict(finding) for finding in findings])
    else:
        for finding in findings:
            typer.echo(f"{finding.state:<8} {finding.sentence}")
    lacking = [finding.name for finding in findings if finding.state == "missing"]
    if not as_json:
        typer.echo(f"\nMissing: {', '.join(lacking)}." if lacking else "\nNothing that is needed is missing.")
    return BAD_INPUT if lacking else None

"""`completion`: what makes a shell complete commands, options and the names of shipped cases."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

# Where it is set, the command line completes what a shell has typed so far, in place of running it.
COMPLETE = "_GEARBENCH_COMPLETE"


class Shell(StrEnum):
    """Shells that can be told how to complete."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"


def completion(shell: Annotated[Shell, typer.Argument(help="the shell that is to complete")]) -> None:
    """Print the script that makes a shell complete gearbench; for bash: eval "$(gearbench completion bash)"."""
    from typer.completion import get_completion_script

    typer.echo(get_completion_script(prog_name="gearbench", complete_var=COMPLETE, shell=shell.value))


def enable_completion() -> None:
    """Make the command line understand what the scripts ask."""
    from typer.completion import completion_init

    completion_init()

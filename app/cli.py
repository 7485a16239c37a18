"""The command line: which commands there are. What a command needs is imported when it runs."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Sequence
from typing import Annotated

import typer

from gearbench import __version__
from gearbench.cases_command import cases
from gearbench.challenge_command import challenge
from gearbench.check_command import check
from gearbench.compare_command import compare
from gearbench.diagnose_command import diagnose
from gearbench.failure import INTERRUPTED, guarded, show_warning
from gearbench.identify_command import identify
from gearbench.mesh_command import mesh
from gearbench.options import expand_lists
from gearbench.run_command import run
from gearbench.schema_command import schema
from gearbench.simulate_command import simulate
from gearbench.static_command import static
from gearbench.validate_command import validate

app = typer.Typer(
    name="gearbench",
    help="A virtual gear test rig: from a case file to the record and its time-varying frequency response.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

for command in (run, simulate, static, identify, compare, diagnose, check, mesh, cases, schema, validate):
    app.command()(command)
app.add_typer(challenge)

# Options that take several numbers in a row.
_LISTS = ("--torque-nm", "--dte-um", "--fields")


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(__version__)
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="print the version")
    ] = False,
) -> None:
    """A virtual gear test rig: from a case file to the record and its time-varying frequency response."""


def run_command_line(arguments: Sequence[str]) -> int:
    """Run one command; its exit code."""

    def job() -> int | None:
        try:
            result = app(expand_lists(arguments, _LISTS), prog_name="gearbench", standalone_mode=False)
        except typer.Abort:
            result = INTERRUPTED
        if result == INTERRUPTED:  # the library turns the exception into this code
            raise KeyboardInterrupt
        return result if isinstance(result, int) else None

    return guarded(job)


def main() -> None:
    """Entry point of the `gearbench` script."""
    # The matrices are many and small: on them several BLAS threads wait for one another, ten times as long as
    # one needs on a busy machine. Takes effect because NumPy is not imported yet.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    warnings.showwarning = show_warning
    sys.exit(run_command_line(sys.argv[1:]))

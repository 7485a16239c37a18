"""The command line: which commands there are. What a command needs is imported when it runs."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Sequence
from typing import Annotated

import typer

from gearbench import __version__
from gearbench.commands.experiments.campaign import campaign
from gearbench.commands.experiments.multisine import multisine
from gearbench.commands.experiments.optimise import optimise
from gearbench.commands.experiments.run import run
from gearbench.commands.experiments.simulate import simulate
from gearbench.commands.experiments.sweep import sweep
from gearbench.commands.gears.animate import animate
from gearbench.commands.gears.check import check
from gearbench.commands.gears.mesh import mesh
from gearbench.commands.gears.static import static
from gearbench.commands.house.cases import cases
from gearbench.commands.house.completion import COMPLETE, completion, prepare
from gearbench.commands.house.doctor import doctor
from gearbench.commands.house.open import open_report
from gearbench.commands.house.schema import schema
from gearbench.commands.house.validate import validate
from gearbench.commands.measured.challenge import challenge
from gearbench.commands.measured.compare import compare
from gearbench.commands.measured.convert import convert
from gearbench.commands.measured.diagnose import diagnose
from gearbench.commands.measured.identify import identify
from gearbench.shell.failure import INTERRUPTED, guarded, show_warning
from gearbench.shell.options import expand_lists

app = typer.Typer(
    name="gearbench",
    help="A virtual gear test rig: from a case file to the record and its time-varying frequency response.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

COMMANDS = (
    run,
    simulate,
    static,
    animate,
    sweep,
    campaign,
    optimise,
    multisine,
    convert,
    identify,
    compare,
    diagnose,
    check,
    mesh,
    cases,
    schema,
    validate,
    doctor,
    completion,
)
for command in COMMANDS:
    app.command()(command)
app.command("open")(open_report)
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
    if COMPLETE in os.environ:
        prepare()
    sys.exit(run_command_line(sys.argv[1:]))

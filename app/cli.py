"""The command line: which commands there are. What a command needs is imported when it runs."""

from __future__ import annotations

import atexit
import os
import sys
import warnings
from collections.abc import Iterable, Sequence
from contextlib import suppress
from importlib import import_module
from typing import Annotated

import typer

from gearbench import __version__
from gearbench.commands.house.completion import COMPLETE, enable_completion
from gearbench.shell.failure import INTERRUPTED, guarded, show_warning
from gearbench.shell.options import expand_lists

# Every command in the order of --help: where it is, and the function's name where that is another than the command's.
_COMMANDS = {
    "run": "experiments.run",
    "simulate": "experiments.simulate",
    "static": "gears.static",
    "animate": "gears.animate",
    "sweep": "experiments.sweep",
    "campaign": "experiments.campaign",
    "optimise": "experiments.optimise",
    "multisine": "experiments.multisine",
    "convert": "measured.convert",
    "identify": "measured.identify",
    "compare": "measured.compare",
    "diagnose": "measured.diagnose",
    "check": "gears.check",
    "mesh": "gears.mesh",
    "cases": "house.cases",
    "schema": "house.schema",
    "validate": "house.validate",
    "doctor": "house.doctor",
    "completion": "house.completion",
    "open": "house.open:open_report",
    "challenge": "measured.challenge",
}

# Options that take several numbers in a row.
_LISTS = ("--torque-nm", "--dte-um", "--fields")


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(__version__)
        raise typer.Exit


def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="print the version")
    ] = False,
) -> None:
    """A virtual gear test rig: from a case file to the record and its time-varying frequency response."""


def application(names: Iterable[str] = _COMMANDS) -> typer.Typer:
    """The command line with these commands; to read the options of all of them takes a tenth of a second."""
    made = typer.Typer(
        name="gearbench",
        help="A virtual gear test rig: from a case file to the record and its time-varying frequency response.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    made.callback()(_common)
    for name in names:
        place, _, function = _COMMANDS[name].partition(":")
        command = getattr(import_module(f"gearbench.commands.{place}"), function or name)
        if isinstance(command, typer.Typer):
            made.add_typer(command)
        else:
            made.command(name)(command)
    return made


def _wanted(arguments: Sequence[str]) -> Iterable[str]:
    """The command that is asked for; all of them for help, for a shell that completes, and to suggest another name."""
    known = arguments and arguments[0] in _COMMANDS and COMPLETE not in os.environ
    return (arguments[0],) if known else _COMMANDS


def run_command_line(arguments: Sequence[str]) -> int:
    """Run one command; its exit code."""

    def job() -> int | None:
        try:
            words = expand_lists(arguments, _LISTS)
            result = application(_wanted(words))(words, prog_name="gearbench", standalone_mode=False)
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
    # Pydantic looks through every installed package for plugins of its own, of which cases make no use.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    warnings.showwarning = show_warning
    if COMPLETE in os.environ:
        enable_completion()
    code = run_command_line(sys.argv[1:])
    if code == INTERRUPTED:
        _leave(code)
    sys.exit(code)


def _leave(code: int) -> None:
    """Exit with this code. Python, started with -m, would kill itself by SIGINT where Ctrl-C came while a text was
    executed, as numba and dataclasses do."""
    atexit._run_exitfuncs()
    with suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)

"""Arguments and options that several commands share."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.bench.models import MODELS

if TYPE_CHECKING:
    from gearbench.rig import Case

PICTURES = (".png", ".svg", ".pdf")



def _shipped(incomplete: str) -> list[str]:
    """Names of shipped cases that begin so; where there are none the shell completes files."""
    from gearbench.cases import case_files

    return [name for name in case_files() if name.startswith(incomplete)]


CaseArgument = Annotated[
    str,
    typer.Argument(
        metavar="CASE", help="case file, or the name of a shipped case (see `cases`)", autocompletion=_shipped
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="replace a key of the case: rig.driver.teeth=30"),
]


def _known_model(name: str) -> str:
    """The name of a model. Raises BadParameter for an unknown one."""
    if name not in MODELS:
        raise typer.BadParameter(f"{name!r} is not one of {', '.join(MODELS)}")
    return name


ModelOption = Annotated[
    str | None,
    typer.Option(
        "--model", parser=_known_model, metavar=f"[{'|'.join(MODELS)}]", help="absent: the case's simulation.model"
    ),
]
WorkersOption = Annotated[
    int | None,
    typer.Option("--workers", min=1, metavar="N", help="what runs side by side; absent: as many as processors"),
]
JsonOption = Annotated[bool, typer.Option("--json", help="print the summary as JSON")]
ReportOption = Annotated[
    bool, typer.Option("--report/--no-report", help="write the page NAME.html beside --out NAME.nc")
]


def check_out(out: Path, inputs: Sequence[Path | str] = ()) -> None:
    """Refuse an output file that would replace an input or a file of another kind, before any work is done."""
    from gearbench.shell.failure import InputError

    if not out.parent.is_dir():
        raise InputError(f"--out {out} cannot be written: the folder {out.parent} must exist")
    if out.suffix != ".nc":
        raise InputError(f"--out {out} must end in .nc: the result is a NetCDF-4 file")
    if any(out.resolve() == Path(path).resolve() for path in inputs):
        raise InputError(f"--out {out} is one of the inputs, which it would replace: choose another name")


def check_export(path: Path, inputs: Sequence[Path | str] = (), option: str = "--export") -> None:
    """Refuse an export that cannot be written, or that would replace an input, before any work is done."""
    from gearbench.identification.response.export import SUFFIXES
    from gearbench.shell.failure import InputError

    if not path.parent.is_dir():
        raise InputError(f"{option} {path} cannot be written: the folder {path.parent} must exist")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{option} {path} must end in {' or '.join(SUFFIXES)}")
    if any(path.resolve() == Path(one).resolve() for one in inputs):
        raise InputError(f"{option} {path} is one of the other files, which it would replace: choose another name")


def check_folder(path: Path, option: str = "--pictures") -> None:
    """Refuse a folder for pictures that is a file, or whose parent does not exist, before any work is done."""
    from gearbench.shell.failure import InputError

    if path.exists() and not path.is_dir():
        raise InputError(f"{option} {path} is a file, but must be a folder")
    if not path.resolve().parent.is_dir():
        raise InputError(f"{option} {path} cannot be made: the folder {path.parent} must exist")


def check_picture(path: Path, inputs: Sequence[Path | str] = (), option: str = "--figure") -> None:
    """Refuse a picture that cannot be written, or that would replace an input, before any work is done."""
    from gearbench.shell.failure import InputError

    if not path.parent.is_dir():
        raise InputError(f"{option} {path} cannot be written: the folder {path.parent} must exist")
    if path.suffix not in PICTURES:
        raise InputError(f"{option} {path} must end in {' or '.join(PICTURES)}")
    if any(path.resolve() == Path(one).resolve() for one in inputs):
        raise InputError(f"{option} {path} is one of the other files, which it would replace: choose another name")


def check_pictures(pictures: Mapping[str, Path | None], inputs: Sequence[Path | str]) -> list[Path | str]:
    """`check_picture` of each option that is given; `inputs` with these pictures, none of which may replace another."""
    others = list(inputs)
    for option, picture in pictures.items():
        if picture is not None:
            check_picture(picture, others, option)
            others.append(picture)
    return others


def load_case(name: str, settings: Sequence[str] | None) -> Case:
    """The case in a file or, where there is no such file, the shipped case of that name; values that smell of another
    unit are questioned on stderr, and what the file leaves out is said there."""
    import gearbench as gb
    from gearbench.rig.casefile.smells import smells
    from gearbench.shell.failure import say

    case = gb.read_case(name, settings or ())
    for line in case.assumed:
        say(f"assumed: {line}")
    for question in smells(case):
        say(f"warning: {question}")
    return case


def print_json(summary: Any) -> None:
    """A summary to stdout as JSON."""
    typer.echo(json_text(summary))


def json_text(summary: Any) -> str:
    """JSON; numbers that are not finite become null."""
    return json.dumps(_finite(summary), indent=2, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value


def expand_lists(arguments: Sequence[str], options: Sequence[str]) -> list[str]:
    """Spell `--option 1 2 3` as `--option 1 --option 2 --option 3` for the given options.

    Raises InputError for `--option 1,2,3`, which says how several are given.
    """
    from gearbench.shell.failure import InputError

    expanded: list[str] = []
    current = ""
    for argument in arguments:
        option, equals, text = argument.partition("=")
        listed = text if equals and option in options else argument if current else ""
        parts = [part.strip() for part in listed.split(",")]
        if len(parts) > 1 and all(_is_number(part) for part in parts):
            option = option if equals else current
            raise InputError(f"{option} {listed} must be numbers with spaces between them: {option} {' '.join(parts)}")
        if argument.startswith("--"):
            current = argument if argument in options else ""
            expanded.append(argument)
        elif current and _is_number(argument) and expanded[-1] != current:
            expanded += [current, argument]
        else:
            expanded.append(argument)
            current = current if _is_number(argument) else ""
    return expanded


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True

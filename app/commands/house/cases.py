"""`cases`: the shipped cases."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from gearbench.files import write_whole
from gearbench.shell.failure import InputError
from gearbench.shell.options import JsonOption, print_json


def cases(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="print this case")] = None,
    copy: Annotated[
        Path | None,
        typer.Option("--copy", metavar="FOLDER", help="copy the case and the gear files into a folder"),
    ] = None,
    pictures: Annotated[
        Path | None,
        typer.Option("--pictures", metavar="FOLDER", help="draw the gear pair of each case (or of NAME) into a folder"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List the shipped cases; print one; copy one, ready to change and to run; or draw their gears."""
    from gearbench.cases import case_files

    shipped = case_files()
    if pictures is not None and copy is None and (name is None or name in shipped):
        for path in draw_pairs([name] if name else list(shipped), pictures):
            typer.echo(str(path))
        return
    if name is None:
        if copy is not None:
            raise InputError("--copy needs the name of a case: gearbench cases NAME --copy FOLDER")
        _list(shipped, as_json)
        return
    if name not in shipped:
        raise InputError(f"no case is called {name}: there are {', '.join(shipped)}")
    if copy is None:
        typer.echo(shipped[name].read_text(encoding="utf-8"), nl=False)
        return
    typer.echo(str(copy_case(shipped[name], copy)))


def draw_pairs(names: Sequence[str], folder: Path) -> Iterator[Path]:
    """Draw the gear pair of each shipped case at mesh phase 0; the pictures, one after the other."""
    from gearbench.cases import read_case
    from gearbench.figures.gears.gear import draw_pair
    from gearbench.geometry import pair

    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        rig = read_case(name).rig
        path = folder / f"{name}.png"
        draw_pair(path, rig, pair(rig), None)
        yield path


def copy_case(source: Path, folder: Path) -> Path:
    """Copy a shipped case and the gears beside it. Raises InputError rather than replace a file."""
    target = folder / source.name
    pairs = [(source, target)]
    pairs += [(gear, folder / "gears" / gear.name) for gear in (source.parent / "gears").glob("*.toml")]
    for origin, place in pairs:
        if place.exists() and place.read_bytes() != origin.read_bytes():
            raise InputError(f"{place} exists and differs: it is not replaced")
    (folder / "gears").mkdir(parents=True, exist_ok=True)
    for origin, place in pairs:
        write_whole(place, partial(shutil.copyfile, origin))
    return target


def _list(shipped: dict[str, Path], as_json: bool) -> None:
    abouts = {name: _about(path) for name, path in shipped.items()}
    if as_json:
        print_json({name: {"path": str(path), "about": abouts[name]} for name, path in shipped.items()})
        return
    for name, about in abouts.items():
        typer.echo(f"{name:<14} {about}")


def _about(path: Path) -> str:
    """The first sentence of the comment on top of a case file."""
    comment: list[str] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("# "):
            break
        comment.append(line.removeprefix("# ").strip())
    text = " ".join(comment)
    sentence, stop, _ = text.partition(". ")
    return sentence + ("." if stop else "")

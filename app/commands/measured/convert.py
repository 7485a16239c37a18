"""`convert IN... OUT`: measured files become a record."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from gearbench.shell.failure import InputError
from gearbench.shell.options import JsonOption, SetOption, check_export, check_out, load_case, print_json
from gearbench.shell.progress import Progress
from gearbench.words.convert import guess_lines, record_summary, source_lines, summary_lines

if TYPE_CHECKING:
    from gearbench.records import ChannelMap, Guess, Source


def convert(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="IN... OUT",
            help="measured files (MAT, UFF58, CSV/TSV, TDMS, HDF5, NetCDF-4, WAV), then the record to write (.nc)",
        ),
    ],
    channel_map: Annotated[
        Path | None,
        typer.Option("--map", metavar="FILE", help="channel map (TOML); absent: guessed from names and units"),
    ] = None,
    rig: Annotated[
        str | None,
        typer.Option("--rig", metavar="CASE", help="case that tells teeth, radii, inertias, sampling and mesh period"),
    ] = None,
    condition: Annotated[
        str | None, typer.Option("--condition", metavar="NAME", help="condition of the case that was measured")
    ] = None,
    runs: Annotated[
        Literal["realisations", "records"],
        typer.Option("--runs", help="several runs in the files: realisations of one record, or records OUT-1.nc, ..."),
    ] = "realisations",
    show: Annotated[bool, typer.Option("--show", help="list what is in the files and convert nothing")] = False,
    write_map: Annotated[
        Path | None, typer.Option("--write-map", metavar="FILE", help="write the map (guessed or given) here")
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="use the guessed map though something in it is assumed")] = False,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Convert measured files into a record that identify, compare and diagnose take.

    A guessed map is used at once where names and units leave no doubt, else only with --yes. A frequency response
    (frf.nc) and an OUT that ends in .uff or .mat: the response is written for other programs.
    """
    if show:
        _show(files, as_json)
        return
    inputs, out = (files, None) if len(files) == 1 else (files[:-1], files[-1])
    if out is not None and len(inputs) == 1 and inputs[0].suffix == ".nc" and out.suffix != ".nc":
        _export(inputs[0], out, as_json)
        return
    if out is None and write_map is None:
        raise InputError(f"OUT is missing: gearbench convert {inputs[0]} record.nc (or --show, to see what is in it)")
    if out is not None:
        check_out(out, inputs)
    if rig is None and (settings or condition):
        raise InputError("--set and --condition belong to a case: give --rig CASE too")
    with Progress("convert") as progress:
        progress.step("reading")
        from gearbench.records.conversion.convert import read_sources

        source = read_sources(inputs)
        known = _known(rig, settings, condition)
    found = _map(source, channel_map, known, write_map, yes or out is None)
    if out is not None:
        _convert(inputs, out, source, found, known, runs, as_json)


def _export(frf: Path, out: Path, as_json: bool) -> None:
    """A frequency response for other programs."""
    from gearbench.identification import export_frf, read_frf

    check_export(out, [frf], "OUT")
    with Progress("convert") as progress:
        progress.step("writing")
        found = read_frf(frf)
        export_frf(found, out)
    sizes = {str(name): int(size) for name, size in found.sizes.items()}
    if as_json:
        print_json({"file": str(out), **sizes})
    else:
        typer.echo(f"{out}: {', '.join(f'{size} {name}' for name, size in sizes.items())}")


def _show(files: list[Path], as_json: bool) -> None:
    from gearbench.records import guess_map, read_source

    sources = [read_source(path) for path in files]
    if as_json:
        keys = ("name", "unit", "runs", "samples", "rate")
        print_json(
            [{"file": str(s.path)} | {key: getattr(one, key) for key in keys} for s in sources for one in s.columns]
        )
        return
    for source in sources:
        for line in source_lines(source, guess_map(source)):
            typer.echo(line)


def _known(rig: str | None, settings: list[str] | None, condition: str | None) -> dict[str, float | str]:
    if rig is None:
        return {}
    from gearbench.bench.conversion import case_attributes

    return case_attributes(load_case(rig, settings), condition)


def _map(
    source: Source, path: Path | None, known: dict[str, float | str], write_map: Path | None, confirmed: bool
) -> ChannelMap:
    """The given map, or the guessed one once it is shown and, where anything is assumed, confirmed."""
    from gearbench.files import write_text
    from gearbench.records import guess_map, map_text, read_map

    if path is not None:
        given = read_map(path)
        if write_map is not None:
            _check_map(write_map, source.path)
            write_text(write_map, map_text(given))
        return given
    guess = guess_map(source, known)
    for line in guess_lines(guess):
        typer.echo(line, err=True)
    if write_map is not None:
        _check_map(write_map, source.path)
        write_text(write_map, map_text(guess.channel_map, guess.missing))
        typer.echo(f"{write_map}: the map as guessed", err=True)
    if not confirmed or (guess.missing and write_map is None):
        _refuse_doubts(source, guess, confirmed)
    return guess.channel_map


def _refuse_doubts(source: Source, guess: Guess, confirmed: bool) -> None:
    if guess.missing:
        raise InputError(
            f"{source.path}: the guessed map lacks {', '.join(guess.missing)}; write it with --write-map map.toml,"
            " complete it and give it with --map, or give --rig CASE for what a case knows"
        )
    if guess.doubts and not confirmed:
        raise InputError(
            f"{source.path}: the map above is guessed and {len(guess.doubts)} thing(s) in it are assumed: confirm it"
            " with --yes, or write it with --write-map map.toml, correct it and give it with --map"
        )


def _check_map(path: Path, source: Path) -> None:
    if path.suffix != ".toml":
        raise InputError(f"--write-map {path} must end in .toml")
    if path.resolve() == source.resolve():
        raise InputError(f"--write-map {path} is the input, which it would replace: choose another name")


def _convert(
    inputs: list[Path],
    out: Path,
    source: Source,
    channel_map: ChannelMap,
    known: dict[str, float | str],
    runs: str,
    as_json: bool,
) -> None:
    from gearbench.records import write_record
    from gearbench.records.conversion.convert import convert_sources

    with Progress("convert") as progress:
        progress.step("channels")
        record = convert_sources(inputs, channel_map, known, source=source, progress=progress)
        progress.step("writing")
        made = {out: record}
        if runs == "records" and record.sizes["realisation"] > 1:
            made = {
                out.with_name(f"{out.stem}-{number + 1}{out.suffix}"): record.isel(realisation=[number])
                for number in range(record.sizes["realisation"])
            }
        for path, one in made.items():
            write_record(one, path)
    summary: dict[str, Any] = record_summary(record, list(made))
    if as_json:
        print_json(summary)
        return
    for line in summary_lines(summary):
        typer.echo(line)

"""`identify RECORD... --out FILE`: the time-varying frequency response behind records."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from gearbench.shell.failure import InputError
from gearbench.shell.options import JsonOption, check_export, check_folder, check_out, print_json
from gearbench.shell.progress import Progress
from gearbench.words.distortion import distortion_lines, distortion_numbers

if TYPE_CHECKING:
    import xarray as xr


def identify(
    records: Annotated[list[Path], typer.Argument(metavar="RECORD...", help="records: realisations of one condition")],
    out: Annotated[Path, typer.Option("--out", help="frequency response to write (NetCDF-4)")],
    method: Annotated[Literal["lpm", "mesh-feedback"], typer.Option("--method", help="estimator")] = "lpm",
    band_hz: Annotated[
        tuple[float, float] | None, typer.Option("--band-hz", help="identified band; absent: the excited one")
    ] = None,
    harmonics: Annotated[
        int | None, typer.Option("--harmonics", help="branches L on each side; absent: chosen by predicted error")
    ] = None,
    order: Annotated[
        int | None, typer.Option("--order", help="polynomial order R; absent: chosen by predicted error")
    ] = None,
    window: Annotated[
        int | None, typer.Option("--window", help="half-width n of the local window in lines; absent: chosen")
    ] = None,
    branches: Annotated[
        Literal["auto", "polynomials", "smooth"],
        typer.Option("--branches", help="of lpm: polynomials in windows, smooth random functions, or the better"),
    ] = "auto",
    at_mesh_hz: Annotated[
        float | None,
        typer.Option("--at-mesh-hz", help="of mesh-feedback: predict the response at this mesh frequency"),
    ] = None,
    accept_doubts: Annotated[
        bool,
        typer.Option("--accept-doubts", help="go on with a doubtful channel, or to a result that says nothing"),
    ] = False,
    export: Annotated[
        list[Path] | None, typer.Option("--export", metavar="FILE", help="write it as .uff or .mat too; repeatable")
    ] = None,
    pictures: Annotated[
        Path | None, typer.Option("--pictures", metavar="DIR", help="draw response, uncertainty and quality here")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Identify the time-varying frequency response from force to DTE out of records."""
    import gearbench as gb
    from gearbench.figures.responses.of_identified import draw_identified

    _check_files(records, out, export or [], pictures)
    settings = gb.IdentificationSettings(
        method=method, harmonics=harmonics, order=order, window=window, band=band_hz, branches=branches,
        mesh_frequency=at_mesh_hz, accept_doubts=accept_doubts,
    )  # fmt: skip
    with Progress("identify") as progress:
        progress.step("reading")
        loaded = [gb.read_record(path) for path in records]
        progress.step("mesh feedback" if method == "mesh-feedback" else "local method")
        found = gb.identify(loaded, settings, progress=progress)
        gb.write_frf(found, out)
        split = gb.identification.distortion(loaded) if gb.identification.is_coset(loaded) else None
        for path in export or []:
            gb.identification.export_frf(found, path)
        if pictures is not None:
            progress.step("pictures")
            draw_identified(pictures, found, loaded, split)
    summary = frf_summary(found, out)
    if split is not None:
        summary["distortion"] = distortion_numbers(split)
    if as_json:
        print_json(summary)
        return
    _tell(summary, out)


def _tell(summary: Mapping[str, Any], out: Path) -> None:
    """Print what was identified, and where it lies."""
    low, high = summary["first_mode_hz"]
    mode = f"first mode {low:.4g}-{high:.4g} Hz" if isfinite(low) else "no mode in the identified band"
    typer.echo(
        f"{out}: {mode}; {summary['unknowns']} unknowns, {summary['equations']} equations"
        f"{' a window' if 'window' in summary else ''}; expected error of the ITF"
        f" {100 * summary['expected_error']:.2g}%"
    )
    if summary.get("mesh_basis") == "zones":
        first, second = summary["switch_phases"]
        typer.echo(
            f"mesh in zones of phase: switches at {first:.4g} and {second:.4g} of the mesh cycle,"
            f" {summary['switch_width']:.2g} wide"
        )
    for line in distortion_lines(summary["distortion"]) if "distortion" in summary else []:
        typer.echo(line)
    for warning in summary["warnings"]:
        typer.echo(f"warning: {warning}")


def _check_files(records: list[Path], out: Path, export: list[Path], pictures: Path | None) -> None:
    """Refuse files that cannot be read or written as they are asked for, before any work is done."""
    check_out(out, records)
    seen = {path.resolve() for path in records}
    if len(seen) < len(records):
        raise InputError(f"RECORD is given {len(records)} times but names {len(seen)} file(s): each one counts once")
    for path in export:
        check_export(path, [*records, out])
    if pictures is not None:
        check_folder(pictures)


def frf_summary(found: xr.Dataset, path: Path) -> dict[str, Any]:
    """What a frequency response says about itself."""
    from gearbench.bench.results.measures import mode_range

    keys = (
        *("branches", "harmonics", "order", "window", "unknowns", "equations", "condition_number", "expected_error"),
        *("mesh_basis", "switch_phases", "switch_angles_driver", "switch_width", "evidence_gain"),
    )
    numbers = {key: found.attrs[key] for key in keys if key in found.attrs}
    warnings = [line for line in str(found.attrs.get("warnings", "")).splitlines() if line]
    return {"file": str(path), "first_mode_hz": mode_range(found), **numbers, "warnings": warnings}

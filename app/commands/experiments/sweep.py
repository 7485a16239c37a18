"""`sweep CASE --out FILE`: speed up and down at constant torque."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.shell.checkpoints import checkpoints_of
from gearbench.shell.options import (
    CaseArgument,
    JsonOption,
    ModelOption,
    ReportOption,
    SetOption,
    WorkersOption,
    check_out,
    check_pictures,
    load_case,
    print_json,
)
from gearbench.shell.progress import Progress

if TYPE_CHECKING:
    from gearbench.rig import Case


def sweep(
    case: CaseArgument,
    out: Annotated[Path, typer.Option("--out", help="file to write (NetCDF-4)")],
    low: Annotated[float, typer.Option("--from-rpm", help="lowest speed of the driver")] = 500.0,
    high: Annotated[float, typer.Option("--to-rpm", help="highest speed of the driver")] = 6000.0,
    points: Annotated[int, typer.Option("--points", min=2, max=2000, help="number of speeds")] = 111,
    figure: Annotated[Path | None, typer.Option("--figure", help="picture over speed (.png, .svg, .pdf)")] = None,
    waterfall: Annotated[Path | None, typer.Option("--waterfall", help="picture of the orders over speed")] = None,
    report: ReportOption = True,
    workers: WorkersOption = None,
    model: ModelOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a rig up and down in speed under its mean torque: DTE, dynamic factor and contact loss at every speed.

    Each speed begins where the one before ended, so that jumps show as differences between up and down, which run side
    by side. Beside the dynamic factor stands K_v of ISO 6336-1, Method B. A sweep that was interrupted or killed goes
    on at the speed where it was when the same command is given again.
    """
    loaded = load_case(case, settings)
    check_out(out, [case])
    others = check_pictures({"--figure": figure, "--waterfall": waterfall}, [case, out])
    from gearbench.report.where import report_beside
    from gearbench.shell.failure import InputError

    page = report_beside(out, others) if report else None

    if not 0 < low < high:
        raise InputError(f"--from-rpm {low:g} must be greater than 0 and less than --to-rpm {high:g}")
    import numpy as np

    from gearbench.bench.sweep import sweep as swept
    from gearbench.records import write_dataset

    with checkpoints_of(out) as kept, Progress(f"sweep {loaded.name}") as progress:
        progress.step("speeds")
        speeds = [float(one) for one in np.linspace(low, high, points) * pi / 30]
        result = swept(loaded, speeds, model, progress, checkpoints=kept, workers=workers)
        write_dataset(result, out)
        _draw(result, figure, waterfall)
        summary = sweep_summary(result, out)
        if page is not None:
            progress.step(page.name)
            _write_page(page, loaded, result, summary)
    if as_json:
        print_json(summary)
    else:
        _tell(summary, points, page)


def _draw(result: Any, figure: Path | None, waterfall: Path | None) -> None:
    """The pictures that are asked for."""
    if figure is not None:
        from gearbench.figures.records.sweep import plot_sweep

        plot_sweep(result, figure)
    if waterfall is not None:
        from gearbench.figures.records.sweep import plot_waterfall

        plot_waterfall(result, waterfall)


def _write_page(page: Path, case: Case, result: Any, summary: dict[str, Any]) -> None:
    """The report beside the result."""
    from gearbench.files import write_text
    from gearbench.report.parts import file_row
    from gearbench.report.sweep import sweep_page

    files = file_row(Path(summary["file"]), "DTE, dynamic factor, contact loss and orders over speed")
    write_text(page, sweep_page(case, result, summary, files))


def _tell(summary: dict[str, Any], points: int, page: Path | None) -> None:
    """Print the summary for people."""
    typer.echo(
        f"{summary['file']}: {points} speeds up and down; largest DTE {summary['dte_rms_um']:.4g} um rms at"
        f" {summary['dte_rms_rpm']:.0f} rpm, largest dynamic factor {summary['dynamic_factor']:.3g} (ISO 6336-1 Method"
        f" B: {summary['iso_dynamic_factor']:.3g}, resonance at {summary['iso_resonance_rpm']:.0f} rpm)"
    )
    for sentence in summary["warnings"]:
        typer.echo(f"warning: {sentence}")
    if page is not None:
        typer.echo(str(page))


def sweep_summary(result: Any, out: Path) -> dict[str, Any]:
    """Where the answer is largest, how far up and down differ, and how many speeds did not settle."""
    rms = result["dte_rms"].values
    rpm = result["speed"].values * 30 / pi
    at = int(rms.max(axis=0).argmax())
    apart = abs(rms[0] - rms[1]) > 0.1 * rms.max(axis=0)
    restless = int((result["settled"].values == 0).sum())
    warnings = [result.attrs["warnings"]] if result.attrs.get("warnings") else []
    if restless:
        warnings.append(f"{restless} of {rms.size} speeds have no steady answer that repeats within 16 mesh periods")
    return {
        "file": str(out),
        "dte_rms_um": 1e6 * float(rms.max()),
        "dte_rms_rpm": float(rpm[at]),
        "dynamic_factor": float(result["dynamic_factor"].max()),
        "iso_dynamic_factor": float(result["iso_dynamic_factor"].max()),
        "iso_resonance_rpm": float(result.attrs["iso_resonance_speed"]) * 30 / pi,
        "contact_loss": float(result["contact_loss"].max()),
        "two_answers_rpm": [float(one) for one in rpm[apart]],
        "warnings": warnings,
    }

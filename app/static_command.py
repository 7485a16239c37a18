"""`static CASE --out FILE`: transmission error, stiffness and load sharing over the mesh cycle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from gearbench.options import CaseArgument, JsonOption, SetOption, check_out, check_picture, load_case, print_json
from gearbench.progress import Progress


def static(
    case: CaseArgument,
    out: Annotated[Path, typer.Option("--out", help="result to write (NetCDF-4)")],
    torque_nm: Annotated[
        list[float] | None, typer.Option("--torque-nm", help="driver torques [N m]; absent: the case's mean")
    ] = None,
    dte_um: Annotated[
        list[float] | None, typer.Option("--dte-um", help="transmission errors in um, instead of torques")
    ] = None,
    positions: Annotated[int, typer.Option("--positions", help="mesh phases over one cycle")] = 64,
    cycles: Annotated[int, typer.Option("--cycles", help="mesh cycles, where teeth differ from one another")] = 1,
    figure: Annotated[
        Path | None, typer.Option("--figure", help="picture of the result as well (.png, .svg, .pdf)")
    ] = None,
    stiffness_figure: Annotated[
        Path | None, typer.Option("--stiffness-figure", help="picture of the mesh stiffness by every method as well")
    ] = None,
    model: Annotated[
        Literal["lumped", "reduced"] | None,
        typer.Option("--model", help="absent: the case's simulation.model"),
    ] = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Static response of the pair over one mesh cycle, hub centres held."""
    loaded = load_case(case, settings)
    check_out(out, [case])
    if figure is not None:
        check_picture(figure, [case, out])
    if stiffness_figure is not None:
        check_picture(stiffness_figure, [case, out, *([figure] if figure else [])], "--stiffness-figure")
    from gearbench.bench.static import static as solve
    from gearbench.records.storage import write_atomically

    with Progress(f"static {loaded.name}") as progress:
        progress.step("mesh cycle")
        result = solve(
            loaded,
            model,
            torque=torque_nm or (),
            dte=[1e-6 * value for value in dte_um or ()],
            positions=positions,
            cycles=cycles,
            progress=progress,
        )
        write_atomically(out, lambda path: result.to_netcdf(path, engine="h5netcdf"))
        if figure is not None:
            progress.step("figure")
            from gearbench.figures_static import plot_static

            plot_static(result, figure)
    from gearbench.static_methods import draw_largest, methods_data, methods_lines, stiffness_tables

    tables = stiffness_tables(loaded, result)
    if stiffness_figure is not None:
        draw_largest(tables, stiffness_figure)
    summary = static_summary(result, out) | methods_data(loaded, tables)
    if as_json:
        print_json(summary)
        return
    for line in [*_lines(summary), *methods_lines(loaded, tables), str(out)]:
        typer.echo(line)


def _lines(summary: dict[str, Any]) -> list[str]:
    """A line for each load."""
    return [
        f"{row['load']:g} {summary['unit']}: TE {row['te_mean_um']:.4g} um mean,"
        f" {row['te_peak_to_peak_um']:.4g} um peak to peak; tangent stiffness"
        f" {row['stiffness_least_n_per_um']:.4g} .. {row['stiffness_most_n_per_um']:.4g} N/um"
        for row in summary["loads"]
    ]


def static_summary(result: Any, path: Path) -> dict[str, Any]:
    """A row for each load: mean and peak-to-peak TE, range of the tangent stiffness."""
    unit = result["load"].attrs["units"]
    scale = 1e6 if unit == "m" else 1.0
    rows = []
    for number, load in enumerate(result["load"].values):
        te = result["transmission_error"].values[number] * 1e6
        stiffness = result["stiffness_tangent"].values[number] / 1e6
        rows.append(
            {
                "load": float(load) * scale,
                "te_mean_um": float(te.mean()),
                "te_peak_to_peak_um": float(te.max() - te.min()),
                "torque_mean_nm": float(result["torque"].values[number].mean()),
                "stiffness_least_n_per_um": float(stiffness.min()),
                "stiffness_most_n_per_um": float(stiffness.max()),
            }
        )
    return {
        "file": str(path),
        "model": result.attrs["model"],
        "unit": "um" if unit == "m" else unit,
        "loads": rows,
    }

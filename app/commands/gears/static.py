"""`static CASE --out FILE`: transmission error, stiffness and load sharing over the mesh cycle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.commands.gears.stress_output import field_files, field_phases, write_all
from gearbench.shell.options import (
    CaseArgument,
    JsonOption,
    ModelOption,
    ReportOption,
    SetOption,
    check_out,
    check_pictures,
    load_case,
    print_json,
)
from gearbench.shell.progress import Progress
from gearbench.words.root_stress import root_lines, root_tables

if TYPE_CHECKING:
    from gearbench.rig import Case

TorqueOption = Annotated[
    list[float] | None, typer.Option("--torque-nm", help="driver torques [N m]; absent: the case's mean")
]
DteOption = Annotated[
    list[float] | None, typer.Option("--dte-um", help="transmission errors in um, instead of torques")
]
FigureOption = Annotated[
    Path | None, typer.Option("--figure", help="picture of the result as well (.png, .svg, .pdf)")
]
StiffnessFigureOption = Annotated[
    Path | None, typer.Option("--stiffness-figure", help="picture of the mesh stiffness by every method as well")
]
RootFigureOption = Annotated[
    Path | None, typer.Option("--root-figure", help="picture of the root stress over the mesh cycle as well")
]
FieldsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--fields",
        metavar="PHASE",
        help="mesh phases at which stress and displacement under the largest load are written beside --out as .vtu"
        " and .png",
    ),
]


def static(
    case: CaseArgument,
    out: Annotated[Path, typer.Option("--out", help="result to write (NetCDF-4)")],
    torque_nm: TorqueOption = None,
    dte_um: DteOption = None,
    positions: Annotated[int, typer.Option("--positions", help="mesh phases over one cycle")] = 64,
    cycles: Annotated[int, typer.Option("--cycles", help="mesh cycles, where teeth differ from one another")] = 1,
    figure: FigureOption = None,
    stiffness_figure: StiffnessFigureOption = None,
    fields: FieldsOption = None,
    root_figure: RootFigureOption = None,
    report: ReportOption = True,
    model: ModelOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Static response of the pair over one mesh cycle, hub centres held."""
    loaded = load_case(case, settings)
    check_out(out, [case])
    pictures = {"--figure": figure, "--stiffness-figure": stiffness_figure, "--root-figure": root_figure}
    others = check_pictures(pictures, [case, out])
    from gearbench.bench.models import model_for
    from gearbench.report.where import report_beside

    page = report_beside(out, others) if report else None

    elastic = model_for(loaded, model)[1].elastic
    files = _check_stress(loaded, elastic, out, fields or [], root_figure, others)
    from gearbench.records import write_dataset

    with Progress(f"static {loaded.name}") as progress:
        dte = [1e-6 * value for value in dte_um or ()]
        wanted = {"torque": torque_nm or (), "dte": dte, "positions": positions, "cycles": cycles}
        result = _solved(loaded, model, elastic, progress, **wanted)
        write_dataset(result, out)
        if figure is not None:
            progress.step("figure")
            from gearbench.figures.gears.static import plot_static

            plot_static(result, figure)
        written = _stress_files(loaded, result, files, root_figure, progress)
    from gearbench.commands.gears.static_methods import draw_largest, methods_data, stiffness_tables

    tables = stiffness_tables(loaded, result)
    if stiffness_figure is not None:
        draw_largest(tables, stiffness_figure)
    roots = root_tables(loaded, result)
    summary = static_summary(result, out) | methods_data(loaded, tables)
    summary |= {"root_stress": roots, "field_files": [str(path) for path in written]}
    if page is not None:
        _write_page(page, loaded, result, summary, tables, roots)
        written.append(page)
    if as_json:
        print_json(summary)
        return
    for line in [*_told(loaded, summary, tables, roots), str(out), *map(str, written)]:
        typer.echo(line)


def _told(case: Case, summary: dict[str, Any], tables: list[Any], roots: list[dict[str, Any]]) -> list[str]:
    """What the command says of its result."""
    from gearbench.commands.gears.static_methods import methods_lines
    from gearbench.words.te_source import te_source

    told = [*_lines(summary), *methods_lines(case, tables)]
    if roots:
        told += root_lines(max(roots, key=lambda one: float(one["torque_nm"])))
    told += [f"warning: {warning}" for warning in summary["warnings"]]
    return [*told, f"note: {te_source(str(summary['model']), case.simulation.mesh_stiffness)}"]


def _write_page(
    page: Path, case: Case, result: Any, summary: dict[str, Any], tables: list[Any], roots: list[dict[str, Any]]
) -> None:
    """The report beside the result."""
    from gearbench.files import write_text
    from gearbench.report.parts import file_row
    from gearbench.report.static import static_page

    files = file_row(Path(summary["file"]), "transmission error, stiffness, load sharing, root stress over phase")
    for path in summary["field_files"]:
        files |= file_row(Path(path), "stress and displacement at a mesh phase")
    write_text(page, static_page(case, result, summary, tables, roots, files))


def _check_stress(
    case: Case, elastic: bool, out: Path, fields: list[str], root_figure: Path | None, others: list[Path | str]
) -> list[tuple[float, Path, Path]]:
    """The files of `--fields`; refuses what has no stress, before any work is done."""
    from gearbench.shell.failure import InputError

    for option, wanted in (("--fields", bool(fields)), ("--root-figure", root_figure is not None)):
        if wanted and not elastic:
            raise InputError(f"{option} needs finite elements, not the lumped model: --model reduced")
    if root_figure is not None:
        from gearbench.bench.stress.root import why_not

        if reason := why_not(case.rig):
            raise InputError(f"--root-figure cannot be drawn: {reason}")
    files = field_files(out, field_phases(fields), others)
    if files:
        from gearbench.bench.stress.fields import refuse_cracks

        refuse_cracks(case.rig)
    return files


def _solved(case: Case, model: str | None, elastic: bool, progress: Progress, **wanted: Any) -> Any:
    """The static response that is `wanted`, of finite elements with the stress of the tooth roots."""
    import gearbench as gb

    progress.step("mesh cycle")
    result = gb.static(case, model, progress=progress, **wanted)
    if not elastic:
        return result
    from gearbench.bench.elastic.rig import elastic_rig
    from gearbench.bench.stress.root import with_root_stress

    progress.step("root stress")
    return with_root_stress(elastic_rig(case.rig, case.simulation), result, case.simulation.element_size)


def _stress_files(
    case: Case, result: Any, files: list[tuple[float, Path, Path]], root_figure: Path | None, progress: Progress
) -> list[Path]:
    """Write fields and the picture of root stress where asked for; the fields' files."""
    if root_figure is not None:
        from gearbench.figures.gears.stress import plot_root_stress

        (largest,) = sorted(root_tables(case, result), key=lambda one: float(one["torque_nm"]))[-1:]
        iso = {name: gear["sigma_f0_mpa"] for name, gear in largest["gears"].items() if gear["sigma_f0_mpa"]}
        plot_root_stress(result, root_figure, iso)
    return write_all(case, result, files, progress) if files else []


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
        "warnings": [line for line in str(result.attrs.get("warnings", "")).splitlines() if line],
    }

"""`simulate CASE --out FILE`: the record of a case's experiment."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.shell.checkpoints import checkpoints_of
from gearbench.shell.options import CaseArgument, JsonOption, ModelOption, SetOption, check_out, load_case, print_json
from gearbench.shell.progress import Progress

if TYPE_CHECKING:
    from gearbench.rig import Case


def simulate(
    case: CaseArgument,
    out: Annotated[Path, typer.Option("--out", help="record to write (NetCDF-4); NAME-CONDITION.nc with conditions")],
    model: ModelOption = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Carry out the experiment of a case on a model and write the record.

    A case with condition tables has one record for each: `--out DIR/record.nc` writes
    DIR/record-NAME.nc, NAME being the name of the condition. A simulation that was interrupted or killed goes on
    where it was when the same command is given again.
    """
    loaded = load_case(case, settings)
    check_out(out, [case])
    import gearbench as gb
    from gearbench.bench.readiness import check_timing

    check_timing(loaded)
    summaries = []
    with Progress(f"simulate {loaded.name}") as progress:
        for experiment, path in experiments(loaded, out):
            progress.step(path.name)
            with checkpoints_of(path) as checkpoints:
                record = gb.simulate(experiment, model, progress, checkpoints=checkpoints)
                gb.write_record(record, path)
            summaries.append(record_summary(record, path))
    if as_json:
        print_json(summaries if loaded.conditions else summaries[0])
        return
    for summary in summaries:
        typer.echo(
            f"{summary['file']}: {summary['realisations']} x {summary['duration_s']:g} s at"
            f" {summary['sampling_rate_hz']:g} Hz, DTE {summary['dte_peak_to_peak_um']:.4g} um peak to peak"
        )


def experiments(case: Case, out: Path) -> list[tuple[Case, Path]]:
    """The case under each of its conditions (or as it is, without any) and the record that belongs to it."""
    return [
        (one, out.with_name(f"{out.stem}-{name}{out.suffix}") if name else out) for name, one in case.experiments()
    ]


def record_summary(record: Any, path: Path) -> dict[str, Any]:
    """Size of a record and of its transmission error."""
    rate = float(record.attrs["sampling_rate"])
    return {
        "file": str(path),
        "model": record.attrs.get("model", ""),
        "realisations": int(record.sizes["realisation"]),
        "duration_s": record.sizes["time"] / rate,
        "sampling_rate_hz": rate,
        "dte_peak_to_peak_um": float(record["dte"].max() - record["dte"].min()) * 1e6,
        "torque_rms_nm": float(record["torque_driver"].std()),
        "settling_residual": record.attrs.get("settling_residual"),
        "warnings": record.attrs.get("warnings", ""),
    }

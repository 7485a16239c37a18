"""`simulate CASE --out FILE`: the record of a case's experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.shell.checkpoints import checkpoints_of
from gearbench.shell.options import (
    CaseArgument,
    JsonOption,
    ModelOption,
    SetOption,
    WorkersOption,
    check_out,
    load_case,
    print_json,
)
from gearbench.shell.progress import Progress

if TYPE_CHECKING:
    from gearbench.rig import Case

MOST_FIELDS = 1000


def simulate(
    case: CaseArgument,
    out: Annotated[Path, typer.Option("--out", help="record to write (NetCDF-4); NAME-CONDITION.nc with conditions")],
    model: ModelOption = None,
    fields: Annotated[
        list[float] | None,
        typer.Option(
            "--fields",
            metavar="TIME",
            help="times in s after the first sample at which displacement and stress are written beside --out, as .vtu"
            " files and a .pvd that ParaView opens; the record then holds tooth forces",
        ),
    ] = None,
    every: Annotated[
        float | None, typer.Option("--fields-every", metavar="SECONDS", help="fields at every so many seconds")
    ] = None,
    workers: WorkersOption = None,
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
    from gearbench.bench.readiness import check_timing

    check_timing(loaded)
    if fields or every is not None:
        loaded = with_teeth(loaded)
    times = {path: field_times(one, model, fields or [], every) for one, path in experiments(loaded, out)}
    with Progress(f"simulate {loaded.name}") as progress:
        summaries = write_records(loaded, out, model, times, workers, progress)
    if as_json:
        print_json(summaries if loaded.conditions else summaries[0])
        return
    for summary in summaries:
        typer.echo(
            f"{summary['file']}: {summary['realisations']} x {summary['duration_s']:g} s at"
            f" {summary['sampling_rate_hz']:g} Hz, DTE {summary['dte_peak_to_peak_um']:.4g} um peak to peak"
        )
        for warning in summary["warnings"].splitlines():
            typer.echo(f"warning: {warning}")


def write_records(
    case: Case,
    out: Path,
    model: str | None,
    times: Mapping[Path, list[float]],
    workers: int | None,
    progress: Progress,
) -> list[dict[str, Any]]:
    """Records of a case's experiments, side by side, each straight into its file, with the fields at its times; what
    there is to say of each."""
    from gearbench.bench.conditions import simulate_all_to

    found = experiments(case, out)
    paths = [path for _, path in found]
    summaries: dict[int, dict[str, Any]] = {}
    progress.step(paths[0].name if len(paths) == 1 else f"{len(paths)} conditions")
    with ExitStack() as folders:
        checkpoints = [folders.enter_context(checkpoints_of(path)) for path in paths]
        cases = [one for one, _ in found]
        take = summaries.__setitem__
        simulate_all_to(cases, paths, take, model, progress, checkpoints=checkpoints, workers=workers)
    for one, path in found:
        if times[path]:
            write_fields(one, times[path], path, progress)
    return [summaries[number] for number in range(len(paths))]


def with_teeth(case: Case) -> Case:
    """The case with tooth forces in its record."""
    return case.model_copy(update={"simulation": case.simulation.model_copy(update={"outputs": "teeth"})})


def field_times(case: Case, model: str | None, fields: Sequence[float], every: float | None) -> list[float]:
    """Times [s] at which an experiment's fields are wanted, rising. Raises InputError, BenchError."""
    from gearbench.shell.failure import InputError

    times = set(fields)
    if every is not None:
        experiment = case.experiment
        last = (experiment.periods * experiment.samples_per_period - 1) / experiment.sampling_rate
        if not every > 0 or last / every > MOST_FIELDS:
            raise InputError(
                f"--fields-every {every:g} must be at least {last / MOST_FIELDS:.3g} s, which are {MOST_FIELDS} files"
            )
        times |= {number * every for number in range(int(last / every * (1 + 1e-12)) + 1)}
    if times:
        from gearbench.bench.stress.series import check_series

        check_series(case, sorted(times), model)
    return sorted(times)


def write_fields(case: Case, times: Sequence[float], out: Path, progress: Progress) -> None:
    """The fields of the record `out` at some times, beside it."""
    from gearbench.bench.stress.series import record_fields, write_series
    from gearbench.records import opened_record

    progress.step("stress fields")
    with opened_record(out) as record:
        moments = record_fields(case, record, times)
        series, *_ = write_series(moments, out.parent, out.stem, lambda done: progress(done / len(times), "fields"))
    typer.echo(f"{series}: {len(times)} instants", err=True)


def experiments(case: Case, out: Path) -> list[tuple[Case, Path]]:
    """The case under each of its conditions (or as it is, without any) and the record that belongs to it."""
    return [
        (one, out.with_name(f"{out.stem}-{name}{out.suffix}") if name else out) for name, one in case.experiments()
    ]


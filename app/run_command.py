"""`run CASE --out FOLDER`: the whole way from a case to its time-varying frequency response."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.options import CaseArgument, JsonOption, SetOption, load_case, print_json
from gearbench.output import Output, claimed, fingerprint
from gearbench.progress import Progress
from gearbench.simulate_command import experiments

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.rig import Case

STATIC_POSITIONS = 256


def run(
    case: CaseArgument,
    out: Annotated[Path | None, typer.Option("--out", help="folder for the results; absent: out_NAME")] = None,
    force: Annotated[bool, typer.Option("--force", help="replace the results of another run in that folder")] = False,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Carry out the experiment of a case and identify it: records, responses, pictures and a summary.

    A folder that holds part of the same run is completed.
    """
    loaded = load_case(case, settings)
    from gearbench.geometry import pair
    from gearbench.records import source_digest
    from gearbench.rig import dump_case

    pair(loaded.rig)  # an impossible pair is refused before a folder is made
    folder = out or Path(f"out_{loaded.name}")
    identity = fingerprint(dump_case(loaded), source_digest())
    numbers = []
    with (
        claimed(folder, "run", identity, force) as output,
        Progress(f"run {loaded.name}") as progress,
    ):
        output.write_text("case.toml", dump_case(loaded))
        for experiment, name in experiments(loaded, Path("record.nc")):
            numbers.append(run_experiment(experiment, name.stem.removeprefix("record"), output, progress))
    if as_json:
        print_json(numbers if loaded.conditions else numbers[0])
        return
    from gearbench.summary import headline

    for values in numbers:
        typer.echo("\n".join(headline(values)))
    typer.echo(str(folder))


def run_experiment(case: Case, suffix: str, output: Output, progress: Progress) -> dict[str, Any]:
    """One condition: what is missing in the folder is made; the numbers of its summary."""
    from gearbench.bench import simulate
    from gearbench.bench.results import identify_case, reference_results
    from gearbench.bench.static import static
    from gearbench.identification import read_frf, write_frf
    from gearbench.records import read_record, write_record
    from gearbench.records.storage import write_atomically
    from gearbench.summary import run_numbers, summary_text

    record = kept(
        output,
        f"record{suffix}.nc",
        read_record,
        lambda: (progress.step("simulating"), simulate(case, None, progress))[1],
        write_record,
    )
    identified = kept(
        output,
        f"frf{suffix}.nc",
        read_frf,
        lambda: (progress.step("identifying"), identify_case(case, record, progress))[1],
        write_frf,
    )
    results = {"identified": identified}
    if case.simulation.model == "lumped":
        names = ("exact", "frozen")
        if not all(output.has(f"{name}{suffix}.nc") for name in names):
            progress.step("exact and frozen response")
            for name, frf in reference_results(case, identified).items():
                output.write(f"{name}{suffix}.nc", lambda path, frf=frf: write_frf(frf, path))
        results |= {name: read_frf(output.path(f"{name}{suffix}.nc")) for name in names}
    progress.step("static mesh cycle")
    cycle = static(case, positions=STATIC_POSITIONS)
    output.write(
        f"static{suffix}.nc",
        lambda path: write_atomically(path, lambda inner: cycle.to_netcdf(inner, engine="h5netcdf")),
    )
    progress.step("pictures and summary")
    pictures = draw_all(case, record, results, cycle, suffix, output)
    zones, _ = case_zones(case)
    numbers = run_numbers(case, cycle, record, results, zones)
    output.write_text(f"summary{suffix}.md", summary_text(numbers, pictures))
    return numbers


def kept(
    output: Output,
    name: str,
    read: Callable[[Path], xr.Dataset],
    make: Callable[[], xr.Dataset],
    write: Callable[[xr.Dataset, Path], None],
) -> xr.Dataset:
    """A product of an earlier, interrupted run of the same case, or a new one."""
    if output.has(name):
        return read(output.path(name))
    made = make()
    output.write(name, lambda path: write(made, path))
    return made


def case_zones(case: Case) -> tuple[list[tuple[float, float]], str]:
    """Spans of mesh phase with the fewest pairs in contact, and what they are called."""
    from gearbench.geometry import pair
    from gearbench.zones import contact_span, fewest_pairs, zone_label

    span = contact_span(pair(case.rig))
    return fewest_pairs(span), zone_label(span)


def draw_all(
    case: Case, record: xr.Dataset, results: dict[str, xr.Dataset], cycle: xr.Dataset, suffix: str, output: Output
) -> list[str]:
    """Every picture of one condition; their names."""
    from gearbench.figures_frf import draw_itf, draw_natural_frequencies
    from gearbench.figures_gear import draw_pair
    from gearbench.figures_record import draw_record, draw_stiffness
    from gearbench.geometry import mesh_pair, pair

    zones, label = case_zones(case)
    warning = "; ".join(line for line in str(results["identified"].attrs.get("warnings", "")).splitlines() if line)
    mesh = mesh_pair(case.rig, case.simulation.element_size) if case.simulation.model != "lumped" else None
    pictures: dict[str, Callable[[Path], None]] = {
        "gears": lambda path: draw_pair(path, case.rig, pair(case.rig), mesh),
        "stiffness": lambda path: draw_stiffness(path, cycle, zones, label),
        "record": lambda path: draw_record(path, record),
        "itf": lambda path: draw_itf(path, results, warning),
        "natural_frequency": lambda path: draw_natural_frequencies(path, results, zones, label, warning),
    }
    names = []
    for name, draw in pictures.items():
        output.write(f"{name}{suffix}.png", draw)
        names.append(f"{name}{suffix}.png")
    return names

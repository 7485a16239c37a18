"""The main job for one experiment: statics, record, frequency responses, pictures, summary."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearbench.geometry.pair.zones import contact_span, fewest_pairs, zone_label
from gearbench.shell.output import Output
from gearbench.shell.progress import Progress
from gearbench.words.summary import run_numbers
from gearbench.words.summary_text import honest_warning, summary_text

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.geometry import Pair
    from gearbench.rig import Case

POSITIONS = 256  # mesh phases of the static response

ABOUT = {
    "case.toml": "the case with every key, defaults included",
    "static.nc": "static transmission error, stiffness and load sharing over the mesh period",
    "record.nc": "the record, as a rig would hand it back",
    "frf.nc": "frequency response identified from the record",
    "exact.nc": "exact frequency response of the lumped model",
    "frozen.nc": "frequency response with coefficients frozen at each phase (not the truth)",
    "linearised.nc": "first natural frequency of the finite-element model, linearised at each mesh phase",
    "gears.png": "gear pair and mesh",
    "stiffness.png": "mesh stiffness over the mesh period",
    "record.png": "torque and DTE against time",
    "itf.png": "magnitude of the ITF over frequency and mesh phase",
    "natural_frequency.png": "natural frequency against mesh phase",
    "summary.json": "the numbers of this summary",
}


@dataclass
class Job:
    """One experiment of a case in an output folder; `suffix` tells conditions apart in file names."""

    case: Case
    output: Output
    progress: Progress
    suffix: str = ""

    def name(self, base: str) -> str:
        """File name of a product: record.nc, or record-CONDITION.nc."""
        stem, dot, ending = base.rpartition(".")
        return f"{stem}{self.suffix}{dot}{ending}"

    def dataset(self, base: str, read: Callable[[Path], Any], make: Callable[[], Any], write: Any) -> xr.Dataset:
        """The product of an earlier run where there is one; else made, written and returned."""
        name = self.name(base)
        if self.output.has(name):
            return read(self.output.path(name))
        self.progress.step(name)
        made: xr.Dataset = make()
        self.output.write(name, lambda path: write(made, path))
        return made

    def picture(self, base: str, draw: Callable[[Path], None]) -> None:
        """A picture, drawn unless an earlier run has."""
        name = self.name(base)
        if not self.output.has(name):
            self.progress.step(name)
            self.output.write(name, draw)


def run_experiment(job: Job) -> dict[str, Any]:
    """All products of one experiment; the numbers of its summary."""
    from gearbench.bench import simulate
    from gearbench.bench.models import model_for
    from gearbench.bench.results.responses import identify_case, linearised_modes, reference_results
    from gearbench.bench.static import static
    from gearbench.geometry import pair
    from gearbench.identification import read_frf, write_frf
    from gearbench.rig import dump_case

    case, progress = job.case, job.progress
    meshing = pair(case.rig)
    job.output.write_text(job.name("case.toml"), dump_case(case))
    _draw_gears(job, meshing)
    statics = job.dataset("static.nc", _read, lambda: static(case, positions=POSITIONS, progress=progress), _write)
    record = job.dataset("record.nc", _read_record, lambda: simulate(case, progress=progress), _write_record)
    modes: dict[str, xr.Dataset] = {}
    results = {"identified": job.dataset("frf.nc", read_frf, lambda: identify_case(case, record, progress), write_frf)}
    if not model_for(case)[1].elastic:
        made: dict[str, xr.Dataset] = {}

        def reference(kind: str) -> xr.Dataset:
            made.update(made or reference_results(case, results["identified"]))
            return made[kind]

        for kind in ("exact", "frozen"):
            results[kind] = job.dataset(f"{kind}.nc", read_frf, partial(reference, kind), write_frf)
    else:
        modes["linearised"] = job.dataset("linearised.nc", _read, lambda: linearised_modes(case), _write)
    span = contact_span(meshing)
    zones = fewest_pairs(span)
    numbers = run_numbers(case, statics, record, results, modes, zones)
    numbers["support_corner_hz"] = _support_corner(case)
    _draw_results(job, statics, record, results, modes, honest_warning(numbers), zones, zone_label(span))
    numbers["files"] = {job.name(base): about for base, about in ABOUT.items() if job.output.has(job.name(base))}
    _write_summary(job, numbers)
    return numbers


def _support_corner(case: Case) -> float | None:
    """Lowest corner frequency k/(2 pi c) [Hz] of the supports; None where they are not damped."""
    supports = (case.rig.support.driver, case.rig.support.driven)
    corners = [support.stiffness / (2 * pi * support.damping) for support in supports if support.damping]
    return min(corners, default=None)


def _draw_gears(job: Job, meshing: Pair) -> None:
    from gearbench.figures.gear import draw_pair

    def draw(path: Path) -> None:
        from gearbench.bench.models import model_for
        from gearbench.geometry import mesh_pair

        elastic = model_for(job.case)[1].elastic
        simulation = job.case.simulation
        mesh = mesh_pair(job.case.rig, simulation.element_size, simulation.element) if elastic else None
        draw_pair(path, job.case.rig, meshing, mesh)

    job.picture("gears.png", draw)


def _draw_results(
    job: Job,
    statics: xr.Dataset,
    record: xr.Dataset,
    results: dict[str, xr.Dataset],
    modes: dict[str, xr.Dataset],
    warning: str,
    zones: list[tuple[float, float]],
    label: str,
) -> None:
    from gearbench.figures.frf import draw_itf, draw_natural_frequencies
    from gearbench.figures.record import draw_record, draw_stiffness

    job.picture("stiffness.png", lambda path: draw_stiffness(path, statics, zones, label))
    job.picture("record.png", lambda path: draw_record(path, record))
    job.picture("itf.png", lambda path: draw_itf(path, results, warning))
    job.picture(
        "natural_frequency.png", lambda path: draw_natural_frequencies(path, results | modes, zones, label, warning)
    )


def _write_summary(job: Job, numbers: dict[str, Any]) -> None:
    from gearbench.shell.options import json_text

    job.output.write_text(job.name("summary.json"), json_text(numbers) + "\n")
    job.output.write_text(job.name("summary.md"), summary_text(numbers))


def _read(path: Path) -> xr.Dataset:
    import xarray as xr

    return xr.load_dataset(path, engine="h5netcdf", decode_cf=False)


def _write(dataset: xr.Dataset, path: Path) -> None:
    dataset.to_netcdf(path, engine="h5netcdf", encoding={str(name): {"_FillValue": None} for name in dataset.variables})


def _read_record(path: Path) -> xr.Dataset:
    from gearbench.records import read_record

    return read_record(path)


def _write_record(record: xr.Dataset, path: Path) -> None:
    from gearbench.records import write_record

    write_record(record, path)

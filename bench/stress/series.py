"""Fields at chosen instants of a transient: what the teeth of a record carry there, as a series that ParaView plays."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import cos, floor, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import ElasticRig, elastic_rig
from gearbench.bench.errors import BenchError
from gearbench.bench.record.channels import PAIRS
from gearbench.bench.stress.fields import PairFields, Stand, fields_at, refuse_cracks, stress_gears, write_fields
from gearbench.fem.contact.law import Meetings, contact_in, find_pairs
from gearbench.fem.stress.loaded import PairLoad
from gearbench.files import write_text
from gearbench.rig import Case

Array = NDArray[np.float64]

NEAR = 1e-4  # gap [m] below which a tooth pair may carry: what the vibration of the gears' bodies closes


class Moment(NamedTuple):
    """Fields at a time [s] of a record."""

    time: float
    fields: PairFields


def check_series(case: Case, times: Sequence[float], model: str | None = None) -> None:
    """Raise BenchError unless a record of the case can show fields at times [s] after its first sample."""
    name = model or case.simulation.model
    if name not in ("reduced", "full"):
        raise BenchError(
            f'fields are found from the forces of single teeth, which simulation.model = "{name}" lacks: take "reduced"'
        )
    refuse_cracks(case.rig)
    experiment = case.experiment
    last = (experiment.periods * experiment.samples_per_period - 1) / experiment.sampling_rate
    for time in times:
        if not 0.0 <= time <= last:
            raise BenchError(f"fields at {time:g} s lie outside the record, which lasts from 0 to {last:g} s")


def record_fields(case: Case, record: xr.Dataset, times: Sequence[float]) -> Iterator[Moment]:
    """Fields of the first realisation of a record, which holds tooth forces (simulation.outputs = "teeth"), at the
    samples nearest to `times` [s] after its first.

    The teeth carry what the record says, where both gears stand; displacement is elastic, relative to hubs that do not
    accelerate: the inertia of the gears' bodies bends them by no more than their lowest modes show. Raises BenchError
    for a record without tooth forces.
    """
    if "tooth_force_middle" not in record:
        raise BenchError('the record has no tooth forces: simulate with simulation.outputs = "teeth"')
    elastic = elastic_rig(case.rig, case.simulation)
    gears = stress_gears(elastic, case.simulation.element_size)
    rate = float(record.attrs["sampling_rate"])
    for time in times:
        k = min(max(round(time * rate), 0), record.sizes["time"] - 1)
        yield Moment(float(record["time"][k]), fields_at(elastic, gears, stand_of(elastic, record, k)))


def stand_of(elastic: ElasticRig, record: xr.Dataset, sample: int) -> Stand:
    """Where both gears stand at a sample of a record's first realisation, and what each tooth pair carries."""
    law = elastic.law
    there = record.isel(realisation=0, time=sample)  # of a record that stays on disk, only that is read
    seen = {str(name): float(there[name]) for name in record.data_vars}
    theta = seen["angle_driver"], seen["angle_driven"]
    centres = np.array([[0.0, 0.0], [law.centre, 0.0]]) + _moved(elastic, seen)
    apart = centres[1] - centres[0]
    met = find_pairs(law, *theta, *(float(one) for one in apart), NEAR)
    phase = theta[1] / law.driven.pitch
    return Stand(theta, centres, tuple(_carried(met, floor(phase + 0.5), seen)), phase, seen["dte"])


def _moved(elastic: ElasticRig, seen: dict[str, float]) -> Array:
    """Motions (2, 2) [m] of both centres, in the frame of the rig."""
    sloped = elastic.rig.support.direction == "line-of-action"
    alpha = elastic.pair.working_pressure_angle if sloped else 0.0
    along, across = np.array([sin(alpha), cos(alpha)]), np.array([cos(alpha), -sin(alpha)])
    gears = ("driver", "driven")
    return np.array([seen[f"y_{gear}"] * along + seen.get(f"x_{gear}", 0.0) * across for gear in gears])


def _carried(met: Meetings, nearest: int, seen: dict[str, float]) -> list[PairLoad]:
    """The tooth pairs that carry: of those that a channel of the record stands for, the one that is closest."""
    loads = []
    for name in (*PAIRS, "back"):
        force = seen[f"tooth_force_{name}"]
        if not force > 0.0:
            continue
        side = 1 if name == "back" else 0
        near = [p for p in range(len(met)) if met[p]["side"] == side]
        wanted = [p for p in near if side or _is(name, int(met[p]["tooth"]), nearest)]
        if not wanted:
            raise BenchError(f"no teeth meet where tooth_force_{name} = {force:.4g} N acts: not a record of this rig")
        p = min(wanted, key=lambda one: float(met[one]["gap"]))
        loads.append(PairLoad(side, int(met[p]["tooth"]), contact_in(met, p), force))
    return loads


def _is(name: str, tooth: int, nearest: int) -> bool:
    """Whether a driver's tooth is of that pair, `nearest` being the one nearest the pitch point."""
    return {"leaving": tooth < nearest, "middle": tooth == nearest, "entering": tooth > nearest}[name]


def write_series(
    moments: Iterator[Moment], folder: Path, stem: str, told: Callable[[int], None] | None = None
) -> list[Path]:
    """Write each moment as STEM_fields_0000.vtu, ... and STEM_fields.pvd, which ParaView opens as a series over time;
    `told(n)` after n of them. Returns the files, the .pvd first."""
    files, entries = [], []
    for number, moment in enumerate(moments):
        path = write_fields(folder / f"{stem}_fields_{number:04d}.vtu", moment.fields)
        files.append(path)
        entries.append(f'    <DataSet timestep="{moment.time!r}" part="0" file="{path.name}"/>\n')
        if told:
            told(number + 1)
    kind = 'type="Collection" version="0.1" byte_order="LittleEndian"'
    head = f'<?xml version="1.0"?>\n<VTKFile {kind}>\n  <Collection>\n'
    series = folder / f"{stem}_fields.pvd"
    write_text(series, f"{head}{''.join(entries)}  </Collection>\n</VTKFile>\n")
    return [series, *files]

"""A pair that turns through the mesh: stress around the contacts at successive instants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import ElasticRig
from gearbench.bench.errors import BenchError
from gearbench.bench.plan.schedule import ProgressReport
from gearbench.bench.stress.fields import Contact, field_dte, pair_fields, stress_gears
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.stress.fields import ElasticGear

Array = NDArray[np.float64]

TEETH = ("tooth_force_middle", "tooth_force_leaving", "tooth_force_entering")


@dataclass(frozen=True)
class Instant:
    """When and under what: mesh phase [cycles], driver torque [N m] that the mesh carries, and the transmission error
    [m] that is shown."""

    phase: float
    torque: float
    dte: float


@dataclass(frozen=True)
class Frame:
    """Both gears at an instant, in the frame of the rig.

    turns: angles of tooth 0 of both gears [rad]; points (n, 2) [m], triangles (m, 3) of the sectors around the contacts
    and von Mises stress (n,) [Pa] there, in single precision; contacts. Without contact there are no points.
    """

    instant: Instant
    turns: tuple[float, float]
    points: NDArray[np.float32]
    triangles: NDArray[np.int32]
    von_mises: NDArray[np.float32]
    contacts: tuple[Contact, ...]


def static_instants(elastic: ElasticRig, torque: float, phases: Array) -> list[Instant]:
    """Static positions at mesh phases under one driver torque [N m]. Raises ContactError."""
    error = static_cycle(elastic.law, phases, torque=[torque], dte=None).transmission_error[0]
    return [Instant(float(x), torque, float(d)) for x, d in zip(phases, error, strict=True)]


def recorded_instants(record: xr.Dataset, frames: int, cycles: float, base_radius: float) -> list[Instant]:
    """`frames` instants of the first realisation over `cycles` mesh periods from its start, under the tooth forces of
    the record: the torque is theirs on the base circle of the driver. Raises BenchError for what the record lacks."""
    missing = [name for name in ("mesh_phase", "dte", *TEETH) if name not in record]
    if missing:
        raise BenchError(
            f"the record has no {', '.join(missing)}: an animation needs tooth forces, which simulate with"
            ' simulation.outputs = "teeth" and model reduced or full writes'
        )
    row = record.isel(realisation=0)
    phase = row["mesh_phase"].values
    length = float(phase[-1] - phase[0])
    if cycles > length:
        raise BenchError(f"the record has {length:.4g} mesh periods and cycles = {cycles:g} are asked for")
    wanted = phase[0] + cycles * np.arange(frames) / frames
    at = np.clip(np.searchsorted(phase, wanted), 0, phase.size - 1)
    force = np.sum([row[name].values[at] for name in TEETH], axis=0)
    return [
        Instant(float(phase[k]), float(f) * base_radius, float(row["dte"].values[k]))
        for k, f in zip(at, force, strict=True)
    ]


def moving_frames(
    elastic: ElasticRig, instants: Sequence[Instant], element_size: float | None, progress: ProgressReport
) -> list[Frame]:
    """Fields at each instant: static, under the torque that the mesh carries there. Raises ContactError."""
    gears = stress_gears(elastic, element_size)
    frames = []
    for number, instant in enumerate(instants):
        frames.append(_frame(elastic, gears, instant))
        progress((number + 1) / len(instants), f"mesh phase {instant.phase:.3f}")
    return frames


def _frame(elastic: ElasticRig, gears: tuple[ElasticGear, ElasticGear], instant: Instant) -> Frame:
    law = elastic.law
    loaded = instant.torque > 0.0
    dte = field_dte(elastic, instant.phase, instant.torque, "N m") if loaded else 0.0
    turns = (
        law.driver.zero + instant.phase * law.driver.pitch + dte / law.driver.rb,
        pi + law.driven.zero - instant.phase * law.driven.pitch,
    )
    if not loaded:
        none = np.empty(0, np.float32)
        return Frame(instant, turns, none.reshape(0, 2), np.empty((0, 3), np.int32), none, ())
    fields = pair_fields(elastic, gears, instant.phase, dte)
    return Frame(
        instant,
        turns,
        fields.mesh.points.astype(np.float32),
        quarters(fields.mesh.cells).astype(np.int32),
        fields.von_mises.astype(np.float32),
        fields.contacts,
    )


def quarters(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Each quadratic triangle (m, 6) as four straight ones (4 m, 3)."""
    return np.concatenate([triangles[:, [0, 3, 5]], triangles[:, [3, 1, 4]], triangles[:, [5, 4, 2]], triangles[:, 3:]])

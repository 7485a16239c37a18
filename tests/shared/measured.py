"""Records of a rig at rest on its springs, in closed form: what a measurement of gap_demo looks like."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from math import cos, pi
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gearbench.cases import case_files
from gearbench.geometry import pair
from gearbench.records import make_record, write_record
from gearbench.rig import Case, read_case

RATE, SAMPLES, MESH = 10240.0, 12288, 50.0


@lru_cache(maxsize=1)
def nominal() -> Case:
    """The nominal case of the demonstration."""
    return read_case(case_files()["gap_demo"])


def channels(
    *, torque: float = 100.0, mesh: float = MESH, samples: int = SAMPLES, periods: int = 2, noise: float = 1.0,
    phase: float = 0.0, seed: int = 0, ahead: np.ndarray | float = 0.0,
) -> dict[str, np.ndarray]:
    """Quasi-static channels: both gears on springs of 1e8 N/m, the mesh too; white noise times `noise`; the rotation is
    `ahead` (samples * periods,) [cycles] of a steady one."""
    meshing = pair(nominal().rig)
    r1, r2 = meshing.driver.base_radius, meshing.driven.base_radius
    time = np.arange(samples * periods) / RATE
    line = RATE / samples
    load = torque + 0.3 * torque * sum(np.cos(2 * pi * k * line * time + k * seed) for k in (31, 91, 151)) / 3
    force = load / r1
    along = force * cos(meshing.working_pressure_angle) / 1e8
    cycles = phase + mesh * time + ahead
    error = force / 1e8 + 2e-6 * np.cos(2 * pi * cycles)
    turn = np.random.default_rng(seed)
    clean = {
        "torque_driver": (load, 0.02),
        "torque_driven": (force * r2, 0.02),
        "angle_driver": (2 * pi * cycles / 20 + (error + 2 * along * cos(meshing.working_pressure_angle)) / r1, 1e-6),
        "angle_driven": (2 * pi * cycles / 30, 1e-6),
        "y_driver": (-along, 5e-8),
        "y_driven": (along, 5e-8),
    }
    found = {name: value + noise * rms * turn.normal(size=time.size) for name, (value, rms) in clean.items()}
    return {**found, "mesh_phase": cycles}


def attributes(**changes: Any) -> dict[str, Any]:
    """What such a record says about itself; None leaves an attribute out."""
    meshing = pair(nominal().rig)
    return {
        "sampling_rate": RATE, "samples_per_period": SAMPLES, "periods": 2, "mesh_period": 1 / MESH,
        "teeth_driver": 20, "teeth_driven": 30,
        "base_radius_driver": meshing.driver.base_radius, "base_radius_driven": meshing.driven.base_radius,
        "inertia_driver": 2.3e-3, "inertia_driven": 1.5e-3,
        "working_pressure_angle": meshing.working_pressure_angle,
        "support_direction": "tangential", "driven_boundary": "speed", "mesh_phase_origin": "geometry",
        **changes,
    }


def record(values: Mapping[str, np.ndarray] | None = None, **changes: Any) -> xr.Dataset:
    """A record of the given channels (samples,), by default those of `channels()`."""
    values = channels() if values is None else values
    return make_record({name: value[None] for name, value in values.items()}, attributes(**changes))


def written(folder: Path, name: str, values: Mapping[str, np.ndarray] | None = None, **changes: Any) -> Path:
    """Such a record as a file."""
    path = folder / f"{name}.nc"
    write_record(record(values, **changes), path)
    return path

"""Mesh stiffness by every method, like with like: a static solution beside the analytic ones.

Finite elements from hub to hub contain the torsion of both gear bodies, and so does the potential energy method, by way
of its foundation on a ring held at the hub; Weber-Banaschek and ISO 6336 do not. The first two are therefore shown with
it and without it. All values are secant stiffnesses, force along the line of action over transmission error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.geometry import Pair, pair
from gearbench.lumped import LumpedError, potential_energy_stiffness
from gearbench.lumped.stiffness.body_torsion import without_body_torsion
from gearbench.lumped.stiffness.iso6336 import SI, iso_stiffness
from gearbench.lumped.stiffness.potential_energy import outside_foundation_fit, pair_stiffness
from gearbench.lumped.stiffness.weber_banaschek import mesh_deflection
from gearbench.lumped.stiffness.weber_banaschek import pair_stiffness as weber_banaschek_pair
from gearbench.rig import Case, Rig
from gearbench.rig.neutral import effects_in

Array = NDArray[np.float64]

ALONE = 1 - 1e-9  # share of the load that a tooth pair carries alone


@dataclass(frozen=True)
class StiffnessRow:
    """One method: stiffness [N/m] of one pair at the pitch point and over the mesh cycle.

    `single` is None where two pairs carry at the pitch point; `least`, `most` and `curve` (n,) are None for ISO
    6336, which knows the mean only. `torsion`: whether the torsion of the gear bodies is in it.
    """

    model: str
    torsion: bool
    single: float | None
    mean: float
    least: float | None = None
    most: float | None = None
    curve: Array | None = None


@dataclass(frozen=True)
class StiffnessTable:
    """Rows under one load: driver torque [N m], mesh phase (n,) [cycles] of the curves, common face width [m],
    sentences on what the rows leave out."""

    torque: float
    phase: Array
    face_width: float
    rows: tuple[StiffnessRow, ...]
    notes: tuple[str, ...]


def stiffness_table(case: Case, result: xr.Dataset, load: int = 0) -> StiffnessTable:
    """Table of a static `result` of the case, for its load number `load`.

    Analytic methods are evaluated at the same mesh phases, under the cycle's mean force. Raises GeometryError, and
    LumpedError without force.
    """
    rig, meshing = case.rig, pair(case.rig)
    phase = np.asarray(result["phase"].values, dtype=float)
    torque = float(result["torque"].values[load].mean())
    force = torque / meshing.driver.base_radius
    solved, lacks = _solved(rig, meshing, result, load)
    energy, missing = _potential_energy(rig, meshing, phase)
    rows = (*solved, *energy, *_rigid_bodies(rig, meshing, phase, force))
    notes = [*lacks, *missing, *outside_foundation_fit(rig, meshing), *iso_stiffness(rig, meshing, force).notes]
    if any(key.startswith(("rig.driver.", "rig.driven.", "rig.mesh.")) for key in effects_in(rig)):
        notes.append("errors, micro-geometry and corrections of the gears are in no analytic method")
    return StiffnessTable(torque, phase, meshing.face_width, rows, tuple(notes))


def _row(model: str, torsion: bool, curve: Array, single: float | None) -> StiffnessRow:
    return StiffnessRow(model, torsion, single, float(curve.mean()), float(curve.min()), float(curve.max()), curve)


def _solved(rig: Rig, meshing: Pair, result: xr.Dataset, load: int) -> tuple[list[StiffnessRow], list[str]]:
    """Rows of the static solution, and what cannot be said of it."""
    curve = np.asarray(result["stiffness_secant"].values[load], dtype=float)
    if "load_share" not in result:
        # A lumped model's mesh joins two rigid gears, so its stiffness is meant from hub to hub.
        return [_row("lumped model", True, curve, None)], []
    alone = float(result["load_share"].values[load, 0].max()) >= ALONE
    whole = _row("finite elements, hub to hub", True, curve, float(curve[0]) if alone else None)
    try:
        rigid = without_body_torsion(curve, rig, meshing)
    except LumpedError as reason:
        return [whole], [str(reason)]
    name = "finite elements, bodies rigid in torsion"
    return [whole, _row(name, False, rigid, float(rigid[0]) if alone else None)], []


def _potential_energy(rig: Rig, meshing: Pair, phase: Array) -> tuple[list[StiffnessRow], list[str]]:
    """Rows of the potential energy method with and without torsion, which each of its pairs has for itself."""
    energy = potential_energy_stiffness(rig, meshing)
    pitch = pair_stiffness(rig, meshing, meshing.rho_pitch[0])
    whole = _row("potential energy, hub to hub", True, energy.at(phase), float(pitch[0]))
    try:
        rigid = replace(energy, pair_value=without_body_torsion(energy.pair_value, rig, meshing))
    except LumpedError as reason:
        return [whole], [f"potential energy: {reason}"]
    single = float(without_body_torsion(pitch, rig, meshing)[0])
    return [whole, _row("potential energy, bodies rigid in torsion", False, rigid.at(phase), single)], []


def _rigid_bodies(rig: Rig, meshing: Pair, phase: Array, force: float) -> list[StiffnessRow]:
    """Rows of the methods that know no torsion of the bodies."""
    weber = force / mesh_deflection(rig, meshing, phase, force)
    iso = iso_stiffness(rig, meshing, force)
    width = meshing.face_width
    alone = float(weber_banaschek_pair(rig, meshing, meshing.rho_pitch[0], force)[0])
    return [
        _row("Weber-Banaschek", False, weber, alone),
        StiffnessRow("ISO 6336-1 (c', c_gamma)", False, iso.single * SI * width, iso.mesh * SI * width),
    ]

"""CalculiX: write the input deck of two meshed gears, run it, read the hub's reactions."""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from planar_mesh import PlanarMesh

Array = NDArray[np.float64]
THICKNESS = 0.1  # of the computed slab [mm]


@dataclass(frozen=True)
class Touch:
    """Working flanks of one tooth pair that may touch: slave gear (0 driver, 1 driven), edges (element, local
    edge) of slave and master, size of the elements in contact [mm]."""

    slave: int
    slave_edges: NDArray[np.int64]
    master_edges: NDArray[np.int64]
    size: float


@dataclass(frozen=True)
class Reaction:
    """Torques of the slab at the end of an increment [N mm]: driver, driven (opposing), and sum of all forces
    [N]."""

    driver: float
    driven: float
    force: Array


def elastic(youngs_modulus: float, poisson: float, state: str) -> tuple[float, float]:
    """Constants (MPa) with which plane strain gives the stresses and displacements of `state`.

    Plane stress equals plane strain of E (1 + 2 nu)/(1 + nu)^2 and nu/(1 + nu) (Timoshenko and Goodier,
    Theory of Elasticity, art. 17); so no slab thickness has to be small.
    """
    e, nu = youngs_modulus * 1e-6, poisson
    if state == "plane-strain":
        return e, nu
    return e * (1 + 2 * nu) / (1 + nu) ** 2, nu / (1 + nu)


def lines(rows: NDArray[np.int64], first: int) -> str:
    return "\n".join(f"{first + i}, " + ", ".join(map(str, row)) for i, row in enumerate(rows.tolist()))


def behaviour(penalty: float, material: tuple[float, float], touch: Touch) -> str:
    return f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{penalty * material[0] / touch.size:g}"


def write_deck(
    path: Path,
    meshes: tuple[PlanarMesh, PlanarMesh],
    touches: list[Touch],
    hub_motion: Array,
    *,
    material: tuple[float, float],
    penalties: tuple[float, ...],
    element: str = "CPE6",
    thickness: float = THICKNESS,
    nlgeom: bool = False,
) -> None:
    """Write the deck. hub_motion (k, 2) [mm] belongs to the driver's hub nodes; the driven hub is held. Each
    penalty, a pressure per overclosure in units of Young's modulus over element size, is a step that goes on
    from the last."""
    node0 = (0, len(meshes[0].points))
    cell0 = (0, len(meshes[0].triangles))
    out = ["*NODE, NSET=NALL"]
    for mesh, n0 in zip(meshes, node0, strict=True):
        out += [f"{n0 + i + 1}, {x:.12g}, {y:.12g}, 0." for i, (x, y) in enumerate(mesh.points.tolist())]
    for g, (mesh, n0, c0) in enumerate(zip(meshes, node0, cell0, strict=True)):
        out += [f"*ELEMENT, TYPE={element}, ELSET=EALL", lines(mesh.triangles + n0 + 1, c0 + 1)]
        out += [f"*NSET, NSET=HUB{g}", ",\n".join(str(n0 + i + 1) for i in mesh.hub)]
    out += ["*MATERIAL, NAME=STEEL", "*ELASTIC", f"{material[0]:.12g}, {material[1]:.12g}"]
    out += ["*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL", f"{thickness:g}"]
    for k, touch in enumerate(touches):
        out += [f"*SURFACE INTERACTION, NAME=SI{k}", behaviour(penalties[0], material, touch)]
        for name, gear, edges in (
            (f"S{k}", touch.slave, touch.slave_edges),
            (f"M{k}", 1 - touch.slave, touch.master_edges),
        ):
            out += [f"*SURFACE, NAME={name}, TYPE=ELEMENT"]
            out += [f"{e + cell0[gear] + 1}, S{s + 1}" for e, s in edges.tolist()]
        out += [f"*CONTACT PAIR, INTERACTION=SI{k}, TYPE=SURFACE TO SURFACE", f"S{k}, M{k}"]
    for i, penalty in enumerate(penalties):
        out += ["*STEP, INC=50" + (", NLGEOM" if nlgeom else ""), "*STATIC, DIRECT", "1., 1."]
        # Contact settles slowly where many stiff points share a contact: let it, instead of giving up.
        out += ["*CONTROLS, PARAMETERS=TIME INCREMENTATION", "4, 8, 9, 150, 10, 4, , 5, , "]
        if i > 0:
            for k, touch in enumerate(touches):
                out += [f"*CHANGE SURFACE BEHAVIOR, INTERACTION=SI{k}", behaviour(penalty, material, touch)]
        out += ["*BOUNDARY"]
        for n, (ux, uy) in zip(meshes[0].hub.tolist(), hub_motion.tolist(), strict=True):
            out += [f"{n + 1}, 1, 1, {ux:.12g}", f"{n + 1}, 2, 2, {uy:.12g}"]
        out += ["HUB1, 1, 2", "*NODE PRINT, NSET=HUB0", "RF", "*NODE PRINT, NSET=HUB1", "RF", "*END STEP", ""]
    path.write_text("\n".join(out))


def run_deck(path: Path) -> str:
    """Run CalculiX on one core; its log. Raises RuntimeError with the end of the log on failure."""
    environment = os.environ | {"OMP_NUM_THREADS": "1", "CCX_NPROC_EQUATION_SOLVER": "1"}
    done = subprocess.run(
        ["ccx", path.stem], cwd=path.parent, env=environment, capture_output=True, text=True, check=False
    )
    if "*ERROR" in done.stdout or "Job finished" not in done.stdout:
        raise RuntimeError(f"CalculiX failed on {path}:\n{done.stdout[-1500:]}")
    return done.stdout


def read_reactions(path: Path, hubs: tuple[dict[int, Array], dict[int, Array]]) -> list[Reaction]:
    """Reactions at the end of every step (of duration 1) from the .dat file of the deck. hubs: per gear,
    positions (2,) of the hub's nodes (counted from 0, the driven gear's after the driver's) relative to the
    centre, where the forces act [mm]."""
    text = path.with_suffix(".dat").read_text()
    header = r"\n\s*forces \(fx,fy,fz\) for set HUB(\d) and time\s+(\S+)[^\n]*\n"
    _, *parts = re.split(header, text)
    # CalculiX may add an increment of length nearly zero to a step: the last one counts.
    blocks: dict[int, dict[int, str]] = {}
    for gear, time, block in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
        blocks.setdefault(round(float(time)), {})[int(gear)] = block
    found = []
    for _, both in sorted(blocks.items()):
        torque, total = [], np.zeros(2)
        for g, block in sorted(both.items()):
            rows = np.array([line.split()[:3] for line in block.splitlines() if line.strip()], dtype=float)
            at = np.array([hubs[g][int(node) - 1] for node in rows[:, 0]])
            torque.append(float(np.sum(at[:, 0] * rows[:, 2] - at[:, 1] * rows[:, 1])))
            total += rows[:, 1:].sum(axis=0)
        found.append(Reaction(torque[0], torque[1], total))
    return found


def unknowns(log: str) -> int:
    """Number of equations from a log of CalculiX."""
    return int(re.findall(r"number of equations\s+(\d+)", log)[-1])

"""A step of torque on a pair in contact, computed by CalculiX: the model that `mesh --out pair.inp` writes, in time.

The flanks just touch. The driver's hub, whose inertia is that of the case, is let go under a torque and vibrates on the
teeth. Nothing of our dynamics is in it, and of our contact law only where the mesh is fine.

    OMP_NUM_THREADS=1 python torque_step.py --work FOLDER [--across 3] [--size 1] [--penalty 1] [--steps 36]

adds one run to torque_step.json: times [s] and transmission errors [m].
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import time
from dataclasses import replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.bench.elastic.rig import elastic_rig
from gearbench.bench.export import calculix
from gearbench.geometry import body
from gearbench.geometry.export.calculix import Deck, Touch, deck_text
from gearbench.geometry.mesh.assembly import outline_sides
from gearbench.geometry.mesh.grading import Grading
from gearbench.geometry.mesh.values import GearMesh
from gearbench.geometry.tooth.profile import profile
from gearbench.rig import Case, read_case

HERE = Path(__file__).parent
RESULT = HERE / "torque_step.json"
CASE = HERE / "torque_step.toml"
TORQUE = 30.0  # driver torque after the step [N m]
DURATION = 0.72e-3  # [s], more than one period of the first mode
# A cube of 1 mm that holds the driver's hub moves along x by its angle, so that its mass [t] is an inertia [t mm^2].
TO_TONNE_MM2 = 1e9


def mesh_inertia(mesh: GearMesh, density: float, width: float) -> float:
    """Polar inertia [kg m^2] of a mesh of quadratic triangles, by three-point quadrature of its exact map."""
    a, b = 1 / 6, 2 / 3
    total = 0.0
    for x, y in ((a, a), (b, a), (a, b)):
        z = 1 - x - y
        shape = np.array([z * (2 * z - 1), x * (2 * x - 1), y * (2 * y - 1), 4 * z * x, 4 * x * y, 4 * y * z])
        d_x = np.array([1 - 4 * z, 4 * x - 1, 0, 4 * (z - x), 4 * y, -4 * y])
        d_y = np.array([1 - 4 * z, 0, 4 * y - 1, -4 * x, 4 * x, 4 * (z - y)])
        nodes = mesh.points[mesh.cells]
        at, one, two = (np.einsum("a,eac->ec", f, nodes) for f in (shape, d_x, d_y))
        area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
        total += float(np.sum(np.sum(at**2, axis=1) * area)) / 6
    return density * width * total


def _coarsen(across: float, size: float) -> None:
    """Set how fine the exported mesh is: elements over half the width of contact, and coarser teeth than for torque at
    rest (`size` times as large as 0.35 modules in contact, and 1 module elsewhere), because there are many increments
    to solve."""
    calculix.ACROSS = across
    calculix.NEAR, calculix.FAR = 0.35 * size, size
    cuts = ceil(4 / size)
    calculix.NEAR_GRADING = Grading(growth=0.6 * size, bend=1.2, cut_edges=cuts, fine_tips=False)
    calculix.FAR_GRADING = Grading(growth=1.0, bend=1.2, cut_edges=cuts, fine_tips=False)


def on_meshes(deck: Deck, met: tuple[calculix.Meeting, ...], meshes: tuple[GearMesh, GearMesh]) -> Deck:
    """The deck with other meshes of the same gears, the whole flanks of the pairs `met` as surfaces that may touch, and
    the penalty of their elements' size."""
    one, two = (replace(placed, mesh=mesh) for placed, mesh in zip(deck.gears, meshes, strict=True))
    touches = []
    for pair in met:
        slave = int(pair.own_end(1) < pair.own_end(0))
        flanks, sizes = [], []
        for gear, number in ((0, -pair.tooth), (1, pair.tooth)):
            mesh, shape = meshes[gear], pair.shapes[gear]
            sides = outline_sides(mesh, number % mesh.teeth)
            radius = np.hypot(*mesh.points[mesh.middles[sides[:, 0], sides[:, 1]]].T)
            flank = sides[(radius > shape.base_radius) & (radius < shape.tip_radius - shape.edge_radius)]
            flanks.append(flank)
            sizes.append((shape.tip_radius - shape.base_radius) / len(flank))
        touches.append(Touch(slave, flanks[slave], flanks[1 - slave], max(sizes)))
    return replace(deck, gears=(one, two), touches=tuple(touches))


def dynamic_deck(
    case: Case,
    across: float,
    size: float,
    penalty: float,
    steps: int,
    alpha: float,
    meshes: tuple[GearMesh, GearMesh] | None = None,
    duration: float = DURATION,
) -> tuple[str, float, int]:
    """The input of CalculiX, the static transmission error [m] of the torque, and the number of nodes; `meshes` of both
    gears in place of those made here; `duration` [s] of all steps together."""
    _coarsen(across, size)
    model = calculix.contact_model(case, 0.0, torque=TORQUE)
    deck = replace(model.deck, head=("A step of torque on a pair in contact.",))
    if meshes is not None:
        met = calculix.meetings(elastic_rig(case.rig, case.simulation), 0.0, model.dte)
        deck = on_meshes(deck, met, meshes)
    text = deck_text(deck)
    gear, density = case.rig.driver, case.rig.material.density
    inertia = body(profile(gear), gear, density, "rig.driver").inertia
    hub = inertia - mesh_inertia(deck.gears[0].mesh, density, gear.face_width)
    text = text.replace("*MATERIAL, NAME=GEARS\n", f"*MATERIAL, NAME=GEARS\n*DENSITY\n{1e-12 * density:.12g}\n")
    for name, mass in (("DRIVER", TO_TONNE_MM2 * 1e-6 * hub), ("DRIVEN", 1e-3)):
        text = text.replace(f"*MATERIAL, NAME=CUBE_{name}\n", f"*MATERIAL, NAME=CUBE_{name}\n*DENSITY\n{mass:.12g}\n")
    head, *_ = re.split(r"(?=\*\* Step \d)", text)
    head = re.sub(r"(PRESSURE-OVERCLOSURE=LINEAR\n)(\S+)", lambda m: f"{m[1]}{penalty * float(m[2]):.6g}", head)
    nodes = sum(len(placed.mesh.points) for placed in deck.gears)
    return head + "\n".join(_dynamic_step(steps, alpha, duration)) + "\n", model.dte, nodes


def _dynamic_step(steps: int, alpha: float, duration: float) -> list[str]:
    held = [line for name in ("DRIVER", "DRIVEN") for line in (f"HUB_{name}, 1, 1", f"MOMENT_{name}, 2, 3")]
    held += [f"ANGLE_{name}, 2, 3" for name in ("DRIVER", "DRIVEN")] + ["MOMENT_DRIVEN, 1, 1"]
    return [
        f"*STEP, INC={2 * steps}, NLGEOM",
        f"*DYNAMIC, DIRECT, ALPHA={alpha:g}",
        f"{duration / steps:.12g}, {duration:.12g}",
        "*CONTROLS, PARAMETERS=TIME INCREMENTATION",
        "4, 8, 9, 150, 10, 4, , 5, , ",
        "*BOUNDARY",
        *held,
        "*CLOAD",
        f"MOMENT_DRIVER, 1, {1e3 * TORQUE / 4:.12g}",
        "*NODE PRINT, NSET=MOMENT_DRIVER",
        "U",
        # CalculiX follows the energy of contact in time, and wants that asked for.
        "*EL FILE",
        "ENER",
        "*END STEP",
    ]


def angles_in(text: str) -> tuple[list[float], list[float]]:
    """Times [s] of the dynamic step and angles [rad] of the driver's hub, from the .dat file."""
    times, found = [], []
    for block in re.split(r"displacements \(vx,vy,vz\) for set MOMENT_DRIVER and time", text)[1:]:
        lines = [line.split() for line in block.splitlines() if line.split()]
        times.append(float(lines[0][0]))
        found.append(float(np.mean([float(row[1]) for row in lines[1:] if len(row) == 4])))
    return times, found


def run(
    work: Path,
    case: Case,
    settings: dict[str, Any],
    meshes: tuple[GearMesh, GearMesh] | None = None,
    duration: float = DURATION,
) -> dict[str, Any]:
    """One run of CalculiX. Raises RuntimeError where it fails."""
    work.mkdir(parents=True, exist_ok=True)
    text, dte, nodes = dynamic_deck(case, **settings, meshes=meshes, duration=duration)
    (work / "step.inp").write_text(text)
    before = time.perf_counter()
    done = subprocess.run(["ccx", "step"], cwd=work, capture_output=True, text=True, check=False)
    (work / "step.log").write_text(done.stdout)
    times, turned = angles_in((work / "step.dat").read_text())
    if len(times) < settings["steps"]:
        raise RuntimeError(f"CalculiX stopped after {len(times)} of {settings['steps']} increments")
    base = profile(case.rig.driver).base_radius
    start = times[0] - duration / settings["steps"]
    return {
        **settings,
        "nodes": nodes,
        "seconds": round(time.perf_counter() - before, 1),
        "static_um": 1e6 * dte,
        "time": [round(t - start, 12) for t in times],
        "dte_um": [round(1e6 * base * angle, 9) for angle in turned],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--across", type=float, default=3.0)
    parser.add_argument("--size", type=float, default=1.0)
    parser.add_argument("--penalty", type=float, default=1.0)
    parser.add_argument("--steps", type=int, default=36)
    parser.add_argument("--alpha", type=float, default=-0.05)
    given = parser.parse_args()
    settings = {name: getattr(given, name) for name in ("across", "size", "penalty", "steps", "alpha")}
    case = read_case(CASE)
    stored = json.loads(RESULT.read_text()) if RESULT.exists() else {"program": "CalculiX 2.20", "runs": []}
    stored["runs"] = [r for r in stored["runs"] if any(r[k] != v for k, v in settings.items())]
    stored["runs"].append(run(given.work, case, settings))
    RESULT.write_text(json.dumps(stored, indent=1) + "\n")


if __name__ == "__main__":
    main()

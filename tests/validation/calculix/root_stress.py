"""Root stress of a spur-gear pair at given transmission error, by CalculiX. See README.md.

The same model as `make_reference.py`, with the fillets of the loaded teeth as fine as wanted; CalculiX's own nodal
stresses, extrapolated from the integration points and averaged, are read at the nodes of the fillets.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path

import numpy as np
from deck import THICKNESS, elastic, read_reactions, run_deck, unknowns, write_deck
from make_reference import calculix_version
from placement import Setup, make_rig, meetings, setup, spots, touches
from planar_mesh import PlanarMesh, Spot, gear_mesh

HERE = Path(__file__).parent
WANTED = (("z20-40", 0.1, 21.1e-6), ("z62-62", -0.5, 5.0377e-6))  # single and double contact
SIZES = (0.03, 0.02)  # of the fillets' elements, in modules: twice, to see that they have converged
PENALTY = 4.0


def fillet_spots(position: Setup, gear: int, teeth: list[int], size: float) -> list[Spot]:
    """Elements of `size` modules along the working fillets."""
    shape = position.shapes[gear]
    module = 1e3 * shape.module
    out = []
    for tooth in teeth:
        matrix, centre = position.placed(gear, tooth)
        for beta in np.linspace(0.0, shape.beta_form, 9):
            out.append(Spot(centre + 1e3 * matrix @ shape.fillet(beta), size * module, 0.02 * module))
    return out


def root_nodes(position: Setup, gear: int, tooth: int, mesh: PlanarMesh) -> np.ndarray:
    """Nodes of the mesh on a tooth's working fillet."""
    shape = position.shapes[gear]
    matrix, centre = position.placed(gear, tooth)
    own = 1e-3 * (mesh.points - centre) @ matrix
    fine = shape.fillet(np.linspace(0.0, shape.beta_form, 20001))
    low, high = np.hypot(*fine[0]), np.hypot(*fine[-1])
    radius = np.hypot(*own.T)
    near = np.flatnonzero((own[:, 1] > 0) & (radius > low + 1e-7) & (radius < high) & (own[:, 0] > 0))
    at = np.column_stack([np.interp(radius[near], np.hypot(*fine.T), fine[:, n]) for n in (0, 1)])
    return near[np.hypot(*(own[near] - at).T) < 2e-7]


def read_stress(path: Path) -> dict[int, np.ndarray]:
    """In-plane stress xx, yy, xy [MPa] at every node, counted from 0, from the last step in the .frd file."""
    text = path.with_suffix(".frd").read_text()
    block = re.split(r"\n -4  STRESS[^\n]*\n", text)[-1].split("\n -3")[0]
    found = {}
    for line in block.splitlines():
        if line.startswith(" -1"):
            values = [float(line[13 + 12 * k : 25 + 12 * k]) for k in range(6)]
            found[int(line[3:13]) - 1] = np.array([values[0], values[1], values[3]])
    return found


def solve(rig_record: dict, phase: float, dte: float, size: float, work: Path) -> dict:
    """Largest principal stress [MPa] in each loaded fillet at DTE [m] and mesh phase [cycles], and where [mm]."""
    rig = make_rig(rig_record)
    position = setup(rig, phase, dte, rig_record["torque"])
    met = meetings(position)
    teeth = [m.tooth for m in met]
    meshes = tuple(
        gear_mesh(
            position.shapes[g],
            lambda j, g=g: position.placed(g, j),
            (-1, 1)[g],
            1e3 * position.gears[g].hub_radius,
            spots(position, g, met, 1.0) + fillet_spots(position, g, teeth, size),
            level=1.0,
        )
        for g in (0, 1)
    )
    arms = [m.points[m.hub] - c for m, c in zip(meshes, position.centres, strict=True)]
    turn = dte / position.shapes[0].base_radius
    motion = arms[0] @ np.array([[0.0, turn], [-turn, 0.0]])
    first = (0, len(meshes[0].points))
    hubs = tuple(dict(zip((m.hub + n).tolist(), a, strict=True)) for m, n, a in zip(meshes, first, arms, strict=True))
    work.mkdir(parents=True, exist_ok=True)
    path = work / "gears.inp"
    material = elastic(rig.material.youngs_modulus, rig.material.poisson, rig.material.state)
    write_deck(path, meshes, touches(met, meshes, 1.0), motion, material=material, penalties=(PENALTY,))
    path.write_text(path.read_text().replace("*END STEP", "*EL FILE, OUTPUT=2D\nS\n*END STEP"))
    log = run_deck(path)
    torque = read_reactions(path, hubs)[-1]
    stress = read_stress(path)
    found = []
    for g, name in ((0, "driver"), (1, "driven")):
        for tooth in teeth:
            nodes = root_nodes(position, g, tooth, meshes[g])
            values = np.array([stress[int(n) + first[g]] for n in nodes])
            largest = 0.5 * (values[:, 0] + values[:, 1]) + np.hypot(0.5 * (values[:, 0] - values[:, 1]), values[:, 2])
            i = int(np.argmax(largest))
            at = float(np.hypot(*(meshes[g].points[nodes[i]] - position.centres[g])))
            found.append({"gear": name, "tooth": tooth, "stress": float(largest[i]), "radius": at, "nodes": len(nodes)})
    scale = position.pair.face_width / THICKNESS
    return {
        "phase": phase,
        "dte": dte,
        "size": size,
        "torque_driver": torque.driver * scale,
        "torque_driven": torque.driven * scale,
        "roots": found,
        "unknowns": unknowns(log),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True, help="folder for decks and results of CalculiX")
    options = parser.parse_args()
    rigs = json.loads((HERE / "positions.json").read_text())["pairs"]
    record = {"provenance": {"calculix": calculix_version(), "penalty": PENALTY}, "positions": []}
    for name, phase, dte in WANTED:
        for size in SIZES:
            found = solve(rigs[name]["rig"], phase, dte, size, options.work / f"{name}_{size:g}")
            record["positions"].append({"pair": name, **found})
            print(name, json.dumps(found), flush=True)
    (HERE / "root_stress.json").write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())

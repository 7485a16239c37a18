"""Reference compliances of teeth with a root crack, by CalculiX. See README.md.

A whole gear, its hub circle held, carries a parabolic pressure on a short stretch of one working flank; the compliance
is the work-conjugate displacement over the force. The crack is a thin notch in the outline, open by a thousandth of its
length: no node is doubled. Only the tooth profile is ours.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from math import pi
from pathlib import Path

import numpy as np
from deck import elastic, lines, run_deck, unknowns
from make_reference import calculix_version
from numpy.typing import NDArray
from planar_mesh import Outline, PlanarMesh, Spot, circle, outline, second_order, size_field, straightened, triangulate

from gearbench.geometry.tooth.profile import Profile, profile
from gearbench.rig import Gear

Array = NDArray[np.float64]
HERE = Path(__file__).parent
THICKNESS = 0.1  # of the computed slab [mm]
OPENING = 5e-4  # half of the notch at its mouth, over its length
HALF_WIDTH = 0.1  # of the loaded stretch [modules]
GROWTH = 0.22

STEEL = {"youngs_modulus": 206e9, "poisson": 0.3}
CASES = {
    "z20": {
        "gear": {"teeth": 20, "module": 3e-3, "face_width": 0.02, "hub_radius": 0.02},
        "state": "plane-stress",
        "direction_deg": 60.0,
        "lengths": [0.6e-3, 1.5e-3, 2.7e-3],
    },
    "z38": {
        "gear": {"teeth": 38, "module": 2e-3, "profile_shift": 0.3, "face_width": 0.015, "hub_radius": 0.0295},
        "state": "plane-strain",
        "direction_deg": 40.0,
        "lengths": [0.5e-3, 1.2e-3, 2.0e-3],
    },
}
CONVERGENCE = [("z20", 1.5e-3, {"level": 0.6}), ("z38", 1.2e-3, {"level": 0.6}), ("z20", 1.5e-3, {"opening": 0.25})]


def start(shape: Profile) -> tuple[float, Array, Array]:
    """Fillet parameter, point [mm] and unit tangent towards the tip where that is at 30 degrees to the tooth's axis."""
    beta = np.linspace(0.0, shape.beta_form, 40001)
    points = 1e3 * shape.fillet(beta)
    tangent = np.gradient(points, beta, axis=0)
    angle = np.arctan2(-tangent[:, 1], tangent[:, 0])
    at = float(np.interp(-pi / 6, -angle[1:-1], beta[1:-1]))
    point = 1e3 * shape.fillet(np.array([at]))[0]
    return at, point, np.array([np.cos(pi / 6), -np.sin(pi / 6)])


def notched(rim: Outline, shape: Profile, direction: float, length: float, level: float, opening: float) -> Outline:
    """The outline with a notch in place of the corner next to where the crack starts (tooth 0, lengths in mm)."""
    beta, mouth, tangent = start(shape)
    k = int(np.argmin(np.hypot(*(rim.corners - mouth).T)))
    table = np.linspace(0.0, shape.beta_form, 20001)
    radius = 1e3 * np.hypot(*shape.fillet(table).T)

    def fillet_middle(corner: Array) -> Array:
        other = np.interp(np.hypot(*corner), radius, table)
        return 1e3 * shape.fillet(np.array([0.5 * (other + beta)]))[0]

    run = -np.array([np.cos(direction), np.sin(direction)])
    smallest = level * length / 100
    left = [0.0]
    while left[-1] < length:
        left.append(left[-1] + smallest + GROWTH * left[-1])
    left = np.array(left) * length / left[-1]  # distances from the tip
    wide = opening * length * np.sqrt(left / length)
    down = mouth + (length - left)[:, None] * run
    upper, lower = down + wide[:, None] * tangent, down - wide[:, None] * tangent
    notch = np.concatenate((upper[::-1], lower[1:]))
    corners = np.concatenate((rim.corners[:k], notch, rim.corners[k + 1 :]))
    before, after = fillet_middle(rim.corners[k - 1]), fillet_middle(rim.corners[(k + 1) % len(rim.corners)])
    mids = np.concatenate(
        (rim.mids[: k - 1], before[None], 0.5 * (notch[1:] + notch[:-1]), after[None], rim.mids[k + 1 :])
    )
    none = np.full(len(notch) - 1, rim.flank[k])
    return Outline(corners, mids, np.concatenate((rim.flank[:k], none, rim.flank[k:])))


def mesh(shape: Profile, hub: float, crack: tuple[float, float] | None, level: float, opening: float) -> PlanarMesh:
    """A whole gear [mm], cracked by (direction [rad], length [mm]) or sound."""
    centre = np.zeros(2)
    m = 1e3 * shape.module
    s0 = reference_arc(shape)
    spots = [Spot(1e3 * shape.points(np.array([s0]))[0], level * HALF_WIDTH * m / 8, 1.5 * HALF_WIDTH * m)]
    _, mouth, _ = start(shape)
    spots.append(Spot(mouth, 0.03 * level * m, 0.0))
    if crack:
        run = -np.array([np.cos(crack[0]), np.sin(crack[0])])
        spots[-1] = Spot(mouth, min(0.03 * m, 0.1 * crack[1]) * level, 0.0)
        spots += [Spot(mouth + crack[1] * run, level * crack[1] / 100, 0.0)]
        spots += [Spot(mouth + f * crack[1] * run, 0.12 * level * crack[1], 0.0) for f in (0.3, 0.6)]
    field = size_field(spots, centre, 1e3 * shape.root_radius, 0.3 * m * level, GROWTH)

    def placed(j: int) -> tuple[Array, Array]:
        c, s = np.cos(2 * pi * j / shape.teeth), np.sin(2 * pi * j / shape.teeth)
        return np.array([[c, -s], [s, c]]), centre

    rim = outline(shape, placed, 1, field)
    if crack:
        rim = notched(rim, shape, *crack, level, opening)
    inner = circle(centre, hub, int(np.ceil(2 * pi * hub / field(np.array([[hub, 0.0]]))[0])))
    points, triangles = triangulate([rim.corners, inner[0]], field)
    points, cells, nodes, sides = second_order(points, triangles, [(rim.corners, rim.mids), inner])
    points = straightened(points, cells, spots)
    return PlanarMesh(points, cells, nodes[1], {0: sides[0][rim.flank == 0]})


def reference_arc(shape: Profile) -> float:
    """Arc length of the flank at the reference circle [m]."""
    return (shape.reference_radius**2 - shape.base_radius**2) / (2 * shape.base_radius)


def nodal_forces(shape: Profile, made: PlanarMesh) -> dict[int, Array]:
    """Forces [N] of a parabolic pressure with a resultant of 1 N per mm along the flank's normals, in mm and N/mm."""
    s0, half = 1e3 * reference_arc(shape), HALF_WIDTH * 1e3 * shape.module
    rb = 1e3 * shape.base_radius
    xi, weight = np.polynomial.legendre.leggauss(30)
    xi, weight = (xi + 1) / 2, weight / 2
    values = np.stack([(1 - xi) * (1 - 2 * xi), xi * (2 * xi - 1), 4 * xi * (1 - xi)])
    slopes = np.stack([4 * xi - 3, 4 * xi - 1, 4 - 8 * xi])
    out: dict[int, Array] = {}
    for cell, side in made.flank[0].tolist():
        nodes = made.triangles[cell][[side, (side + 1) % 3, 3 + side]]
        s = (np.sum(made.points[nodes] ** 2, axis=1) - rb**2) / (2 * rb)
        if s.min() > s0 + half or s.max() < s0 - half:
            continue
        at = values.T @ s
        pressure = np.maximum(0.75 / half * (1 - ((at - s0) / half) ** 2), 0.0)
        length = np.abs(slopes.T @ s)
        for node, shape_function in zip(nodes.tolist(), values, strict=True):
            push = (shape_function * pressure * length * weight) @ -shape.normals(1e-3 * at)
            out[node] = out.get(node, np.zeros(2)) + push
    return out


def solve(case: dict, length: float, work: Path, *, level: float = 1.0, opening: float = 1.0) -> dict:
    """Compliance [m per N/m] of the loaded stretch, the tooth being sound for a length of 0."""
    gear = Gear(**case["gear"])
    shape = profile(gear)
    crack = (np.deg2rad(case["direction_deg"]), 1e3 * length) if length else None
    made = mesh(shape, 1e3 * gear.hub_radius, crack, level, opening * OPENING)
    forces = nodal_forces(shape, made)
    modulus, poisson = elastic(STEEL["youngs_modulus"], STEEL["poisson"], case["state"])
    text = ["*NODE, NSET=NALL"]
    text += [f"{i + 1}, {x:.12g}, {y:.12g}, 0." for i, (x, y) in enumerate(made.points.tolist())]
    text += ["*ELEMENT, TYPE=CPE6, ELSET=EALL", lines(made.triangles + 1, 1)]
    text += ["*NSET, NSET=HUB", ",\n".join(str(i + 1) for i in made.hub)]
    text += ["*NSET, NSET=FLANK", ",\n".join(str(i + 1) for i in forces)]
    text += ["*MATERIAL, NAME=STEEL", "*ELASTIC", f"{modulus:.12g}, {poisson:.12g}"]
    text += ["*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL", f"{THICKNESS:g}", "*STEP", "*STATIC"]
    text += ["*BOUNDARY", "HUB, 1, 2", "*CLOAD"]
    scale = 1e3 * THICKNESS  # 1000 N per mm of width: displacements of some micrometres
    text += [f"{i + 1}, {c + 1}, {scale * f[c]:.12g}" for i, f in forces.items() for c in (0, 1)]
    text += ["*NODE PRINT, NSET=FLANK", "U", "*END STEP", ""]
    work.mkdir(parents=True, exist_ok=True)
    path = work / "tooth.inp"
    path.write_text("\n".join(text))
    log = run_deck(path)
    rows = [line.split() for line in path.with_suffix(".dat").read_text().splitlines() if re.match(r"\s+\d+\s", line)]
    moved = {int(row[0]) - 1: np.array(row[1:3], dtype=float) for row in rows}
    resultant = float(np.hypot(*sum(forces.values())))
    compliance = sum(float(f @ moved[i]) for i, f in forces.items()) / 1e3  # mm per N/mm
    return {
        "length": length,
        "compliance": 1e-6 * compliance,
        "resultant": resultant,
        "unknowns": unknowns(log),
        "level": level,
        "opening": opening * OPENING,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True, help="folder for decks and results of CalculiX")
    options = parser.parse_args()
    target = HERE / "crack_reference.json"
    record = json.loads(target.read_text()) if target.exists() else {"cases": {}}
    record["provenance"] = {"calculix": calculix_version(), "numpy": np.__version__}
    wanted = [(name, length, {}) for name, case in CASES.items() for length in (0.0, *case["lengths"])]
    wanted += [(name, 0.0, {"level": 0.6}) for name in CASES] + CONVERGENCE
    for name, length, how in wanted:
        case = CASES[name]
        kept = record["cases"].setdefault(name, {"results": []})
        kept.update(case, half_width=HALF_WIDTH * case["gear"]["module"], material=STEEL)
        asked = {"level": 1.0, "opening": 1.0, **how}
        same = {"length": length, "level": asked["level"], "opening": asked["opening"] * OPENING}
        if any(all(found[key] == value for key, value in same.items()) for found in kept["results"]):
            continue
        found = solve(case, length, options.work / f"{name}_{len(kept['results'])}", **how)
        kept["results"].append(found)
        partial = target.with_suffix(".part")
        partial.write_text(json.dumps(record, indent=1) + "\n")
        partial.replace(target)
        print(name, found, flush=True)


if __name__ == "__main__":
    sys.exit(main())

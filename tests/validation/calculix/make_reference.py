"""Reference torques of spur-gear pairs at given transmission error, by CalculiX. See README.md."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from deck import THICKNESS, elastic, read_reactions, run_deck, unknowns, write_deck
from placement import make_rig, meetings, setup, spots, tip_distance, touches
from planar_mesh import gear_mesh, rotation

HERE = Path(__file__).parent
PENALTIES = (1.0, 4.0)


def solve(rig_record: dict, phase: float, dte: float, work: Path, *, level: float = 1.0, **options) -> dict:
    """One position: driver and driven torque [N m] at DTE [m] and mesh phase [cycles], and what they took.

    The torques are extrapolated to an infinite penalty, in whose reciprocal they are linear.
    """
    start = time.perf_counter()
    penalties = options.pop("penalties", PENALTIES)
    rig = make_rig(rig_record)
    position = setup(rig, phase, dte, rig_record["torque"])
    met = meetings(position)
    meshes = tuple(
        gear_mesh(
            position.shapes[g],
            lambda j, g=g: position.placed(g, j),
            (-1, 1)[g],
            1e3 * position.gears[g].hub_radius,
            spots(position, g, met, level),
            level=level,
        )
        for g in (0, 1)
    )
    nlgeom = options.get("nlgeom", False)
    arms = [m.points[m.hub] - c for m, c in zip(meshes, position.centres, strict=True)]
    turn = dte / position.shapes[0].base_radius
    # A linear analysis writes equilibrium where the hub was, a non-linear one where it is.
    motion = arms[0] @ ((rotation(turn).T - np.eye(2)) if nlgeom else np.array([[0.0, turn], [-turn, 0.0]]))
    first = (0, len(meshes[0].points))
    acting = (arms[0] + motion if nlgeom else arms[0], arms[1])
    hubs = tuple(dict(zip((m.hub + n).tolist(), a, strict=True)) for m, n, a in zip(meshes, first, acting, strict=True))
    work.mkdir(parents=True, exist_ok=True)
    path = work / "gears.inp"
    state = options.pop("state", rig.material.state)
    material = elastic(rig.material.youngs_modulus, rig.material.poisson, state)
    thickness = options.get("thickness", THICKNESS)
    touching = touches(met, meshes, level)
    write_deck(path, meshes, touching, motion, material=material, penalties=penalties, **options | {"nlgeom": nlgeom})
    meshed = time.perf_counter()
    log = run_deck(path)
    found = read_reactions(path, hubs)
    if len(found) != len(penalties):
        raise RuntimeError(f"{len(found)} of {len(penalties)} steps converged in {work}")
    scale = position.pair.face_width / thickness  # N mm per mm to N m
    t1, t2 = (np.array([getattr(r, name) for r in found]) * scale for name in ("driver", "driven"))
    return {
        "phase": phase,
        "dte": dte,
        "torque_driver": limit(penalties, t1),
        "torque_driven": limit(penalties, t2),
        "torque_driver_at_penalty": t1.tolist(),
        "penalty": list(penalties),
        "force_residual": float(np.abs(found[-1].force).max() * scale * 1e3),
        "teeth": [m.tooth for m in met],
        "gaps": [m.gap for m in met],
        "tip_corner": bool(any(tip_distance(m) < 0 and m.gap < dte for m in met)),
        "undercut_corner": bool(any(m.corner >= 0 and m.gap < dte for m in met)),
        "element_mm": [t.size for t in touching],
        "level": level,
        "nlgeom": nlgeom,
        "unknowns": unknowns(log),
        "seconds_mesh": round(meshed - start, 1),
        "seconds_ccx": round(time.perf_counter() - meshed, 1),
    }


def limit(penalties: Sequence[float], values: np.ndarray) -> float:
    """Value at an infinite penalty from the two largest penalties."""
    if len(penalties) == 1:
        return float(values[-1])
    soft, stiff = 1 / penalties[-2], 1 / penalties[-1]
    return float(values[-1] + (values[-1] - values[-2]) * stiff / (soft - stiff))


def calculix_version() -> str:
    return subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout.strip()


def store(record: dict) -> None:
    partial = HERE / "reference.json.part"
    partial.write_text(json.dumps(record, indent=1) + "\n")
    partial.replace(HERE / "reference.json")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True, help="folder for decks and results of CalculiX")
    parser.add_argument("--pairs", nargs="*", help="names of the pairs; absent: all")
    parser.add_argument("--convergence", action="store_true", help="the convergence study instead of the positions")
    options = parser.parse_args()
    plan = json.loads((HERE / "positions.json").read_text())
    target = HERE / "reference.json"
    record = json.loads(target.read_text()) if target.exists() else {"pairs": {}}
    record["provenance"] = {"calculix": calculix_version(), "numpy": np.__version__, **plan["provenance"]}
    for name, case in plan["pairs"].items():
        if options.pairs and name not in options.pairs:
            continue
        kept = record["pairs"].setdefault(name, {"positions": [], "convergence": []})
        kept["rig"] = case["rig"]
        key = "convergence" if options.convergence else "positions"
        for wanted in case[key]:
            same = [p for p in kept[key] if all(p.get(k) == v for k, v in wanted.items())]
            if same:
                continue
            folder = options.work / f"{name}_{len(kept[key])}_{key}"
            asked = dict(wanted)
            found = solve(case["rig"], asked.pop("phase"), asked.pop("dte"), folder, **asked)
            kept[key].append(wanted | found)
            store(record)
            text = f"{name} {key[:8]} phase {found['phase']:+.4f} dte {found['dte'] * 1e6:.4f} um"
            print(
                text,
                f"T1 {found['torque_driver']:.4f} T2 {found['torque_driven']:.4f} N m",
                wanted,
                flush=True,
            )


if __name__ == "__main__":
    sys.exit(main())

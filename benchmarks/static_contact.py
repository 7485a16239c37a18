"""How long static contact takes: gears, one load, a Harris map; beside one position by CalculiX in the same run.

    OMP_NUM_THREADS=1 python benchmarks/static_contact.py [--skip-calculix]

Medians of five runs, of three for what is not cached; one core. Our gears are those of paper_fe, the CalculiX
position is one of tests/validation/calculix, timed once, and the same position is timed with our law. Needs `ccx`
(Debian: apt-get install calculix-ccx); without it that part is left out.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from gearbench.bench.elastic.rig import elastic_rig
from gearbench.cases import case_path
from gearbench.fem.contact.law import Law, elastic_pair, make_law
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.gear.store import stored_gear
from gearbench.rig import Case, Gear, Material, Rig, Support, Supports, read_case

CALCULIX = Path(__file__).resolve().parents[1] / "tests" / "validation" / "calculix"
PAIR, PHASE = "z20-40", -0.5  # two pairs in contact, neither at a corner
LOADS = np.linspace(10.0, 400.0, 12)  # of the Harris map [N m]


Spent = tuple[float, float]  # wall and processor time [s]


def median(job: Callable[[], object], repeats: int = 5) -> Spent:
    """Median times; on a machine with other work to do the processor time is the better one."""
    spent = []
    for _ in range(repeats):
        began = time.perf_counter(), time.process_time()
        job()
        spent.append((time.perf_counter() - began[0], time.process_time() - began[1]))
    wall, busy = np.median(spent, axis=0)
    return float(wall), float(busy)


def both_gears(case: Case) -> None:
    """Condensed gears, from the cache folder in use or into it."""
    for gear in (case.rig.driver, case.rig.driven):
        stored_gear(gear, case.rig.material)


def uncached(case: Case) -> None:
    """The same with an empty cache folder for each gear, so that equal gears do not help one another."""
    for gear in (case.rig.driver, case.rig.driven):
        with tempfile.TemporaryDirectory() as folder:
            os.environ["GEARBENCH_CACHE"] = folder
            stored_gear(gear, case.rig.material)


def stored_position() -> tuple[dict, dict]:
    """Rig and reference of the position that CalculiX computes."""
    kept = json.loads((CALCULIX / "reference.json").read_text(encoding="utf-8"))["pairs"][PAIR]
    return kept["rig"], next(p for p in kept["positions"] if p["phase"] == PHASE)


def our_law(record: dict) -> Law:
    """Contact law of the stored pair."""
    idle = Support(stiffness=1e8)
    rig = Rig(
        centre_distance=record["centre_distance"],
        driver=Gear(**record["driver"]),
        driven=Gear(**record["driven"]),
        material=Material(**record["material"]),
        support=Supports(driver=idle, driven=idle),
    )
    gears = [stored_gear(gear, rig.material) for gear in (rig.driver, rig.driven)]
    return make_law(elastic_pair(rig), *gears, rig.material)


def calculix(record: dict, position: dict) -> tuple[Spent, float]:
    """Times and driver torque [N m] of the position by CalculiX, with the script of the reference."""
    sys.path.insert(0, str(CALCULIX))
    from make_reference import solve

    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter(), sum(os.times()[:4])
        found = solve(record, PHASE, position["dte"], Path(folder), nlgeom=position["nlgeom"])
        return (time.perf_counter() - began[0], sum(os.times()[:4]) - began[1]), found["torque_driver"]


def row(name: str, spent: Spent, reach: float | None = None) -> None:
    """One line."""
    text = f"{name:58} {spent[0]:10.3g} {spent[1]:10.3g}"
    print(text + (f"{reach:8g}" if reach else ""), flush=True)


def main() -> None:
    """Print one line for each part."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--skip-calculix", action="store_true", help="leave the CalculiX position out")
    options = parser.parse_args()
    case = read_case(case_path("paper_fe"))
    print(f"{'seconds':58} {'wall':>10} {'processor':>10}{'reach':>8}")
    row("mesh and condensation of both default gears", median(lambda: uncached(case), 3), 4.0)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["GEARBENCH_CACHE"] = folder
        both_gears(case)
        row("the same from the cache", median(lambda: both_gears(case)), 0.2)
        law = elastic_rig(case.rig, case.simulation).law
        phases = np.arange(64) / 64
        static_cycle(law, phases[:1], torque=[100.0])
        one = median(lambda: static_cycle(law, phases, torque=[100.0]))
        row("64 positions at one load", one, 0.3)
        row(
            "Harris map, 64 positions x 12 loads", median(lambda: static_cycle(law, phases, torque=LOADS.tolist())), 3.0
        )
        record, position = stored_position()
        ours = our_law(record)
        at, dte = np.array([PHASE]), [position["dte"]]
        single = median(lambda: static_cycle(ours, at, dte=dte), 101)
        row(f"one position of {PAIR} at phase {PHASE:g}, after condensation", single)
        if options.skip_calculix or shutil.which("ccx") is None:
            print("CalculiX left out: no `ccx` on the path or not wanted")
            return
        spent, torque = calculix(record, position)
        row("the same by CalculiX", spent)
        mine = float(static_cycle(ours, at, dte=dte).torque_driver.item())
        print(
            f"ratio {spent[1] / single[1]:.3g} of processor times; torque differs by {100 * (mine / torque - 1):+.3f} %"
        )


if __name__ == "__main__":
    main()

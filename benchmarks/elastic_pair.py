"""How long the elastic pair of paper_fe takes: condensation, contact lines, static cycle, time loop; one core.

    python benchmarks/elastic_pair.py

Medians of three runs. The time loop is put in relation to the rig time it covers, so that machines can be compared.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from gearbench.bench.elastic.rig import elastic_rig, machine_for
from gearbench.cases import case_path
from gearbench.fem.contact.law import make_law
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.gear.body import condense
from gearbench.fem.motion.scheme import make_scheme
from gearbench.fem.motion.start import initial_state
from gearbench.fem.motion.transient import advance
from gearbench.rig import read_case


def median(job: Callable[[], object], repeats: int = 3) -> float:
    """Median wall time [s]."""
    spent = []
    for _ in range(repeats):
        began = time.perf_counter()
        job()
        spent.append(time.perf_counter() - began)
    return float(np.median(spent))


def main() -> None:
    """Print one line for each part."""
    case = read_case(case_path("paper_fe"))
    rig = case.rig
    elastic = elastic_rig(rig, case.simulation)
    phases = np.arange(64) / 64
    static_cycle(elastic.law, phases[:1], torque=[100.0])
    machine = machine_for(elastic, 2.0)
    start = initial_state(machine, 2.0)
    scheme = make_scheme(1 / 65536, 0.9)
    torque = np.full(65536, 2.0)
    advance(machine, scheme, start, torque[:64], 8)
    rows = [
        ("mesh and condensation of both gears", lambda: [condense(g, rig.material) for g in (rig.driver, rig.driven)]),
        ("contact lines of the pair", lambda: make_law(elastic.pair, *elastic.gears, rig.material)),
        ("static cycle, 64 positions", lambda: static_cycle(elastic.law, phases, torque=[100.0])),
        ("1 s of rig time, 65 536 steps", lambda: advance(machine, scheme, start, torque, 8)),
    ]
    for name, job in rows:
        print(f"{name:40} {median(job):8.3f} s")


if __name__ == "__main__":
    main()

"""The unreduced rig beside the reduced one on paper_fe: cost of a step, and how far apart their DTE are.

    python benchmarks/full_model.py [FOLDER]

runs the two comparisons of `gearbench validate --only full` and draws them to FOLDER/full_against_reduced.png.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from gearbench.bench.elastic.rig import elastic_rig, machine_for
from gearbench.bench.full.run import full_gears, full_machine
from gearbench.cases import case_path
from gearbench.fem.full import record, start
from gearbench.fem.full.transient import make_integrator
from gearbench.fem.motion import transient as reduced
from gearbench.fem.motion.transient import make_scheme
from gearbench.rig import read_case

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from shared.full_runs import SideBySide
from validation.rows_full import fast, paper


def costs(element_size_um: float) -> None:
    """Print what a step of both models of paper_fe takes with that element size on the flanks."""
    case = read_case(case_path("paper_fe"), [f"simulation.element_size_um={element_size_um:g}"])
    elastic = elastic_rig(case.rig, case.simulation)
    scheme, torque = make_scheme(1 / 65536, 0.9), np.full(20, 2.0)
    began = time.process_time()
    machine = full_machine(elastic, full_gears(case.rig, case.simulation, lambda note: None), 2.0)
    integrator = make_integrator(machine, scheme)
    prepared = time.process_time() - began
    state = start.initial_state(machine, 2.0)
    state = record.advance(integrator, state, torque[:2]).state
    began = time.process_time()
    record.advance(integrator, state, torque)
    step = (time.process_time() - began) / len(torque)
    small = machine_for(elastic, 2.0)
    begin = reduced.initial_state(small, 2.0)
    many = np.full(4000, 2.0)
    reduced.advance(small, scheme, begin, many[:8], 1)
    began = time.process_time()
    reduced.advance(small, scheme, begin, many, 1)
    other = (time.process_time() - began) / len(many)
    print(
        f"elements of {element_size_um:g} um: {machine.unknowns} unknowns, prepared in {prepared:.1f} s,"
        f" {1e3 * step:.0f} ms a step, reduced {1e6 * other:.0f} us, ratio {step / other:.0f} (processor time)"
    )


def draw(path: Path, runs: dict[str, SideBySide]) -> None:
    """Both models' DTE and, below, their difference."""
    figure, axes = plt.subplots(2, len(runs), figsize=(11, 6), sharex="col", squeeze=False)
    for (title, run), (above, below) in zip(runs.items(), axes.T, strict=True):
        t = 1e3 * run.time
        above.plot(t, 1e6 * run.full, color="0.2", lw=1.2, label="full")
        above.plot(t, 1e6 * run.reduced, "--", color="tab:orange", lw=1.0, label="reduced")
        below.plot(t, 1e9 * (run.full - run.reduced), color="0.2", lw=0.8)
        apart = run.full_loaded == 0
        if apart.any():
            above.fill_between(t, 0, 1, where=apart, transform=above.get_xaxis_transform(), alpha=0.2, label="apart")
        above.set_title(f"{title}: {run.difference(3000.0):.2%} rms up to 3 kHz")
        above.set_ylabel("DTE [um]")
        below.set_ylabel("full - reduced [nm]")
        below.set_xlabel("time [ms]")
        above.legend(loc="upper right")
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main() -> None:
    """Costs first, then the comparisons."""
    for size in (1000.0, 500.0):
        costs(size)
    runs = {"paper_fe, mesh at 64 Hz": paper(), "20/20 teeth, 5100 rpm": fast()}
    for title, run in runs.items():
        print(f"{title}: {run.difference(3000.0):.3%} rms up to 3 kHz, {run.difference(np.inf):.3%} in all")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    draw(folder / "full_against_reduced.png", runs)


if __name__ == "__main__":
    main()

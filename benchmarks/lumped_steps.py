"""How long the compiled Runge-Kutta takes: paper_lumped with four steps a sample, one core.

    python benchmarks/lumped_steps.py [realisations]

All 100 realisations of four periods of 2^17 samples are 210 million steps; the time of fewer is scaled up.
"""

from __future__ import annotations

import sys
import time

from gearbench.bench.linear.run import tables_for
from gearbench.bench.plan.excitation import torque_realisation
from gearbench.bench.plan.schedule import schedule
from gearbench.cases import case_path
from gearbench.geometry import pair
from gearbench.lumped import lumped_model
from gearbench.lumped.linear.runge_kutta import integrate
from gearbench.rig import read_case

SUBSTEPS = 4


def main(realisations: int) -> None:
    """Integrate `realisations` of the case and print seconds and nanoseconds per step."""
    case = read_case(case_path("paper_lumped"))
    plan = schedule(case.experiment, case.rig)
    meshing = pair(case.rig)
    model = lumped_model(case.rig, meshing, case.simulation)
    tables = tables_for(model, plan, SUBSTEPS)
    torque = torque_realisation(case.experiment, 0, case.rig)
    force = torque.sample(2 * SUBSTEPS * plan.samples_per_period) / meshing.driver.base_radius
    state = model.equilibrium(float(force.mean()))
    integrate(tables, force, state, samples=1, substeps=SUBSTEPS)  # compiles
    began = time.perf_counter()
    for _ in range(realisations * case.experiment.periods):
        state, _ = integrate(tables, force, state, samples=plan.samples_per_period, substeps=SUBSTEPS)
    elapsed = time.perf_counter() - began
    steps = realisations * case.experiment.periods * plan.samples_per_period * SUBSTEPS
    whole = case.experiment.realisations / realisations
    print(f"{steps:.3g} steps in {elapsed:.2f} s: {elapsed / steps * 1e9:.1f} ns a step,")
    print(f"{elapsed * whole:.1f} s for the {steps * whole:.3g} steps of the case (reach: 40 s)")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)

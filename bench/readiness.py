"""What `mesh`, `static` and `simulate` would refuse of a case, found before anything is meshed or solved."""

from __future__ import annotations

from gearbench.bench.models import model_for
from gearbench.bench.plan.excitation import comb_for, coset_modulus
from gearbench.bench.plan.schedule import schedule
from gearbench.bench.refusals.gears import check_gears
from gearbench.geometry.mesh.element_size import flank_size
from gearbench.rig import Case


def check_model(case: Case) -> None:
    """Raise BenchError or GeometryError for what the case's model does not represent or cannot mesh, and for a mean
    torque beyond the loads that it knows."""
    for gear in (case.rig.driver, case.rig.driven):
        flank_size(gear.module, case.simulation.element_size)
    for experiment in experiments_of(case):
        chosen, model = model_for(experiment)
        model.refuse(chosen)


def check_timing(case: Case) -> None:
    """Raise BenchError if one of the case's experiments cannot be timed; a case may have none."""
    if not case.stated:
        return
    for experiment in experiments_of(case):
        schedule(experiment.experiment, experiment.rig)
        comb_for(experiment.experiment, experiment.rig)
        coset_modulus(experiment.experiment, experiment.rig)


def experiments_of(case: Case) -> list[Case]:
    """The case under each of its conditions, or the case itself."""
    return [case.under(condition) for condition in case.conditions] or [case]


def check_case(case: Case) -> None:
    """Raise what the commands that take this case would raise, one sentence, as far as that needs no solution."""
    check_gears(case.rig)
    check_model(case)
    check_timing(case)

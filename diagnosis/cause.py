"""Which unmodelled effects cause the gap: search by forces, decision by simulation, and the rigs that follow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from gearbench.diagnosis.advice import PARTED
from gearbench.diagnosis.effects.recalibrated import recalibrated
from gearbench.diagnosis.evidence.decision import decide, likeliest_fit
from gearbench.diagnosis.evidence.problem import problem_of
from gearbench.diagnosis.evidence.search import missing_by_equation, search
from gearbench.diagnosis.evidence.separable import alike, representatives
from gearbench.diagnosis.finding import Finding
from gearbench.diagnosis.forces.steadiness import least_unsteadiness
from gearbench.diagnosis.found_by_forces import by_forces_alone, fitted, left_of, places_by_forces
from gearbench.diagnosis.found_by_simulation import Searched, by_simulation
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.judging.decided import unexplained
from gearbench.diagnosis.odds import Calibration
from gearbench.diagnosis.population import POPULATION
from gearbench.diagnosis.remainder.repeating import repeating
from gearbench.diagnosis.replay.replays import COARSER, Replays
from gearbench.diagnosis.selection.simulated import carried, simulated
from gearbench.rig import Case

Report = Callable[[str], None]


def find_cause(
    measurements: Sequence[Measurement],
    nominal: Case,
    *,
    held_out: Measurement | None = None,
    without: Sequence[str] = (),
    report: Report = lambda step: None,
    known: Calibration = POPULATION,
) -> Finding:
    """The cause of the gap between the measurements and the nominal case.

    `without` leaves effects out of the library; `known` is what the decision rests on. Raises DiagnosisError for
    measurements that cannot be used.
    """
    problem = problem_of(measurements, nominal)
    result = search(problem, without, report)
    fit = likeliest_fit(result)
    simulate = Replays(problem.model.sound, COARSER)
    judged = held_out if held_out is not None and held_out.phase_known else None
    found = simulated(problem, result, measurements, nominal, simulate, without, report, judged=judged)
    report("steadiness")
    band, steady = problem.conditions[0].band, repeating(measurements, found)
    rigs = [fit.p]
    if found is not None:
        rigs.append(carried(found.layout.unknowns, found.selection.best.p, problem.unknowns))
    unsteady = least_unsteadiness(problem.model, steady, problem.unknowns, rigs, band)
    common: dict[str, Any] = {
        "indistinguishable": alike(fit, problem.unknowns, representatives(problem, without)),
        "evidence": {one.hypothesis.name: one.log_bayes_factor for one in result.tried},
    }
    if found is None:
        silent = missing_by_equation(problem, fit)
        common["where"] = places_by_forces(problem, result.base)
        common["audits"] = {"silent": tuple(silent), "unsteady": tuple(unsteady.excess)}
        decision, plain = decide(result, silent, unsteady), recalibrated(nominal, fitted(problem, result.base))
        if all(one.phase_known for one in measurements):
            common["advice"] = (PARTED,)
            decision = unexplained(decision, silent, left_of(nominal, plain, judged or measurements[0], simulate))
        return by_forces_alone(problem, nominal, plain, result, decision, known, common)
    report("judging")
    searched = Searched(problem, nominal, tuple(measurements), result, fit, steady, unsteady, tuple(without))
    return by_simulation(searched, found, held_out, known, common, report)

"""What planned records tell of the unknowns, about the nominal rig."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gearbench.diagnosis.detection.information import Blocks, Known
from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.fitting.background import prior_of
from gearbench.diagnosis.fitting.fit import sensitivity_of
from gearbench.diagnosis.planning.planned import Planned
from gearbench.diagnosis.simulation.quadratic import quadratic_of


def known_of(plan: Planned) -> Known:
    """Derivatives of all planned records at the nominal rig. Raises DiagnosisError where it cannot be simulated."""
    simulator = plan.simulator(plan.fitted, plan.conditions)
    unknowns = plan.layout.unknowns
    nothing = np.zeros(unknowns.size)
    found = sensitivity_of(simulator, nothing, unknowns.prior())
    one, condition = plan.judged
    # Ripple has unknowns for each condition of the search; the judged record's is like that of the first of them, whose
    # name it takes.
    alike = replace(one, name=plan.fitted[0].name)
    other = plan.simulator([alike], [condition])
    here, jacobian = other.lines(nothing), other.jacobian(nothing, unknowns.prior(), np.ones(unknowns.size, dtype=bool))
    if found is None or here is None or jacobian is None:
        raise DiagnosisError(
            "the nominal rig does not settle under the planned conditions: nothing can be told of them"
        )
    active = found.quadratic.active
    judged = quadratic_of(other.target, other.target.lines - here, jacobian, active)
    apart = not simulator.target.has(plan.judged[0])
    narrow = prior_of(simulator, unknowns.prior())
    return Known(unknowns, active, narrow, Blocks(found.quadratic), Blocks(judged), apart)

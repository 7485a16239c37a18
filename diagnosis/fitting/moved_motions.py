"""Motions of a housing that a fit lacks, or has where they are not: a fit walks to none that it does not feel, and not
from one resonance to another. What each would add, to first order, is compared without a simulation (`hidden_housing`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import SIDES
from gearbench.diagnosis.fitting.closeness import is_close
from gearbench.diagnosis.fitting.fit import Optimum, fit_afresh
from gearbench.diagnosis.fitting.hidden_housing import with_hidden_motions
from gearbench.diagnosis.fitting.rotation import but_rotation, with_rotation
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.structure.structure import HOUSING, LEAST_STEP, OBLIQUE

Array = NDArray[np.float64]
Report = Callable[[str], None]

RENEWALS, RENEWALS_WITHOUT = 4, 1
WORTH = 3.0  # nats that a motion must explain to first order, or in place of another by its fit
ROUNDS = 3  # motions that are added or moved
FEW = LEAST_STEP[HOUSING]  # compliance up to which a motion is none


def with_motions_moved(simulator: Simulator, found: Optimum, report: Report = lambda step: None) -> Optimum:
    """The optimum, or one of more evidence with motions of a housing that it lacks, or with the weaker one elsewhere;
    where it is not close to the records also with the other."""
    unknowns = simulator.layout.unknowns
    if HOUSING not in unknowns.slices or not simulator.target.excited.any():
        return found
    for _ in range(ROUNDS):
        sizes = found.p[unknowns[HOUSING]]
        weaker, other = (int(number) for number in np.argsort(sizes))
        # What is plain to see is where it is; where there is none, either is the first one.
        alone = sizes[other] <= FEW or is_close(simulator, found)
        for number in (weaker,) if alone else (weaker, other):
            report("simulating: motions of a housing")
            again = _moved(simulator, found, number)
            if again is not None and again.evidence > found.evidence + WORTH:
                found = again
                break
        else:
            break
    return found


def _moved(simulator: Simulator, found: Optimum, number: int) -> Optimum | None:
    """The fit with that motion where it explains most of what is left without it; None where that is next to nothing,
    or where the lines that answer the excitation are no closer with it: the rotation's, which teeth move one by one,
    wait for that."""
    unknowns, chosen = simulator.layout.unknowns, but_rotation(simulator.layout.unknowns, found.sd)
    p, sd, at = found.p.copy(), found.sd, unknowns[HOUSING].start + number
    had, across = p[at], unknowns[OBLIQUE].start + len(SIDES) * number
    p[at], p[across : across + 2] = 0.0, 0.0
    if had > FEW:
        held = np.where(np.arange(p.size) == at, 0.0, sd)
        without = fit_afresh(simulator, p, held, renewals=RENEWALS_WITHOUT, chosen=chosen)
        p = without.p if without is not None else p
    seen = with_hidden_motions(simulator, p, sd, number)
    if not seen or seen[0][0] < WORTH:
        return None
    part = fit_afresh(simulator, seen[0][1], sd, renewals=RENEWALS, chosen=chosen)
    return with_rotation(simulator, found, part) if part is not None else None

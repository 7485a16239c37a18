"""What impacts make of a gap by chance: rigs that differ by next to nothing go ways of their own after each.

Where flanks part, a part of the gap may be smaller with an effect because one impact was met otherwise. Rigs drawn next
to the one found, and to the one without the effect, show how far that goes: a part that is far closer in all of the
former than in any of the latter is closer by the effect.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.fitting.fit import Optimum
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.judging.closing import GAIN, PLAIN, growths_of
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import Target

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

DRAWN = 4  # rigs close to each
CLOSE = 0.1  # standard deviations by which they differ, as the records tell all numbers together


def closes_in_all(
    found: Simulated, target: Target, measured: Measurement, without: Sequence[Optimum]
) -> bool:
    """Whether some part of the gap of a record is far closer, and the record likelier, in all rigs next to the one
    found than in all next to each of those `without` an effect, as they go by themselves."""
    try:
        kept = _left(found, target, measured, found.selection.best)
        return all(_closer(target, _left(found, target, measured, one), kept) for one in without)
    except ValueError:  # a rig so close that cannot be simulated: nothing is told by others
        return False


def _closer(target: Target, lost: Sequence[Complex], kept: Sequence[Complex]) -> bool:
    """The same for residuals (K,) of rigs without and with it."""
    if min(target.cost(one) for one in lost) - max(target.cost(one) for one in kept) <= GAIN:
        return False
    grown = [growths_of(target, target.energies(one), target.energies(other)) for one in lost for other in kept]
    parts = set(grown[0]).intersection(*grown[1:])
    return any(min(one[part] for one in grown) > PLAIN for part in parts)


def _left(found: Simulated, target: Target, measured: Measurement, optimum: Optimum) -> list[Complex]:
    """Residuals (K,) of rigs drawn next to an optimum."""
    free = found.simulator.free
    drawn = _drawn(free, found.end_of(optimum), optimum)
    return [target.lines - target.gathered([free.channels(p, measured)]) for p in drawn]


def _drawn(free: Simulator, p: Array, optimum: Optimum) -> list[Array]:
    """Unknowns (size,) next to `p` (size,), always the same, by the uncertainty of an optimum."""
    near = optimum.sensitivity.quadratic
    steps = near.drawn(optimum.sd, np.random.default_rng(0).standard_normal((DRAWN, len(near.active))))
    out = []
    for step in steps:
        there = p.copy()
        there[near.active] += CLOSE * step
        out.append(np.clip(there, *free.layout.unknowns.bounds()))
    return out

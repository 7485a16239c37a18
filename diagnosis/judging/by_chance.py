"""What impacts make of a gap by chance: rigs that differ by next to nothing go ways of their own after each.

Where flanks part, a part of the gap may be smaller with an effect because one impact was met otherwise. Rigs drawn next
to the one found, and to the one without the effect, show how far that goes: a part that is far closer in all of the
former than in any of the latter is closer by the effect.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.fitting.fit import Optimum
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.judging.closing import GAIN, PLAIN, Part, growths_of, left_by, parts_of
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import Target

Array = NDArray[np.float64]

DRAWN = 4  # rigs close to each
CLOSE = 0.1  # standard deviations by which they differ, as the records tell all numbers together


def closed_in_all(
    found: Simulated, target: Target, measured: Measurement, without: Sequence[Optimum], parts: Collection[Part]
) -> tuple[Part, float] | None:
    """Of `parts` of the gap of a record the one that is far closer, and likelier, in all rigs next to the one found
    than in all next to each of those `without` an effect, as they go by themselves, and by how much at least; of
    several the one that is so by most, None without any."""
    try:
        kept = _left(found, target, measured, found.selection.best)
        told = [_closer(target, _left(found, target, measured, one), kept) for one in without]
    except ValueError:  # a rig so close that cannot be simulated: nothing is told by others
        return None
    least = {part: min(one[part] for one in told) for part in parts if all(part in one for one in told)}
    return max(least.items(), key=lambda item: item[1], default=None)


def _closer(target: Target, lost: Sequence[Array], kept: Sequence[Array]) -> dict[Part, float]:
    """The same for energies (blocks,) of rigs without and with it, by part."""
    grown = [growths_of(target, one, other) for one in lost for other in kept]
    least = {part: min(one.get(part, 0.0) for one in grown) for part in grown[0]}
    inside = parts_of(target)

    def nats(energies: Array, part: Part) -> float:
        return float((target.counts * target.nats(energies))[inside[part]].sum())

    def gained(part: Part) -> float:
        return min(nats(one, part) for one in lost) - max(nats(one, part) for one in kept)

    return {part: growth for part, growth in least.items() if growth > PLAIN and gained(part) > GAIN}


def _left(found: Simulated, target: Target, measured: Measurement, optimum: Optimum) -> list[Array]:
    """Energies (blocks,) that rigs drawn next to an optimum leave."""
    free = found.simulator.free
    drawn = _drawn(free, found.end_of(optimum), optimum)
    return [left_by(target, free.channels(p, measured)) for p in drawn]


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

"""Where the fit of a rig without effects begins: the records' own account of what is around the mesh, with supports
that yield across as a simulation of the excited lines would have them.

Effects change the lines at rest, of teeth and of shafts far more than the answer to the excitation: that shows a rig's
structure beside whatever is wrong with its gears.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from gearbench.bench.plan.workers import side_by_side
from gearbench.diagnosis.fitting.fit import cost_of
from gearbench.diagnosis.fitting.shown import Shown
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.simulation.quadratic import prior_cost
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.structure.structure import ACROSS, CROSS, MOTIONS, housings

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

# What the answer of the rig to the force in the mesh does not show: compliance across over along, and the stiffness of
# the mesh, in standard deviations of the nominal one, that goes with it.
SOFT, STIFFER = (0.05, 0.1, 0.15, 0.2, 0.27, 0.35, 0.5, 0.7, 1.0), (-0.8, 0.0, 0.8)
VALLEYS, EVALUATIONS = 3, 10  # followed from the best levels, with so many simulations for each of both
COUPLED = 0.03  # cross-coupling by which a support shows how soft it is across


def nearest(simulator: Simulator, trials: Sequence[Array], sd: Array) -> Array:
    """The unknowns (size,) that come closest under the prior `sd` (size,), of several."""
    return min(trials, key=lambda p: cost_of(simulator, p, sd))


def beginning(simulator: Simulator, begin: Array, shown: Shown | None, sd: Array) -> Array:
    """The unknowns (size,) that come closest under the prior `sd` (size,), of `begin` and of what is `shown`."""
    unknowns = simulator.layout.unknowns
    yielding = begin.copy()
    if ACROSS in unknowns.slices:
        yielding[unknowns[ACROSS]] = SOFT[2]
    seen = seen_by(shown, unknowns, yielding)
    if seen is None:
        for _ in MOTIONS:
            begin = nearest(simulator, housings(unknowns, begin), sd)
        return begin
    found = levelled(simulator, seen, begin, sd)
    return min((begin, found), key=lambda p: linear_cost(simulator, p, sd))


def seen_by(shown: Shown | None, unknowns: Unknowns, held: Array) -> Array | None:
    """`held` (size,) with the rig around the mesh as it is `shown`; None where it is not, or for rigs that are no
    question to it."""
    return shown.around(held) if shown is not None and ACROSS in unknowns.slices else None


def levelled(simulator: Simulator, seen: Array, p: Array, sd: Array) -> Array:
    """The rig around the mesh as it was `seen` (size,), with supports across and a mesh whose stiffnesses go together:
    along narrow valleys, between which no fit walks. One record tells them as all do."""
    simulator = simulator.of_record(simulator.target.most_excited)
    known = _known(simulator, seen)
    # A support that stiffens resonates along where a gear across it would.
    trusted = [known, np.zeros_like(known)] if known.any() else [known]
    found = side_by_side(lambda one: _levelled(simulator, seen, p, sd, one), trusted)
    return min(found, key=lambda one: one[0])[1]


def _levelled(simulator: Simulator, seen: Array, p: Array, sd: Array, known: Flags) -> tuple[float, Array]:
    """Linear cost and unknowns (size,), gears of which (2,) it is `known` how they yield across staying as seen."""
    trials = levels(simulator, seen, p, known)
    costs = np.array(side_by_side(lambda trial: linear_cost(simulator, trial, sd), trials))
    # The best of each stiffness across.
    rows = costs.reshape(-1, len(STIFFER))
    numbers = [len(STIFFER) * row + int(np.argmin(rows[row])) for row in np.argsort(rows.min(axis=1))[:VALLEYS]]
    soft = simulator.layout.unknowns[ACROSS].start + np.flatnonzero(~known)
    found = side_by_side(lambda number: _followed(simulator, trials[number], soft, sd), numbers)
    return min(found, key=lambda one: one[0])


def _followed(simulator: Simulator, p: Array, soft: NDArray[np.int64], sd: Array) -> tuple[float, Array]:
    """Linear cost, and `p` (size,) with supports across (those of the entries `soft`) and mesh where it is least."""
    unknowns = simulator.layout.unknowns
    at = np.append(soft, unknowns["scale"].start)
    spread = np.append(np.full(len(soft), np.log(1.2)), 0.4 * unknowns.prior()[unknowns["scale"]])

    def moved(steps: Array) -> Array:
        out = p.copy()
        out[soft] *= np.exp(steps[:-1] * spread[:-1])
        out[at[-1]] += steps[-1] * spread[-1]
        return np.clip(out, *unknowns.bounds())

    simplex = np.vstack([np.zeros(len(at)), np.eye(len(at))])
    options = {"maxfev": EVALUATIONS * len(at), "initial_simplex": simplex, "xatol": 0.05, "fatol": 1.0}
    found = minimize(lambda steps: linear_cost(simulator, moved(steps), sd), simplex[0], method="Nelder-Mead",
                     options=options)  # fmt: skip
    return float(found.fun), moved(found.x)


def levels(simulator: Simulator, seen: Array, p: Array, known: Flags) -> list[Array]:
    """The rig around the mesh as it was `seen` (size,), with supports across and meshes of several stiffnesses around
    that of `p` (size,); supports of which it is `known` (2,) how they yield across stay."""
    unknowns, out = simulator.layout.unknowns, []
    spread = unknowns.prior()[unknowns["scale"]]
    for soft, stiffer in product(SOFT if not known.all() else SOFT[:1], STIFFER):
        trial = seen.copy()
        trial[unknowns[ACROSS]] = np.where(known, seen[unknowns[ACROSS]], soft)
        trial[unknowns["scale"]] = p[unknowns["scale"]] + stiffer * spread
        out.append(trial)
    return out


def _known(simulator: Simulator, seen: Array) -> Flags:
    """Which gears (2,) were seen to resonate across their supports."""
    return np.asarray(np.abs(seen[simulator.layout.unknowns[CROSS]]) > COUPLED)


def linear_cost(simulator: Simulator, p: Array, sd: Array) -> float:
    """Cost of unknowns under priors by the excited lines alone, by all of them where nothing is excited; infinite where
    no rig has them."""
    lines, target = simulator.lines(p), simulator.target
    if lines is None:
        return np.inf
    return target.excited_cost(target.lines - lines) + prior_cost(p, sd)

"""The rig around its mesh, from how it answers whatever force acts there.

What no force in the mesh explains of a record (`answering`) depends on supports, masses and housing alone. So they are
found without a simulation, from anywhere; only what acts through the deflection of the mesh (supports across) is not
seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from gearbench.diagnosis.effects.coupling import KEY as COMPLIANCE
from gearbench.diagnosis.effects.coupling import LOSS
from gearbench.diagnosis.effects.effect import SIDES
from gearbench.diagnosis.effects.sensor_delay import KEYS as DELAYS
from gearbench.diagnosis.fitting.answering import (
    MOVED,
    REACTION,
    Lines,
    joined,
    left_over,
    left_over_moved,
    lines_of,
    slopes_of,
    system_of,
)
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.simulation.quadratic import prior_cost, real_parts
from gearbench.diagnosis.structure.layout import Layout
from gearbench.diagnosis.structure.structure import (
    ACROSS,
    CROSS,
    DAMPED,
    GAIN,
    HOUSED,
    HOUSING,
    MOTIONS,
    SEAT,
    free_motions,
    seated,
    with_motion,
)

Array = NDArray[np.float64]

# What is found, beside whatever else is held.
KEYS = ("stiffness", "damping", "mass", "inertia", COMPLIANCE, LOSS, ACROSS, CROSS, DAMPED, GAIN, *DELAYS.values())
LINES, FEWEST = 200, 80  # of all records and of each, excited and operating, that are enough
# Parts of the local level below which no model is right: wide first, so that distant resonances pull.
LEVELS = (0.1, 0.01)
EVALUATIONS = 25
TOLERANCE = 1e-4  # part of the misfit, about a tenth of a nat, that another step must be worth
# Where a motion of the housing is looked for: compliances over the supports', logarithms of its frequency over theirs.
HOUSING_FROM = (0.004, 0.012, 0.04)
HOUSING_AT = tuple(np.linspace(-2.0, 0.8, 29))
# Where a gear's resonance across its support is looked for, which its cross-coupling shows.
ACROSS_AT = tuple(np.geomspace(0.08, 0.6, 19))
CROSS_AT = (-0.15, -0.06, 0.06, 0.15)
FAINT_AT, FAINT_EVALUATIONS = (-1.0, -0.7, -0.4, 0.0), 10
ROUNDS = 2  # looks for each beside the others
LEAST = 1e-6  # residual below which a line counts by its square
WORTH = 3.0  # nats by which a resonance must explain more


def around(layout: Layout, conditions: Sequence[Condition], held: Array) -> Array | None:
    """Unknowns (size,): `held` with those of supports, masses and housing that the records show; None where records
    have no displacement of the gears or no line, or no rig answers. Displacement sensors that are not held to stand on
    a housing are tried there too."""
    load = layout.nominal.rig.load
    # Held behind itself the driven gear hands on what its inertia leaves of the mesh's force.
    reaction = (REACTION,) if load.boundary == "speed" and not load.twists else ()
    wanted, most = (*MOVED, *reaction), max(LINES // len(conditions), FEWEST)
    found = (lines_of(layout.model, one, wanted, most) for one in conditions)
    lines = joined([one for one in found if one is not None])
    if not lines:
        return None
    unknowns = layout.unknowns
    plain = held.copy()
    for key in (CROSS, HOUSING):
        if key in unknowns.slices:
            plain[unknowns[key]] = 0.0
    try:
        cost, best = _fitted(layout, lines, plain, KEYS, LEVELS[:1])
        begun = [best]
        if HOUSING in unknowns.slices and not held[unknowns[SEAT]].any():
            begun.append(seated(unknowns, best))
        # Matrices are small: threads would wait for each other.
        rigs = [_found(layout, lines, cost, one) for one in begun]
    except ValueError:  # no rig there
        return None
    return min(rigs, key=lambda p: _misfit(layout, lines, p) + prior_cost(p, _prior(unknowns, p)))


def _prior(unknowns: Unknowns, p: Array) -> Array:
    """Prior standard deviations (size,): those of the background, but of a coupling that `p` (size,) has, its own."""
    out = unknowns.prior()
    at = unknowns[COMPLIANCE]
    out[at] = np.where(p[at] > 0.0, unknowns.group(COMPLIANCE).wide, out[at])
    return out


def _found(layout: Layout, lines: Sequence[Lines], cost: float, best: Array) -> Array:
    """The rig `best` (size,), which has no housing and costs so many nats, with each motion of a housing that is seen
    best beside the other."""
    unknowns = layout.unknowns
    motions = range(len(MOTIONS)) if HOUSING in unknowns.slices else ()
    for _ in range(ROUNDS):
        begin = best
        for side in range(len(SIDES)):
            begin = _looked(layout, lines, begin, _crossing(unknowns, begin, side))
        for motion in motions:
            begin = _looked(layout, lines, begin, _moving(unknowns, begin, motion))
        value, p = _fitted(layout, lines, begin, (*KEYS, *HOUSED), LEVELS)
        if value >= cost:
            break
        cost, best = value, p
    if not motions:
        return best
    # The mesh pushes both gears apart: a housing that moves along answers faintly, and is imitated from afar.
    trials = [with_motion(unknowns, best, 0, at, HOUSING_FROM[-1], 0) for at in FAINT_AT]
    keys = (*KEYS, *HOUSED)
    tried = [_fitted(layout, lines, trial, keys, LEVELS[1:], FAINT_EVALUATIONS) for trial in trials]
    value, p = min(tried, key=lambda one: one[0])
    return _fitted(layout, lines, p, keys, LEVELS[1:])[1] if value < cost else best


def _looked(layout: Layout, lines: Sequence[Lines], p: Array, trials: Sequence[Array]) -> Array:
    """The one of `trials` (size,) that explains most, if that is more than without (the first) and more than `p`."""
    here, *costs = (_misfit(layout, lines, trial) for trial in (p, *trials))
    best = int(np.argmin(costs))
    if here < min(costs[0] - WORTH, costs[best] + WORTH):
        return p
    return trials[best] if costs[best] < costs[0] - WORTH else trials[0]


def _crossing(unknowns: Unknowns, p: Array, side: int) -> list[Array]:
    """`p` (size,) without cross-coupling of a support, then with it where its gear might resonate across."""
    out = []
    for soft, coupled in ((p[unknowns[ACROSS]][side], 0.0), *product(ACROSS_AT, CROSS_AT)):
        trial = p.copy()
        trial[unknowns[ACROSS].start + side] = soft
        trial[unknowns[CROSS].start + side] = coupled
        out.append(trial)
    return out


def _moving(unknowns: Unknowns, p: Array, motion: int) -> list[Array]:
    """`p` (size,), then with a motion of the housing that is not there yet where it might resonate, of either kind;
    where both are there, without and with `motion`."""
    free, without = free_motions(unknowns, p), p.copy()
    if not free:
        free = [(motion, kind) for kind in range(len(MOTIONS))]
        without[unknowns[HOUSING].start + motion] = 0.0
    trials = product(free, HOUSING_FROM, HOUSING_AT)
    return [without, *(with_motion(unknowns, p, number, at, part, kind) for (number, kind), part, at in trials)]


def _misfit(layout: Layout, lines: Sequence[Lines], p: Array) -> float:
    """Nats that the lines cost: those of the wide level, which see a resonance from afar, and a tenth of those of the
    narrow one, which see a weak one."""
    system = system_of(layout, p)
    total = 0.0
    for one in lines:
        for level, rest in zip(LEVELS, left_over(layout, system, one, LEVELS), strict=True):
            total += level / LEVELS[0] * float(np.log1p(np.abs(rest) ** 2).sum())
    return total


def _fitted(
    layout: Layout, lines: Sequence[Lines], begin: Array, keys: Sequence[str], levels: Sequence[float],
    evaluations: int = EVALUATIONS,
) -> tuple[float, Array]:  # fmt: skip
    """Misfit, and `begin` (size,) with the unknowns of these keys where it is least."""
    unknowns = layout.unknowns
    at = np.concatenate([unknowns.at(key) for key in keys])
    sd = _prior(unknowns, begin)[at]
    # Without cross-coupling nothing shows how a support yields across.
    unseen = np.zeros(unknowns.size, dtype=bool)
    for key in (ACROSS, CROSS, DAMPED):
        unseen[unknowns[key]] = begin[unknowns[CROSS]] == 0.0
    # A coupling is an effect: it is found where it is held to be, and not looked for.
    for key in (COMPLIANCE, LOSS):
        unseen[unknowns[key]] = begin[unknowns[COMPLIANCE]] == 0.0
    kept = (sd > 0.0) & ~unseen[at]
    at, sd = at[kept], sd[kept]
    low, high = (bound[at] for bound in unknowns.bounds())

    def whole(values: Array) -> Array:
        p = begin.copy()
        p[at] = values
        return p

    values = np.clip(begin[at], low, high)
    for level in levels:

        def misfit(trial: Array, level: float = level) -> Array:
            system = system_of(layout, whole(trial))
            left = real_parts(np.concatenate([left_over(layout, system, one, (level,))[0] for one in lines]))
            # A line that nothing explains counts by the logarithm of its size.
            return np.concatenate([np.sign(left) * np.sqrt(np.log1p(left**2)), trial / sd])

        def slopes(trial: Array, level: float = level) -> Array:
            p = whole(trial)
            system = system_of(layout, p)
            slope = slopes_of(layout, p, system, at, sd)
            found = [left_over_moved(layout, system, slope, one, level) for one in lines]
            left = real_parts(np.concatenate([one for one, _ in found]))
            by = real_parts(np.concatenate([moved for _, moved in found], axis=1))
            size = np.maximum(np.abs(left), LEAST)
            by *= size / ((1.0 + size**2) * np.sqrt(np.log1p(size**2)))
            return np.concatenate([by.T, np.diag(1.0 / sd)])

        fit = least_squares(misfit, values, slopes, bounds=(low, high), x_scale=sd, max_nfev=evaluations,
                            ftol=TOLERANCE, tr_solver="lsmr")  # fmt: skip
        values = fit.x
    p = whole(values)
    return _misfit(layout, lines, p), p

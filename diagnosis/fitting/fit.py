"""Output-error fit: all unknowns moved together to where the simulation comes closest, under one set of priors.

Gauss-Newton on `quadratic`, whose steps are simulated: a step that does not lower the cost is halved, then tried
without what the rig does not feel yet, then damped ever more; the Jacobian is renewed where the unknowns are by now
when a step keeps little of what it promised, by all unknowns where forces alone do not mend that. It is done when no
step promises half a nat.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from math import inf

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.backlash import KEY as BACKLASH
from gearbench.diagnosis.effects.profile_error import FLANKS
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.simulation.quadratic import Quadratic, prior_cost, quadratic_of
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.structure.structure import least_steps

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]

GAIN = 0.5  # nats that are worth a step
POOR = 0.25  # part of what a step promised, below which the Jacobian is renewed
LITTLE = 0.01  # the same, below which another renewal is of no use
ANEW = 3.0  # nats that a renewal must have brought for another one
HALVINGS = 3
STEPS = 60
# Standard deviations that a step is damped to where no part of a longer one is of use, as valleys bend: the first, what
# it is multiplied by after one that does not help and after one that does, and the shortest.
REACH, SHRINK, GROW, SHORTEST = 0.3, 0.4, 2.0, 0.003
NEARLY = 10.0  # nats promised up to which any gain will do
SETTLED = 25.0  # nats that another step may promise: a fit that is close enough not to be gone on with


class Known(Enum):
    """Whose slopes are known where a fit is: none, those of what acts by forces, or also of what has to be moved."""

    NOTHING, FORCES, ALL = range(3)


@dataclass(frozen=True)
class Sensitivity:
    """A Jacobian (size, K) and the quadratic that it makes."""

    jacobian: Complex
    quadratic: Quadratic


@dataclass(frozen=True)
class Optimum:
    """Unknowns `p` (size,) under priors `sd` (size,), their simulated lines, cost with and without the prior, log
    evidence, posterior covariance of the active unknowns, nats that another step promises, and the sensitivities last
    used, about this residual."""

    p: Array
    sd: Array
    lines: Complex
    cost: float
    misfit: float
    evidence: float
    left: float
    sensitivity: Sensitivity

    @property
    def std(self) -> Array:
        """Posterior standard deviations (size,); of what these records do not show, those of the prior."""
        near, out = self.sensitivity.quadratic, self.sd.copy()
        out[near.active] = near.std(near.information(np.zeros(len(near.active))), self.sd)
        return out

    def evidence_under(self, sd: Array) -> float:
        """Log evidence of the same unknowns under other priors `sd` (size,): what was held counts as it does where it
        is not."""
        near = self.sensitivity.quadratic
        information = near.information(np.zeros(len(near.active)))
        return near.evidence(self.misfit + prior_cost(self.p, sd), information, sd)


def sensitivity_of(
    simulator: Simulator, p: Array, sd: Array, chosen: Flags | None = None, near: Complex | None = None
) -> Sensitivity | None:
    """Sensitivities of the chosen unknowns (size,; None: all) at `p`, moved by parts of `sd`, or as they were `near` by
    (size, K); None where no rig is there."""
    chosen = np.ones(p.size, dtype=bool) if chosen is None else chosen
    lines = simulator.lines(p)
    jacobian = simulator.jacobian(p, sd, chosen, near) if lines is not None else None
    if lines is None or jacobian is None:
        return None
    return _about(simulator, lines, jacobian)


def _about(simulator: Simulator, lines: Complex, jacobian: Complex) -> Sensitivity:
    """Sensitivities (size, K) about simulated lines (K,)."""
    active = np.flatnonzero(np.abs(jacobian).max(axis=1) > 0.0)
    return Sensitivity(jacobian, quadratic_of(simulator.target, simulator.target.lines - lines, jacobian, active))


def refreshed(simulator: Simulator, found: Optimum, chosen: Flags) -> Optimum:
    """The optimum with derivatives by the chosen unknowns (size,), which have to be moved and simulated, taken anew
    where it is: the others' are renewed as a fit goes on, those are not."""
    renewed = simulator.moved(found.p, simulator.layout.unknowns.prior(), chosen)
    if renewed is None:
        return found
    jacobian = np.where(chosen[:, None], renewed, found.sensitivity.jacobian)
    return _optimum(simulator, found.p, found.sd, found.cost, _about(simulator, found.lines, jacobian))


def gone_on(
    simulator: Simulator, found: Optimum, renewals: int, tell: Callable[[], None] = lambda: None
) -> Optimum:
    """The optimum, fitted on where another step still promises much, which is told."""
    if found.left <= SETTLED:
        return found
    tell()
    return fit(simulator, found.p, found.sd, found.sensitivity, renewals=renewals) or found


def cost_of(simulator: Simulator, p: Array, sd: Array) -> float:
    """Cost of unknowns under priors; infinite where no rig has them."""
    lines = simulator.lines(p)
    if lines is None:
        return np.inf
    return simulator.target.cost(simulator.target.lines - lines) + prior_cost(p, sd)


def _stepped(
    simulator: Simulator, p: Array, sd: Array, active: NDArray[np.int64], step: Array, cost: float, halvings: int
) -> tuple[Array, float]:
    """`p` (size,) after as much of the step of its active unknowns as lowers the cost, and that cost; itself where
    nothing does."""
    for halving in range(halvings + 1):
        trial = p.copy()
        trial[active] += 0.5**halving * step
        value = cost_of(simulator, trial, sd)
        if value < cost:
            return trial, value
    return p, cost


def _improved(
    simulator: Simulator, p: Array, sd: Array, near: Quadratic, cost: float, reach: float, damped: bool
) -> tuple[Array, float, float, float]:
    """`p` (size,) after the longest step that lowers the cost, of no more than `reach` standard deviations; the cost
    there, the nats that the last step tried promised, and the reach of the next one. Without `damped` a reach that has
    no end is not given one."""
    standing, hoped = _standing(simulator.layout.unknowns, p), 0.0
    best, least = p, cost
    if reach == inf:
        for limits in (simulator.layout.unknowns.bounds(), standing):
            step, promised, _ = near.best(p, sd, limits)
            hoped = cost - promised
            if hoped > GAIN:
                best, least = _stepped(simulator, p, sd, near.active, step, cost, HALVINGS)
                if cost - least >= min(ANEW, POOR * hoped) or (least < cost and hoped <= NEARLY):
                    return best, least, hoped, inf
            if least < cost:
                break
        if hoped <= GAIN or not damped:
            return best, least, hoped, inf
        reach = REACH
    while reach > SHORTEST:
        step, promised, _ = near.best(p, sd, standing, reach=reach)
        moved, value = _stepped(simulator, p, sd, near.active, step, cost, 0)
        if value < least:
            best, least, hoped = moved, value, cost - promised
        if cost - value >= POOR * (cost - promised):
            return best, least, hoped, reach * GROW if reach * GROW < 1.0 else inf
        reach *= SHRINK
    return best, least, hoped, inf


def _standing(unknowns: Unknowns, p: Array) -> tuple[Array, Array]:
    """Bounds (size,) between which what a rig does not feel yet stands still: its derivative is that of a jump, and a
    step shorter than that promises what it does not keep."""
    low, high = unknowns.bounds()
    for key, least in least_steps(unknowns).items():
        at = unknowns.at(key)
        at = at[(p[at] >= 0.0) & (p[at] < least)]
        low[at] = high[at] = p[at]
    return low, high


def _unseen(unknowns: Unknowns, sensitivity: Sensitivity) -> Flags:
    """Which unknowns (size,) these records do not show. Flanks that stand back behind all contact are not felt, but
    would be if they came forward; nor is a backlash that something else has opened."""
    out = np.isin(np.arange(unknowns.size), sensitivity.quadratic.active, invert=True)
    for key in (FLANKS, BACKLASH):
        if key in unknowns.slices:
            out[unknowns[key]] = False
    return out


def fit_afresh(
    simulator: Simulator, p: Array, sd: Array, *, renewals: int, chosen: Flags | None = None
) -> Optimum | None:
    """As `fit`, with derivatives by the chosen unknowns (None: all) taken at `p` (size,)."""
    first = sensitivity_of(simulator, p, simulator.layout.unknowns.prior(), chosen)
    return fit(simulator, p, sd, first, renewals=renewals, chosen=chosen, fresh=True) if first else None


def fit(
    simulator: Simulator,
    p: Array,
    sd: Array,
    sensitivity: Sensitivity,
    *,
    renewals: int = 0,
    chosen: Flags | None = None,
    fresh: bool = False,
) -> Optimum | None:
    """The optimum under the prior `sd` (size,) near `p` (size,), with at most so many renewals of the Jacobian of the
    chosen unknowns (None: all); None where `p` is no rig. `fresh`: the sensitivities are those of `p`."""
    p = np.clip(p, *simulator.layout.unknowns.bounds())
    # What these records do not show is left at nothing, what is not chosen as it is.
    p[_unseen(simulator.layout.unknowns, sensitivity) & (True if chosen is None else chosen)] = 0.0
    cost = cost_of(simulator, p, sd)
    if not np.isfinite(cost):
        return None
    known, reach, renewed_at = Known.ALL if fresh else Known.NOTHING, inf, cost if fresh else inf
    for _ in range(STEPS):
        near, before = _about_here(simulator, p, sensitivity), cost
        damped = known is not Known.NOTHING or renewals == 0
        p, cost, hoped, reach = _improved(simulator, p, sd, near, cost, reach, damped)
        gain = before - cost
        if gain >= max(GAIN, POOR * hoped):
            known = Known.NOTHING
            continue
        # A rig that bends gives little of what is promised, but does so again from there.
        ended = gain < max(ANEW, LITTLE * hoped) and known is not Known.NOTHING
        if renewals == 0 or (ended and known is Known.ALL) or (hoped <= GAIN and renewed_at - cost < ANEW):
            break
        if ended and _promised(simulator, p, sd, cost, _about_here(simulator, p, sensitivity)) < NEARLY:
            break
        # Where not even a short step keeps its promise, slopes that were not renewed lead astray.
        if ended:
            renewed = sensitivity_of(simulator, p, simulator.layout.unknowns.prior(), chosen)
        else:
            renewed = sensitivity_of(simulator, p, np.where(sd > 0, sd, 1.0), chosen, sensitivity.jacobian)
        if renewed is None:
            break
        sensitivity, renewals, renewed_at = renewed, renewals - 1, cost
        known, reach = (Known.ALL, inf) if ended else (Known.FORCES, reach)
    return _optimum(simulator, p, sd, cost, Sensitivity(sensitivity.jacobian, _about_here(simulator, p, sensitivity)))


def _about_here(simulator: Simulator, p: Array, sensitivity: Sensitivity) -> Quadratic:
    """The quadratic about the residual of `p` (size,)."""
    lines = simulator.lines(p)
    assert lines is not None
    return sensitivity.quadratic.moved(simulator.target.lines - lines)


def _promised(simulator: Simulator, p: Array, sd: Array, cost: float, near: Quadratic) -> float:
    """Nats that a step of any length from `p` (size,) promises."""
    return cost - near.best(p, sd, _standing(simulator.layout.unknowns, p))[1]


def _optimum(simulator: Simulator, p: Array, sd: Array, cost: float, sensitivity: Sensitivity) -> Optimum:
    """Unknowns of a rig that cost so many nats under a prior, with the sensitivities about their own residual."""
    lines, near = simulator.lines(p), sensitivity.quadratic
    assert lines is not None
    here = near.information(np.zeros(len(near.active)))
    return Optimum(
        p=p,
        sd=sd,
        lines=lines,
        cost=cost,
        misfit=cost - prior_cost(p, sd),
        evidence=near.evidence(cost, here, sd),
        left=_promised(simulator, p, sd, cost, near),
        sensitivity=sensitivity,
    )

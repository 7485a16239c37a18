"""Beside a large gap the background's fit ends in a valley of its own, from which no effect looks like anything: what
the force residuals have found there is fitted from their own rig, and so is the background from where that ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.fitting.beginning import levelled, linear_cost, seen_by
from gearbench.diagnosis.fitting.closeness import better, is_close
from gearbench.diagnosis.fitting.fit import Optimum, cost_of, fit, fit_afresh, gone_on
from gearbench.diagnosis.fitting.restructured import restructured
from gearbench.diagnosis.fitting.shown import Shown
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]
Report = Callable[[str], None]

SPEAKS = 20.0  # nats of the force residuals from which their rig is worth a fit
RENEWALS = 4


@dataclass(frozen=True)
class Start:
    """Where the force residuals, or an earlier fit, would have the unknowns of a hypothesis, and their log Bayes factor
    for it."""

    hypothesis: Hypothesis
    p: Array
    log_bayes_factor: float


def begun_by_forces(
    simulator: Simulator,
    base: Optimum,
    hypotheses: Sequence[Hypothesis],
    starts: Mapping[str, Start],
    shown: Shown | None = None,
    report: Report = lambda step: None,
) -> tuple[Optimum, dict[str, Start]]:
    """The background's optimum, or the one of more evidence that is found beside the effect that the force residuals
    speak for most or with another structure (`shown`: what of it the records show without simulation), and the
    starts, with where that effect's own fit ended.

    Where that effect comes close to the records, no other structure is sought beside its absence: it would imitate it.
    """
    if is_close(simulator, base):
        return base, {**starts}
    unknowns, found = simulator.layout.unknowns, None
    listed = [starts[one.name] for one in hypotheses if one.name in starts]
    start = max(listed, key=lambda one: one.log_bayes_factor, default=None)
    if start is not None and start.log_bayes_factor >= SPEAKS:
        report(f"simulating: {start.hypothesis.name}, as the force residuals have it")
        sd = start.hypothesis.widened(unknowns, base.sd)
        found = fit_afresh(simulator, _beginning(simulator, start, sd, base.cost, shown), sd, renewals=RENEWALS)
        found = gone_on(simulator, found, RENEWALS) if found else None
    if start is None or found is None:
        return restructured(simulator, base, shown, report), {**starts}
    p = found.p.copy()
    p[start.hypothesis.entries(unknowns)] = 0.0
    base = better(base, fit(simulator, p, base.sd, found.sensitivity, renewals=RENEWALS))
    if not is_close(simulator, found):
        base = restructured(simulator, base, shown, report)
    begun = Start(start.hypothesis, found.p, start.log_bayes_factor)
    return base, {**starts, start.hypothesis.name: begun}


def _beginning(simulator: Simulator, start: Start, sd: Array, limit: float, shown: Shown | None) -> Array:
    """Where a fit beside an effect begins (size,): the force residuals' own rig where that costs less than the `limit`,
    else the better of it and of the effect alone with what is `shown` of the rig around the mesh beside it."""
    unknowns, begin = simulator.layout.unknowns, np.where(sd > 0.0, start.p, 0.0)
    if cost_of(simulator, begin, sd) < limit:
        return begin
    alone, at = np.zeros(unknowns.size), start.hypothesis.entries(unknowns)
    alone[at] = start.p[at]
    seen = seen_by(shown, unknowns, alone)
    if seen is None:
        return begin
    return min((begin, levelled(simulator, seen, alone, sd)), key=lambda p: linear_cost(simulator, p, sd))

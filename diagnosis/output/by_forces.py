"""Beside a large gap the background's fit ends in a valley of its own, from which no effect looks like anything: what
the force residuals have found there is fitted from their own rig, and so is the background from where that ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.output.fit import Optimum, fit, fit_afresh
from gearbench.diagnosis.output.restructured import better, is_close
from gearbench.diagnosis.output.simulator import Simulator

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
    report: Report = lambda step: None,
) -> tuple[Optimum, Start | None]:
    """The background's optimum, or the one of more evidence that is found beside the effect that the force residuals
    speak for most, and a start where that effect's own fit ended; none where little is left, or they do not speak."""
    listed = [starts[one.name] for one in hypotheses if one.name in starts]
    start = max(listed, key=lambda one: one.log_bayes_factor, default=None)
    if start is None or start.log_bayes_factor < SPEAKS or is_close(simulator, base):
        return base, None
    report(f"simulating: {start.hypothesis.name}, as the force residuals have it")
    unknowns = simulator.layout.unknowns
    sd = start.hypothesis.widened(unknowns, base.sd)
    found = fit_afresh(simulator, np.where(sd > 0.0, start.p, 0.0), sd, renewals=RENEWALS)
    if found is None:
        return base, None
    p = found.p.copy()
    p[start.hypothesis.entries(unknowns)] = 0.0
    again = fit(simulator, p, base.sd, found.sensitivity, renewals=RENEWALS)
    return better(base, again), Start(start.hypothesis, found.p, start.log_bayes_factor)

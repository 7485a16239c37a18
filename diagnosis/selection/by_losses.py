"""Friction read off the power that the mesh loses: no spring, damper or mass changes the mean of the reaction's torque.

A reaction's sensor of another gain loses as much. A fit that takes the loss for gain ends in a valley of its own, from
which friction looks like nothing: it is begun once more where friction alone accounts for the loss.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.friction import KEY as FRICTION
from gearbench.diagnosis.effects.friction import SD
from gearbench.diagnosis.fitting.answering import REACTION
from gearbench.diagnosis.fitting.fit import Optimum, fit_afresh
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.selection.by_forces import Start
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.structure.structure import GAIN

Array = NDArray[np.float64]
Report = Callable[[str], None]

TRIED = 0.03  # coefficient by which it is found what friction takes
LOSSY = 3.0  # standard deviations of sound flanks by which a reading must exceed what a fit has
# Part of the torque that a coefficient of one must take: a reaction that is prescribed does not feel it.
FELT = 0.1
RENEWALS = 6


def with_losses(
    simulator: Simulator,
    base: Optimum,
    hypotheses: Sequence[Hypothesis],
    starts: Mapping[str, Start],
    report: Report = lambda step: None,
) -> dict[str, Start]:
    """The starts, with that of friction where the mesh loses more than the fit `base` has friction for."""
    out, one = {**starts}, next((one for one in hypotheses if one.wide[0].key == FRICTION), None)
    if one is None:
        return out
    unknowns = simulator.layout.unknowns
    at, begin = unknowns[FRICTION], base.p.copy()
    begin[unknowns[GAIN]] = 0.0
    coefficient = read_off(simulator, begin)
    if coefficient is None or coefficient - float(base.p[at][0]) < LOSSY * SD:
        return out
    report(f"simulating: {one.name}, as the mean torques have it")
    begin[at] = min(coefficient, float(unknowns.bounds()[1][at][0]))
    found = fit_afresh(simulator, begin, one.widened(unknowns, base.sd), renewals=RENEWALS)
    if found is not None:
        worth = found.evidence - base.evidence
        # What forces make of it stands, wherever that fit ended.
        out[one.name] = Start(one, found.p, max(worth, out[one.name].log_bayes_factor) if one.name in out else worth)
    return out


def read_off(simulator: Simulator, p: Array) -> float | None:
    """Coefficient of friction beyond the nominal one with which the rig `p` (size,) loses as much torque as measured,
    the median of the records; None where none of them tells."""
    at = simulator.layout.unknowns[FRICTION]
    smooth, rubbing = p.copy(), p.copy()
    smooth[at], rubbing[at] = 0.0, TRIED
    found = []
    for measured in simulator.target.measurements:
        channels = measured_channels(measured)
        if REACTION not in channels:
            continue
        try:
            without, more = (float(simulator.channels(one, measured)[REACTION].mean()) for one in (smooth, rubbing))
        except ValueError:  # no rig there
            continue
        slope = (more - without) / TRIED
        if abs(slope) > FELT * abs(without) / np.mean(simulator.layout.model.teeth):
            found.append((float(channels[REACTION].mean()) - without) / slope)
    return float(np.median(found)) if found else None

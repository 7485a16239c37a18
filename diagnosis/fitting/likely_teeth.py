"""Teeth that may be cracked, by what the background leaves of the simulated records.

The force residuals rank teeth as well, but smooth filters and a missing structure can hide one there. Here every
tooth's loss of stiffness is tried alone: beside what the background may move, under the weights that the blocks have
at its optimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.fitting.closeness import better
from gearbench.diagnosis.fitting.fit import Optimum, Sensitivity, fit
from gearbench.diagnosis.simulation.quadratic import quadratic_of, real_parts
from gearbench.diagnosis.simulation.simulator import Simulator

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

LIKELY = 3  # teeth that the simulated records rank first
WORTH, RENEWALS = 3.0, 2  # nats that a small crack must promise to be fitted, and renewals of the Jacobian for it


def with_likely_teeth(simulator: Simulator, base: Optimum, ranked: Sequence[int]) -> tuple[Simulator, Optimum]:
    """The simulator whose teeth that may be cracked are those `ranked` (by number) and those that the records show
    beside the background's optimum `base`; and that optimum with their sensitivities."""
    unknowns, layout = simulator.layout.unknowns, simulator.layout
    everyone = replace(layout, teeth=tuple(range(sum(layout.model.teeth))))
    loss = unknowns[CRACK]
    chosen = np.zeros(unknowns.size, dtype=bool)
    chosen[loss] = True
    found = replace(simulator, layout=everyone).jacobian(base.p, unknowns.prior(), chosen)
    if found is None:
        return simulator, base
    gains = gains_of(base, unknowns.group(CRACK).wide, found[loss])
    shown = [int(one) for one in np.argsort(-gains)[:LIKELY]]
    teeth = tuple(dict.fromkeys([*ranked, *shown]))
    jacobian = base.sensitivity.jacobian.copy()
    jacobian[loss] = 0.0
    jacobian[loss.start + np.array(teeth)] = found[loss.start + np.array(teeth)]
    active = np.flatnonzero(np.abs(jacobian).max(axis=1) > 0.0)
    near = quadratic_of(simulator.target, simulator.target.lines - base.lines, jacobian, active)
    return (
        replace(simulator, layout=replace(layout, teeth=teeth)),
        replace(base, sensitivity=Sensitivity(jacobian, near)),
    )


def with_small_cracks(simulator: Simulator, base: Optimum) -> Optimum:
    """The background's optimum with the tooth of each gear that may be cracked and promises most as soft as a sound
    gear's weakest one may be, where the records speak for that: a few per cent of one tooth's stiffness show at as many
    lines as a gear has teeth, and keep a rig that is right in everything else from looking so."""
    unknowns = simulator.layout.unknowns
    loss, first = unknowns[CRACK], simulator.layout.model.teeth[0]
    own = unknowns.group(CRACK)
    teeth = np.array(simulator.layout.teeth, dtype=int)
    gains = gains_of(base, own.sd[teeth], base.sensitivity.jacobian[loss.start + teeth])
    sd, p = base.sd.copy(), base.p.copy()
    sd[loss], p[loss] = 0.0, 0.0
    for driver in (True, False):
        mine = np.flatnonzero(((teeth < first) == driver) & (gains > WORTH))
        if mine.size:
            tooth = teeth[mine[np.argmax(gains[mine])]]
            sd[loss.start + tooth], p[loss.start + tooth] = own.sd[tooth], base.p[loss.start + tooth]
    if np.array_equal(sd, base.sd):
        return base
    found = fit(simulator, p, sd, base.sensitivity, renewals=RENEWALS)
    # Where other teeth may be cracked by now, the former ones are no longer in the rig.
    return better(base, found) if not base.p[loss].any() else found or base


def gains_of(base: Optimum, wide: Array, columns: Complex) -> Array:
    """Nats (teeth,) that one step by each tooth's loss alone gains, of prior `wide` (teeth,), beside all that the
    background may move; `columns` (teeth, K) are its lines. A tooth does not gain stiffness: such steps gain none."""
    quadratic = base.sensitivity.quadratic
    target, width = quadratic.target, base.sd[quadratic.active]
    at = quadratic.active[width > 0.0]
    weight = np.sqrt(quadratic.weights(np.zeros(len(quadratic.active))))[target.of_line]
    rest = real_parts((target.lines - base.lines) * weight)
    others, own = (real_parts(one * weight) for one in (base.sensitivity.jacobian[at], columns))
    scale = base.sd[at]
    matrix = cho_factor(others @ others.T * scale[:, None] * scale[None, :] + np.eye(len(at)), lower=True)
    between = (others @ own.T) * scale[:, None]
    pull = (others @ rest) * scale - base.p[at] / scale
    along = own @ rest - between.T @ cho_solve(matrix, pull)
    curvature = (own**2).sum(axis=1) - np.einsum("ot,ot->t", between, cho_solve(matrix, between)) + wide**-2.0
    return np.asarray(np.where(along > 0.0, 0.5 * along**2 / curvature, 0.0))

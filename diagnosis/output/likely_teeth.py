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
from gearbench.diagnosis.output.fit import Optimum, Sensitivity
from gearbench.diagnosis.output.quadratic import quadratic_of, real_parts
from gearbench.diagnosis.output.simulator import Simulator

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

LIKELY = 3  # teeth that the simulated records rank first


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

"""The resonance of a housing on which the displacement sensors stand, read off the force residuals.

What the gears do on their supports is measured, and with it the force by which they push the housing. That moves by
this force and its own compliance, whatever the other parts of the rig do, and closes the mesh: the residuals are linear
in the compliance. No simulation is needed, and no rig near the records: a fit that has made up for a soft housing by
other means is far from where it should begin.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.fitting.hidden_motion import PAIRS, Motion, Resonance, answer_of, likeliest
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.covariance import Blocks, whitened
from gearbench.diagnosis.forces.departures import Departures
from gearbench.diagnosis.forces.equations import SUPPORTS
from gearbench.diagnosis.forces.jacobian import linearised
from gearbench.diagnosis.forces.mesh import radial_impedance
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.residuals import Residuals, transform
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.structure.structure import HOUSING_SD, mean_stiffness, pace_of

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SMOOTH = "compliance"  # what yields by a smooth function of frequency, which would make up for a part of a resonance
CLEAR = 10.0  # nats by which a resonance must explain more
# Logarithm of the frequency over the supports' above which gears resonate across their supports, which the forces show
# as well.
HIGHEST = 0.0


def motion_by_forces(problem: Problem, fit: Fit) -> Motion | None:
    """The motion of a housing that explains most of the residuals of a fit, its sensors moving along; None where none
    explains much, or displacements of the gears are not measured."""
    if not all(one.channel in condition.spectra for condition in problem.conditions for one in SUPPORTS):
        return None
    unknowns, p = problem.unknowns, fit.p.copy()
    p[unknowns[SMOOTH]] = 0.0
    kept = np.flatnonzero((fit.sd > 0.0) & ~np.isin(np.arange(p.size), unknowns.at(SMOOTH)))
    each = zip(problem.conditions, problem.blocks, fit.factors, strict=True)
    records = [_record_of(problem.model, unknowns, p, *one) for one in each]

    def made_of(found: Resonance) -> Array:
        return HOUSING_SD * np.concatenate([one.made_of(found) for one in records], axis=1)

    others = np.concatenate([one.slopes for one in records], axis=1)[kept] * fit.sd[kept, None]
    left = p[kept] / fit.sd[kept] @ others - np.concatenate([one.left for one in records])
    return next((motion for gain, motion in likeliest(made_of, left, others, highest=HIGHEST) if gain > CLEAR), None)


@dataclass(frozen=True)
class _Record:
    """One record about given departures: residuals `left` (R,) and what each unknown does to them `slopes` (size, R),
    real and whitened, and what a housing's motion needs to be added: `closing` (10, N/2 + 1) [m], by PAIRS, how far its
    forces would close the mesh if it were as stiff as the supports, at frequencies `over` theirs, and the `tangent`
    (N,) [N/m] of the mesh."""

    condition: Condition
    blocks: Blocks
    residuals: Residuals
    factor: Array
    left: Array
    slopes: Array
    closing: Complex
    over: Array
    tangent: Array

    def made_of(self, found: Resonance) -> Array:
        """What a motion adds to the residuals (10, R), by PAIRS, for a compliance of one."""
        n = self.condition.samples
        closed = np.fft.irfft(self.closing * answer_of(self.over, found), n, axis=-1) * n
        force = transform(self.condition, self.tangent * closed)[:, self.blocks.used]
        return _whitened(self.blocks, self.residuals, -self.residuals.mesh_factor[..., None] * force.T, self.factor)[1]


def _record_of(
    model: NominalModel, unknowns: Unknowns, p: Array, condition: Condition, blocks: Blocks, factor: Array
) -> _Record:
    at = linearised(model, condition, unknowns, p, blocks.used)
    left, slopes = _whitened(blocks, at.residuals, at.jacobian, factor)
    closing = _closing(model, condition, at.departures, at.spectra) / mean_stiffness(model)
    over = condition.omega / pace_of(model)
    return _Record(condition, blocks, at.residuals, factor, left, slopes, closing, over, at.mesh.tangent)


def _whitened(blocks: Blocks, residuals: Residuals, jacobian: Complex, factor: Array) -> tuple[Array, Array]:
    """Residuals (R,) and Jacobian (n, R) whose halved squares are nats."""
    left, slopes = whitened(blocks, replace(residuals, stiffening=0.0), jacobian, factor)
    return sqrt(2.0) * left, sqrt(2.0) * slopes.T


def _closing(
    model: NominalModel, condition: Condition, departures: Departures, spectra: Mapping[str, Complex]
) -> Complex:
    """How far a housing closes the mesh that moves by the force on it [N], (10, N/2 + 1) by PAIRS of shares: those by
    which the supports push it, along as they are measured and across as the mesh's force has them, and those by which
    it moves them."""
    s, pushing = 1j * condition.omega, []
    for one in SUPPORTS:
        stiffness = model.stiffness[one.side] * np.exp(departures.stiffness[one.side])
        damping = model.damping[one.side] * np.exp(departures.damping[one.side])
        pushing.append((stiffness + s * damping) * spectra[one.channel])
    impedance, spring, damper = radial_impedance(model, condition, departures)
    moving = [model.support_factor, -model.support_factor, model.transverse_factor, -model.transverse_factor]
    for side, direction in enumerate(moving[2:]):
        pushing.append(-direction * condition.force_full * (spring[side] + damper[side]) / impedance[side])
    return np.stack([
        moving[i] * pushing[j] + (moving[j] * pushing[i] if i != j else 0.0) for i, j in PAIRS
    ])  # fmt: skip

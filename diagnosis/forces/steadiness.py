"""What differs from one period to the next: content that no periodic rig has, and the row that it enters by.

The force residuals of single periods are taken with the unknowns of a fit; what all periods share cancels in their
scatter. Of a periodic rig noise is left, whose size is known; a drifting spring or a torque that is not locked to the
rotation leaves more, in the row of its own place, while the other rows go on agreeing about the mesh force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.forces.covariance import ALIASED, BLOCK, expected_squares, noise_of_rows
from gearbench.diagnosis.forces.nominal import Machine
from gearbench.diagnosis.forces.parameters import Layout
from gearbench.diagnosis.forces.residuals import rows
from gearbench.diagnosis.forces.unknowns import ROWS
from gearbench.diagnosis.intake.measurements import Measurement

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ROUNDS = 60


def unsteadiness(
    machine: Machine, measurements: Sequence[Measurement], where: Layout, p: Array, band: float
) -> Array:
    """Excess scatter (rows + 1,) between periods: sum over blocks of bins of count log lambda, the mesh last.

    Zero where there is one period only.
    """
    total = np.zeros(len(ROWS) + 1)
    for measured in measurements:
        if measured.rows < 2:
            continue
        single = []
        for row in range(measured.rows):
            alone = replace(measured, periods={k: v[row : row + 1] for k, v in measured.periods.items()})
            condition = prepare(alone, machine, band)
            found = rows(machine, condition, where, p)
            single.append(found.left)
        whole = prepare(measured, machine, band)
        scatter = np.stack(single) - np.mean(single, axis=0)
        variance = noise_of_rows(machine, whole) * measured.rows + (ALIASED * whole.force_level) ** 2
        total += excess_of(scatter / np.sqrt(1 - 1 / measured.rows), found.share, variance)
    return total


def excess_of(scatter: Complex, share: Complex, variance: Array) -> Array:
    """Count times log lambda (rows + 1,) of scatter (P, rows, K) against known variance (rows + 1, K); `share`
    (rows, K) is that of the mesh's error in each row."""
    present = np.flatnonzero(np.isfinite(scatter).all(axis=(0, 2)))
    g = share[present]
    r, floor = scatter[:, present], variance[[*present, len(ROWS)]]
    of_bin = np.arange(r.shape[2]) // BLOCK
    number = of_bin[-1] + 1
    count = np.bincount(of_bin) * float(len(r))
    factor = np.ones((len(floor), number))
    for _ in range(ROUNDS):
        squares = expected_squares(r, g, floor * factor[:, of_bin]).sum(axis=0)
        total = np.stack([np.bincount(of_bin, row, number) for row in squares / floor])
        factor = np.maximum(total / count, 1.0)
    # A few degrees of freedom always scatter above their variance: only what is clearly more counts.
    clear = np.where(factor > 3.0, factor, 1.0)
    out = np.zeros(len(ROWS) + 1)
    out[[*present, len(ROWS)]] = (count * np.log(clear)).sum(axis=1)
    return out

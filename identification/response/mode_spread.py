"""Standard deviation of natural frequencies that were read from an uncertain ITF.

A fitted pole moves with the response by dp = w dG, w the last row of the pseudo-inverse of the fit's columns at the
found pole (`modes.py`). For circular errors of variance v the pole has the variance sum |w|^2 v, half of it along the
frequency. Errors of neighbouring lines come from the same window of the local polynomial method: where `together` of
them move as one, this grows by as much.
"""

from __future__ import annotations

import numpy as np

from gearbench.identification.response.modes import FIT_BANDWIDTHS, NUMERATOR
from gearbench.identification.truth.periodic import Complexes, Floats


def natural_frequency_deviation(
    frequency: Floats, itf: Complexes, variance: Floats, modes: tuple[Floats, Floats], together: float = 1.0
) -> Floats:
    """Standard deviations (mode, phase) [Hz] of natural frequencies; NaN where there is none.

    `frequency` [Hz]; `itf`, `variance` (frequency, phase) [m/N, its square]; `modes`: natural frequencies [Hz] and
    damping ratios, each (mode, phase); `together`: neighbouring lines with the same error.
    """
    natural, damping = modes
    result = np.full(natural.shape, np.nan)
    for (mode, phase), value in np.ndenumerate(natural):
        ratio = float(damping[mode, phase])
        if not np.isfinite(value):
            continue
        reach = 2 * FIT_BANDWIDTHS * ratio * value
        inside = np.abs(frequency - value) <= reach
        if inside.sum() <= NUMERATOR + 1:
            continue
        pole = 2 * np.pi * value * (-ratio + 1j * np.sqrt(max(1.0 - ratio**2, 0.0)))
        spread = _pole_variance(frequency[inside], itf[inside, phase], variance[inside, phase], pole)
        result[mode, phase] = np.sqrt(0.5 * spread * min(together, float(inside.sum()))) / (2 * np.pi)
    return result


def _pole_variance(frequency: Floats, response: Complexes, variance: Floats, pole: complex) -> float:
    """E|error of the pole|^2 [rad^2/s^2] for independent errors of the response."""
    scale = abs(pole)
    shift = (2j * np.pi * frequency - pole) / scale
    columns = (shift[:, None] + (pole / scale - 1j)) ** np.arange(NUMERATOR) / shift[:, None]
    numerator = np.linalg.lstsq(columns, response, rcond=None)[0]
    full = np.concatenate([columns, ((columns @ numerator) / shift)[:, None]], axis=1)
    weight = np.linalg.pinv(full)[-1]
    return float(np.sum(np.abs(weight) ** 2 * variance)) * scale**2

"""Natural frequency and damping ratio against mesh phase.

From a periodic system: eigenvalues of the frozen A(phase). From an ITF: at each phase a single complex pole
with a polynomial numerator is fitted around each peak,

    G(s) ~ (n_0 + n_1 s + n_2 s^2) / (s - p),   natural frequency |p| / 2 pi,   damping ratio -Re p / |p|,

first linearised (Sanathanan and Koerner, IEEE Trans. Autom. Control 8, 1963), then by Gauss-Newton on the
output error, which does not pull the pole where the ITF is noisy.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import uniform_filter1d
from scipy.signal import find_peaks

from gearbench.identification.truth.periodic import Complexes, Floats, PeriodicSystem

# A peak stands out of its surroundings by this factor in magnitude.
PROMINENCE = 1.6
# A strongly damped mode makes a hump only: where nothing stands out so far, the highest hump of this factor counts.
# Of many smoothed values of noise the highest and the lowest lie six standard deviations apart.
HUMP = 1.05
HUMP_SIGNIFICANCE = 8.0
# A peak reaches this part of the phase's largest magnitude of its phase, and this multiple of its standard deviation.
HEIGHT = 0.03
SIGNIFICANCE = 4.0
# A mode counts if at least this part of the phases show it.
MODE_SHARE = 0.2
# Peaks are looked for in |G|^2 averaged over this part of the frequency, to pass over noise.
SMOOTHING = 0.01
# The fit takes this many half-power bandwidths on each side of the peak, and at least MIN_LINES lines.
FIT_BANDWIDTHS = 1.5
MIN_LINES = 9
NUMERATOR = 3
ROUNDS = 12


def frozen_modes(system: PeriodicSystem, phase: ArrayLike, *, modes: int | None = None) -> tuple[Floats, Floats]:
    """Natural frequencies [Hz] and damping ratios (mode, phase) of the frozen oscillatory eigenvalues, rising.

    `modes` keeps the lowest ones; a phase with fewer oscillatory modes is filled with NaN.
    """
    a, _, _ = system.balanced().at(phase)
    values = np.linalg.eigvals(a)
    count = system.states // 2 if modes is None else modes
    frequency = np.full((count, a.shape[0]), np.nan)
    damping = np.full_like(frequency, np.nan)
    for column, eigenvalues in enumerate(values):
        poles = eigenvalues[eigenvalues.imag > 1e-9 * np.abs(eigenvalues).max()]
        poles = poles[np.argsort(np.abs(poles))][:count]
        frequency[: poles.size, column] = np.abs(poles) / (2 * np.pi)
        damping[: poles.size, column] = -poles.real / np.abs(poles)
    return frequency, damping


def itf_modes(
    frequency: Floats, itf: Complexes, variance: Floats | None = None, *, modes: int | None = None
) -> tuple[Floats, Floats]:
    """Natural frequencies [Hz] and damping ratios (mode, phase) of an ITF (frequency, phase), rising in frequency.

    `frequency` [Hz] uniform and rising; `variance` (frequency, phase) = E|error|^2 rules out peaks that are
    noise. `modes` keeps the lowest ones; by default there are as many as a fifth of the phases show. NaN where a mode
    has no peak or no stable pole can be fitted.
    """
    peaks = [_peaks(frequency, itf[:, p], None if variance is None else variance[:, p]) for p in range(itf.shape[1])]
    sizes = np.array([found.size for found in peaks])
    number = int(np.quantile(sizes, 1.0 - MODE_SHARE, method="inverted_cdf"))
    if modes is not None:
        number = min(number, modes)
    natural = np.full((number, itf.shape[1]), np.nan)
    damping = np.full_like(natural, np.nan)
    if not number:
        return natural, damping
    for phase, assigned in enumerate(_assign(peaks, frequency, number)):
        others = frequency[peaks[phase]]
        for mode, index in enumerate(assigned):
            if index >= 0:
                pole = _fit_pole(frequency, itf[:, phase], int(index), others)
                if pole is not None:
                    natural[mode, phase] = abs(pole) / (2 * np.pi)
                    damping[mode, phase] = -pole.real / abs(pole)
    return natural, damping


def _peaks(frequency: Floats, response: Complexes, variance: Floats | None) -> np.ndarray:
    """Indices of the peaks of |G| at one phase."""
    spacing = frequency[1] - frequency[0]
    width = max(1, round(SMOOTHING * frequency[-1] / spacing / 2) * 2 + 1)
    power = uniform_filter1d(np.abs(response) ** 2, width, mode="nearest")
    level = np.log(np.sqrt(np.maximum(power, 1e-300)))
    found, _ = find_peaks(level, prominence=np.log(PROMINENCE), height=level.max() + np.log(HEIGHT))
    if not found.size:
        found = _hump(level, power, width, variance)
    if variance is not None:
        found = found[power[found] > SIGNIFICANCE**2 * variance[found]]
    return found


def _hump(level: Floats, power: Floats, width: int, variance: Floats | None) -> np.ndarray:
    """Index of the most prominent hump of the log magnitude, if it stands out of the noise."""
    found, about = find_peaks(level, prominence=np.log(HUMP), height=level.max() - np.log(2.0))
    if not found.size:
        return found
    best = int(np.argmax(about["prominences"]))
    chosen = found[best : best + 1]
    if variance is not None:
        # Smoothing over `width` lines takes this much of the noise away.
        scatter = np.sqrt(variance[chosen[0]] / (power[chosen[0]] * width))
        if about["prominences"][best] < HUMP_SIGNIFICANCE * scatter:
            return chosen[:0]
    return chosen


def _assign(peaks: list[np.ndarray], frequency: Floats, number: int) -> list[np.ndarray]:
    """Index of each mode's peak at each phase, -1 where it has none.

    Phases that show exactly `number` peaks define the modes' median frequencies; elsewhere each mode takes
    the nearest peak within half the distance to its neighbours, or nothing.
    """
    exact = np.array([frequency[found[:number]] for found in peaks if found.size >= number])
    centre = np.median(exact, axis=0)
    gap = np.diff(centre, prepend=0.0, append=2 * centre[-1])
    result = []
    for found in peaks:
        chosen = np.full(number, -1)
        if found.size == number:
            chosen = np.asarray(found)
        elif found.size:
            distance = np.abs(frequency[found][None, :] - centre[:, None])
            nearest = distance.argmin(axis=1)
            close = distance.min(axis=1) < 0.5 * np.minimum(gap[:-1], gap[1:])
            chosen = np.where(close, found[nearest], -1)
            unique, counts = np.unique(chosen, return_counts=True)
            for index in unique[(counts > 1) & (unique >= 0)]:
                rivals = np.flatnonzero(chosen == index)
                best = rivals[np.argmin(np.abs(centre[rivals] - frequency[index]))]
                chosen[rivals[rivals != best]] = -1
        result.append(chosen)
    return result


def _fit_pole(frequency: Floats, response: Complexes, peak: int, others: Floats) -> complex | None:
    """Pole [rad/s] near the peak, or None if the fit does not settle on a stable one inside its window."""
    half_power = np.abs(response) ** 2 < 0.5 * np.abs(response[peak]) ** 2
    above, below = np.flatnonzero(half_power[peak:]), np.flatnonzero(half_power[: peak + 1][::-1])
    sides = [int(side[0]) for side in (above, below) if side.size]
    half = max(min(sides) if sides else MIN_LINES, 1)
    reach = max(int(np.ceil(2 * FIT_BANDWIDTHS * half)), MIN_LINES // 2 + 1)
    low, high = frequency[max(peak - reach, 0)], frequency[min(peak + reach, frequency.size - 1)]
    for other in others[others != frequency[peak]]:
        if other < frequency[peak]:
            low = max(low, 0.5 * (other + frequency[peak]))
        else:
            high = min(high, 0.5 * (other + frequency[peak]))
    inside = (frequency >= low) & (frequency <= high)
    if inside.sum() < MIN_LINES:
        return None
    centre = 2 * np.pi * frequency[peak]
    s = 2j * np.pi * frequency[inside] / centre  # scaled so that the peak is at s = j
    pole = _output_error_pole(s, response[inside] / np.abs(response[inside]).max(), half)
    if pole is None or pole.real >= 0 or not s[0].imag <= pole.imag <= s[-1].imag:
        return None
    return pole * centre


def _output_error_pole(s: Complexes, response: Complexes, half: int) -> complex | None:
    """Pole of (n_0 + n_1 s + n_2 s^2) / (s - p) fitted to the response."""
    shift = s - 1j
    powers = shift[:, None] ** np.arange(NUMERATOR)
    pole = complex(-half * abs(s[1] - s[0]), 0.0)  # relative to s = j
    for _ in range(4):  # linearised: (s - p) G = numerator, weighted by the last pole
        weight = 1.0 / (shift - pole)
        columns = np.concatenate([powers, response[:, None]], axis=1) * weight[:, None]
        solution = np.linalg.lstsq(columns, shift * response * weight, rcond=None)[0]
        pole = complex(solution[-1])
        if pole.real >= 0:
            pole = complex(-abs(pole.real) - 1e-9, pole.imag)
    for _ in range(ROUNDS):  # output error: numerator is solved for, the pole follows by Gauss-Newton
        inverse = 1.0 / (shift - pole)
        columns = powers * inverse[:, None]
        numerator = np.linalg.lstsq(columns, response, rcond=None)[0]
        model = columns @ numerator
        full = np.concatenate([columns, (model * inverse)[:, None]], axis=1)
        step = complex(np.linalg.lstsq(full, response - model, rcond=None)[0][-1])
        limit = 0.5 * abs(pole.real)
        step *= min(1.0, limit / abs(step)) if step else 1.0
        pole += step
        if abs(step) < 1e-9:
            break
        if not np.isfinite(pole.real):
            return None
    return pole + 1j

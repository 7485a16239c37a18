"""What a channel says about itself: noise and drift from repetition to repetition."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.intake.passing import ANGLES

Array = NDArray[np.float64]

NOISE_IN_WORDS = "noise cannot be told from what the rig does, so that small effects stay hidden"
# A change counts as drift beyond this many standard deviations of what white noise does ...
BEYOND_NOISE = 6.0
# ... and this part of the channel's rms (its mean left out).
LEVEL = 1e-3
# Ratio of the scatter's rms in the noisiest half repetition to that in the quietest, beyond what chance makes of it.
GROWTH = 1.2


def noise_of(repetitions: Array) -> float:
    """Rms of one sample's random part from the differences of successive repetitions (P, N), P >= 2; white or not."""
    change = np.diff(repetitions, axis=0)
    return float(np.sqrt((change - change.mean(axis=1, keepdims=True)).var() / 2))


def drift_of(periods: Mapping[str, Array], base_radii: tuple[float, float], notes: list[str]) -> float:
    """Largest change of level of any channel over its repetitions, relative to its rms; 0 where noise explains it.

    Appends a sentence to `notes` for the channel that drifts most and for the one whose scatter grows most.
    """
    ratio = base_radii[0] / base_radii[1]
    size = {name: float(repetitions.std()) for name, repetitions in periods.items()}
    if set(ANGLES) <= set(size):
        # A gear held at constant speed has no motion to measure its drift by: take the other one's.
        size["angle_driven"] = max(size["angle_driven"], size["angle_driver"] * ratio)
        size["angle_driver"] = max(size["angle_driver"], size["angle_driven"] / ratio)
    drifts = {name: _level_change(one) / size[name] for name, one in periods.items() if size[name] > 0.0}
    worst = max(drifts, key=lambda name: drifts[name], default="")
    found = drifts.get(worst, 0.0)
    found = found if found > LEVEL else 0.0
    if found:
        notes.append(
            f"{worst} drifts: over the record its level changes by {100 * found:.2g} % of its rms, more than noise"
            " explains; such slow changes do not come from the gears"
        )
    _tell_growth(periods, base_radii, size, notes)
    return found


def _tell_growth(
    periods: Mapping[str, Array], base_radii: tuple[float, float], size: Mapping[str, float], notes: list[str]
) -> None:
    """Append a sentence for the channel whose scatter grows most, if it does. What both gears turn on otherwise from
    one repetition to the next is the speed's, and no noise of an angle: these are judged by what they differ by."""
    scatter = {name: repetitions for name, repetitions in periods.items() if size[name] > 0.0}
    angles = [scatter.pop(name) for name in ANGLES] if set(ANGLES) <= set(scatter) else []
    growths = {name: _growth(one, size[name]) for name, one in scatter.items()}
    if angles:
        one, two = (radius * angle for radius, angle in zip(base_radii, angles, strict=True))
        growths["the transmission error"] = _growth(one - two, float((one - two).std()))
    noisiest = max(growths, key=lambda name: growths[name], default="")
    samples = next(iter(periods.values())).shape[1] if periods else 1
    limit = GROWTH + BEYOND_NOISE / np.sqrt(samples / 2)
    if noisiest and growths[noisiest] > limit:
        notes.append(
            f"the scatter of {noisiest} changes {growths[noisiest]:.3g}-fold within the record (limit {limit:.3g}):"
            " its noise is not steady, so that small effects stay hidden"
        )
    elif angles and _growth(one + two, float((one - two).std())) > limit:
        change = float(np.abs(np.diff(one + two, axis=0)).max()) / 2
        notes.append(
            "the speed wanders: from one repetition to the next both gears turn on otherwise by up to"
            f" {1e6 * change:.2g} um on their base circles, which is no noise of the angles"
        )


def _level_change(repetitions: Array) -> float:
    """Spread of the repetition means beyond what white noise explains; 0 within it."""
    means = repetitions.mean(axis=1)
    spread = float(np.ptp(means))
    limit = BEYOND_NOISE * noise_of(repetitions) * np.sqrt(2.0 / repetitions.shape[1])
    return spread if spread > limit else 0.0


def _growth(repetitions: Array, size: float) -> float:
    """Ratio of the largest to the smallest rms of repetition differences over half repetitions; 1 for noise that is too
    small to matter."""
    change = np.diff(repetitions, axis=0)
    change = change - change.mean(axis=1, keepdims=True)
    half = repetitions.shape[1] // 2
    rms = np.sqrt((change[:, : 2 * half].reshape(-1, half) ** 2).mean(axis=1))
    return float(rms.max() / max(rms.min(), LEVEL * size)) if rms.max() > LEVEL * size else 1.0

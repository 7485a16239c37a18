"""Does the record repeat after a joint period of excitation and mesh, and the force after no other one?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import Look

# Part of the rms fluctuation that may differ from period to period.
SCATTER = 0.1
# The same of the force beyond which the declared period is none of its: an average over noise of half its size would
# say nothing either.
OTHER = 0.5
# Part of its rms that a force may differ by after a period that is one; where the record holds a single declared
# period, so that nothing else speaks against that.
REPEATS, ALONE = 0.2, 0.02
# Periods that are looked for leave this part of the record to compare, and one counts as a part of the declared one
# when they differ by this part of it.
COMPARED, PART = 0.25, 0.1


def periods_repeat(look: Look) -> list[Finding]:
    """Periods are alike; what differs from one to the next is said as a share. It is noise to an identification, which
    finds it in its residual and counts it in its variance."""
    joint = look.joint_samples
    if joint is None:
        return []
    found = []
    for name, values in (("the dte", look.stored_or_own_dte), ("the force", look.force)):
        if values is None:
            continue
        rows = values.reshape(-1, joint)
        mean = rows.mean(axis=0)
        swing = float(mean.std())
        scatter = float(np.sqrt(((rows - mean) ** 2).sum() / (rows.size - joint)))
        if swing > 0 and scatter > SCATTER * swing and scatter > 1e-12 * float(np.abs(values).max()):
            found.append(
                Finding(
                    f"{name} does not repeat from period to period of {joint / look.rate:.4g} s: {scatter / swing:.2g}"
                    f" of its rms fluctuation differs (limit {SCATTER:g}); noise, drift or what turns with a shaft",
                    refused=False,
                )
            )
    return found


def force_repeats_as_declared(look: Look) -> list[Finding]:
    """The force repeats after samples_per_period, or after a whole part of it: an average over another period mixes
    what does not belong together, and a record that ends within a period of the force has lines that nothing
    excites."""
    force, declared = look.force, int(look.record.attrs["samples_per_period"])
    if force is None or not look.steady or not np.ptp(force) > 1e-9 * np.abs(force).max():
        return []
    joint = look.joint_samples
    differs = differences(force - force.mean())
    own = float(differs[joint]) if joint is not None and joint < differs.size else None
    limit = REPEATS if own is not None and own > OTHER else ALONE
    other = _repeats(differs, limit)
    rate = f"{declared} ({declared / look.rate:.4g} s)"
    if other is not None and (own is None or own > OTHER) and not _whole(declared / other, other):
        return [
            Finding(
                f"the force repeats every {other} samples ({other / look.rate:.4g} s; {differs[other]:.2g} of its rms"
                f" differs, limit {limit:g}), but samples_per_period = {rate} holds {declared / other:.4g} of these"
                " and must hold a whole number: wrong samples_per_period, or a truncated record"
            )
        ]
    if own is not None and own > OTHER:
        return [
            Finding(
                f"the force does not repeat after samples_per_period = {rate}: {own:.2g} of its rms differs (limit"
                f" {OTHER:g})"
            )
        ]
    return []


def differences(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rms (lags,) of the difference of a signal (n,) without mean and itself some samples later over sqrt(2) times its
    own rms there: 1 where both have nothing in common, 0 after a period. By the transform of the correlation."""
    size = values.size
    spectrum = np.fft.rfft(values, 2 * size)
    shared = np.fft.irfft(np.abs(spectrum) ** 2, 2 * size)[:size]
    power = np.concatenate([[0.0], np.cumsum(values**2)])
    both = power[size:0:-1] + power[size] - power[:size]  # of the first and the last size - lag samples
    lags = int((1.0 - COMPARED) * size)
    return np.asarray(np.sqrt(np.maximum(1.0 - 2 * shared[:lags] / both[:lags], 0.0)))


def _repeats(differs: NDArray[np.float64], limit: float) -> int | None:
    """The shortest lag after which a signal is the same, as far as it is at the best one; None if there is none. Its
    own slow motion, before it first has nothing in common with itself, is no period."""
    apart = np.flatnonzero(differs > 0.7)
    if not apart.size:
        return None
    first = int(apart[0])
    least = float(differs[first:].min())
    if least > limit:
        return None
    good = first + np.flatnonzero(differs[first:] <= max(2 * least, 1e-3))
    last = int(good[0])  # the end of the first dip
    while last + 1 < differs.size and differs[last + 1] < differs[last]:
        last += 1
    return last


def _whole(times: float, period: int) -> bool:
    """Whether a declared period is that many whole ones, as far as a period that is known to half a sample can tell."""
    return abs(times - round(times)) < max(PART, 0.6 * times / period) and round(times) >= 1

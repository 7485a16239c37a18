"""Force and dte on clocks that run at different rates: what lies between them grows along the record.

With a clock that runs fast by r the response to the same lines turns by exp(-j w r t). The mean response of the first
half of the record against that of the second tells r from the phases of all lines: a slope over frequency that no rig
has, as both halves hold the same rig at the same mesh phases. Sidebands of the mesh and noise scatter these phases:
neighbouring lines, that a drift turns alike, tell how much, and what scatters at random counts for nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import EXCITED, Look

Array = NDArray[np.float64]

# Segments of each half, windowed and averaged; blocks of neighbouring lines, fewest lines, and fewest blocks whose
# lines agree beyond chance: by COHERENT times the resultant that random phases have.
SEGMENTS, BLOCKS, FEWEST, FEWEST_BLOCKS, COHERENT = 4, 24, 240, 6, 3.0
# A drift is believed beyond so many of its standard deviations, and said if it costs this part of the response.
SURE, COSTS = 6.0, 0.02
# Largest drift looked for [s over half of the record], as turns of the highest line.
TURNS = 3.0
STEPS = 401
FINEST = 1e-9  # of incoherence, so that phases without noise have a weight
WHOLE = 1e-6


def clocks_keep_pace(look: Look) -> list[Finding]:
    """The delay between force and dte is the same in both halves of the record.

    Only for records of constant speed that hold whole mesh periods in either half: others change from half to half.
    """
    force, error = look.force, look.stored_or_own_dte
    if force is None or error is None or look.number("mesh_period") is None:
        return []
    halves = _halves(look, force, error)
    if halves is None:
        return []
    omega, turned, response, seconds = halves
    found = delay_between(omega, turned)
    if found is None:
        return []
    shift, deviation = found
    rate, duration = shift / seconds, look.samples / look.rate
    cost = _cost(omega * rate * duration, response)
    if cost < COSTS:
        return []
    goes = "falls behind" if shift > 0 else "runs ahead of"
    return [
        Finding(
            f"the dte {goes} the force by {1e6 * abs(shift):.2g} us in {seconds:.3g} s (standard deviation"
            f" {1e6 * deviation:.1g} us), as on clocks that differ by {1e6 * abs(rate):.2g} ppm, or where one has lost"
            f" samples: resample one channel to the other's clock; it costs about {min(cost, 1.0):.0%} of the response",
            refused=False,
            error=min(cost, 1.0),
        )
    ]


def _halves(
    look: Look, force: Array, error: Array
) -> tuple[Array, NDArray[np.complex128], Array, float] | None:
    """Of excited frequencies [rad/s]: the second half's response times the conjugate of the first one's, and the size
    of the response; and the time between the halves' middles [s]. None where the record has too little."""
    half = look.samples // 2
    cycles = half / look.rate / (look.mesh_period or 1.0)
    if half < 64 or abs(cycles - round(cycles)) > WHOLE * max(cycles, 1.0) or round(cycles) < 1:
        return None
    size = 2 * half // (SEGMENTS + 1)
    window = np.hanning(size)
    sums: list[tuple[NDArray[np.complex128], Array]] = []
    for first in (0, half):
        cross, power = np.zeros(size // 2 + 1, dtype=complex), np.zeros(size // 2 + 1)
        for number in range(SEGMENTS):
            start = first + number * (half - size) // (SEGMENTS - 1)
            u, y = (np.fft.rfft(window * (x[start : start + size] - x.mean())) for x in (force, error))
            cross += u.conj() * y
            power += np.abs(u) ** 2
        sums.append((cross, power))
    strength = np.minimum(sums[0][1], sums[1][1])
    lines = np.flatnonzero(strength >= EXCITED**2 * strength.max())
    lines = lines[lines > 1]
    if lines.size < FEWEST:
        return None
    one, two = (cross[lines] / power[lines] for cross, power in sums)
    omega = 2 * np.pi * lines * look.rate / size
    turned = np.asarray(one.conj() * two, dtype=complex)
    return np.asarray(omega), turned, np.sqrt(np.abs(turned)), half / look.rate


def delay_between(omega: Array, turned: NDArray[np.complex128]) -> tuple[float, float] | None:
    """The delay [s] that turns the phases of `turned` (lines,) back best, and its standard deviation [s]; None where it
    is none beyond chance, of all the delays that are tried.

    Of n unit phasors with a resultant R the coherence is g = (R^2 - n) / (n^2 - n), and the variance of its phase
    (1 - g) / (2 n g) (Bendat and Piersol, "Random Data", 4th ed. 2010, Eq. 9.91, for n averages).
    """
    unit = turned / np.maximum(np.abs(turned), np.finfo(float).tiny)
    blocks = np.array_split(np.arange(omega.size), BLOCKS)
    resultant = np.array([unit[own].sum() for own in blocks])
    middle = np.array([omega[own].mean() for own in blocks])
    count = np.array([own.size for own in blocks])
    kept = np.abs(resultant) > COHERENT * np.sqrt(count)
    if np.count_nonzero(kept) < FEWEST_BLOCKS:
        return None
    resultant, middle, count = resultant[kept], middle[kept], count[kept]
    coherence = np.minimum((np.abs(resultant) ** 2 - count) / (count**2 - count), 1 - FINEST)
    weight = 2 * count * coherence / (1 - coherence)
    phasor = resultant / np.abs(resultant)

    reach = TURNS * 2 * np.pi / float(omega[-1])
    delays = np.linspace(-reach, reach, STEPS)
    score = (np.exp(1j * np.outer(delays, middle)) @ (weight * phasor)).real
    best = float(delays[int(np.argmax(score))])
    phase = np.angle(phasor * np.exp(1j * middle * best))
    stiffness = float(weight @ middle**2)
    best -= float((weight * middle) @ phase) / stiffness
    left = np.angle(phasor * np.exp(1j * middle * best))
    scale = max(1.0, float(weight @ left**2) / (phase.size - 1))
    gained = float(weight @ (np.cos(left) - phasor.real))
    deviation = float(np.sqrt(scale / stiffness))
    sure = abs(best) > SURE * deviation and gained > 0.5 * SURE**2 * scale
    return (best, deviation) if sure else None


def _cost(turns: Array, response: Array) -> float:
    """Relative rms error of a response that turns by 0 .. `turns` [rad] along the record and is averaged over it."""
    mean = np.exp(-0.5j * turns) * np.sinc(turns / (2 * np.pi))
    return float(np.sqrt(np.sum(np.abs((1 - mean) * response) ** 2) / np.sum(response**2)))

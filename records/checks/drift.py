"""Force and dte on clocks that run at different rates: what lies between them grows along the record.

With a clock that runs fast by r the response to the same lines turns by exp(-j w r t). The mean response of the first
half of the record against that of the second tells r from the phases of all lines: a slope over frequency that no rig
has, as both halves hold the same rig at the same mesh phases. Sidebands of the mesh and noise scatter these phases;
how much they scatter says what can be told.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.records.checks.finding import Finding
from gearbench.records.checks.look import EXCITED, Look

Array = NDArray[np.float64]

# Segments of each half, windowed and averaged, and groups of lines whose scatter tells the deviation; fewest lines.
SEGMENTS, GROUPS, FEWEST = 4, 24, 240
# A drift is believed beyond so many of its standard deviations, and said if it costs this part of the response.
SURE, COSTS = 6.0, 0.02
# Largest drift looked for [s over half of the record], as turns of the highest line.
TURNS = 3.0
STEPS = 401
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
    shift, deviation = _shift(omega, turned)
    if not abs(shift) > SURE * deviation:
        return []
    rate, duration = shift / seconds, look.samples / look.rate
    cost = _cost(omega * rate * duration, response)
    if cost < COSTS:
        return []
    goes = "falls behind" if shift > 0 else "runs ahead of"
    return [
        Finding(
            f"the dte {goes} the force by {1e6 * abs(shift):.2g} us in {seconds:.3g} s (standard deviation"
            f" {1e6 * deviation:.1g} us), as on clocks that differ by {1e6 * abs(rate):.2g} ppm: resample one channel"
            f" to the other's clock; it costs about {min(cost, 1.0):.0%} of the response",
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


def _shift(omega: Array, turned: NDArray[np.complex128]) -> tuple[float, float]:
    """The delay [s] that turns all phases back best, and its standard deviation from how groups of lines differ."""
    unit = turned / np.maximum(np.abs(turned), np.finfo(float).tiny)
    reach = TURNS * 2 * np.pi / float(omega[-1])
    delays = np.linspace(-reach, reach, STEPS)
    score = (np.exp(1j * np.outer(delays, omega)) @ unit).real
    best = float(delays[int(np.argmax(score))])
    groups = [np.arange(number, omega.size, GROUPS) for number in range(GROUPS)]
    found = []
    for own in groups:
        phase = np.angle(unit[own] * np.exp(1j * omega[own] * best))
        found.append(float(omega[own] @ phase) / float(omega[own] @ omega[own]))
    steps = np.array(found)
    return best - float(steps.mean()), float(steps.std(ddof=1)) / np.sqrt(GROUPS)


def _cost(turns: Array, response: Array) -> float:
    """Relative rms error of a response that turns by 0 .. `turns` [rad] along the record and is averaged over it."""
    mean = np.exp(-0.5j * turns) * np.sinc(turns / (2 * np.pi))
    return float(np.sqrt(np.sum(np.abs((1 - mean) * response) ** 2) / np.sum(response**2)))

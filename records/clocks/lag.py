"""A force and a dte on different clocks: no passive rig answers before it is pushed, or half a turn and more behind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.records.clocks.delays import delays_of
from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import EXCITED, Look
from gearbench.records.seen.mesh_force import accounts_of

Array = NDArray[np.float64]

# Bands into which lines are put together: what the mesh turns into sidebands averages out in them. Fewest lines of one.
BANDS, FEWEST = 40, 8
# Part of the work over all bands that may be negative, and by how much less a delay must leave of it to be believed.
# Seven lumped rigs without a lag leave none (docs/identification.md, "What a record is checked for").
LIMIT, EXPLAINED = 0.1, 0.25
# Negative work counts so many times when a delay is chosen.
AGAINST = 20.0
MOST_LINES = 4000


def force_and_dte_in_step(look: Look) -> list[Finding]:
    """The force does no negative work on the dte in any band of frequencies (a driving point; passivity), or a delay
    between both makes it so.

    For records whose channels give no account of the mesh force; of others `clocks_agree` knows which channel lags.
    """
    force, error = look.force, look.stored_or_own_dte
    if force is None or error is None or accounts_of(look) is not None:
        return []
    omega, work = _work(look, force, error)
    if omega.size < BANDS * FEWEST:
        return []
    delays = delays_of(look, omega)
    before = _negative(omega, work, 0.0)[1]
    if before <= LIMIT:
        return []
    delay = max(delays, key=lambda one: _negative(omega, work, float(one))[0])
    after = _negative(omega, work, float(delay))[1]
    if after > EXPLAINED * before:
        return []
    cost = np.abs(1 - np.exp(1j * omega * delay))
    share = np.abs(work) / omega  # the response's size over a flat force's
    error_of = float(np.sqrt(np.sum((cost * share) ** 2) / np.sum(share**2)))
    words = "lags behind" if delay > 0 else "leads"
    return [
        Finding(
            f"the dte {words} the force by about {1e6 * abs(delay):.2g} us ({abs(delay) * look.rate:.2g} samples):"
            f" {before:.0%} of the force's work on it is negative (limit {LIMIT:.0%}), {after:.0%} without that lag;"
            " are they of two devices, or is the force not that at the gears? It costs about"
            f" {min(error_of, 2.0):.0%} of the response",
            refused=False,
            error=error_of,
        )
    ]


def _work(look: Look, force: Array, error: Array) -> tuple[Array, NDArray[np.complex128]]:
    """Angular frequencies of excited lines between the mesh harmonics, and on them conj(force) times rate."""
    driving, response = np.fft.rfft(force - force.mean()), np.fft.rfft(error)
    size = np.abs(driving)
    lines = np.flatnonzero(size >= EXCITED * size.max())
    lines = lines[lines > 0]
    if look.mesh_period is not None:
        cycles = lines * look.rate / look.samples * look.mesh_period
        lines = lines[np.abs(cycles - np.round(cycles)) > 1e-6]
    lines = lines[:: max(1, -(-lines.size // MOST_LINES))]
    omega = 2 * np.pi * lines * look.rate / look.samples
    return omega, np.conj(driving[lines]) * 1j * omega * response[lines]


def _negative(omega: Array, work: NDArray[np.complex128], delay: float) -> tuple[float, float]:
    """Work over all bands once the dte comes earlier by `delay` [s], negative one counted AGAINST times, over the sum
    of the lines' sizes; and the part of it that is negative."""
    turned = work * np.exp(1j * omega * delay)
    bands = np.add.reduceat(turned, np.linspace(0, omega.size, BANDS, endpoint=False).astype(int))
    negative = float(-np.minimum(bands.real, 0.0).sum())
    whole = float(np.abs(bands).sum())
    gained = float(bands.real.sum()) - (AGAINST - 1) * negative
    return gained / max(float(np.abs(work).sum()), 1e-300), negative / max(whole, 1e-300)

"""Spectra of force and DTE over one joint period of excitation and mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

# Largest departure of a joint period from a whole number of mesh periods [mesh periods].
WHOLE = 1e-6
# Excitation periods that an advice may ask for.
MOST_REPEATS = 1000
# Largest in-band change from the first to the last period, relative to the in-band response, of a steady state.
STEADY = 1e-3
# ... or relative to the change between the last two periods, which then is noise.
STEADY_AGAINST_NOISE = 1.3


class SpectraError(ValueError):
    """Signals that cannot be cut into whole mesh periods or spectra that do not belong together."""


@dataclass(frozen=True)
class Spectra:
    """DFT (divided by the number of samples) of force [N] and dte [m], each (realisations, lines 0..K).

    `spacing` [Hz] is the distance of lines, `mesh_lines` = d the number of lines between mesh harmonics,
    `start_phase` (realisations,) the mesh phase [cycles] of the first sample, `steady` whether the steady
    state was verified, `periods` how many joint periods were averaged, `repeats` how many excitation
    periods make a joint period (only every `repeats`-th line can be excited), `noise` (lines,) the variance
    of a line's dte from the scatter of the periods, or None, `angle_only` whether dte lacks the motion of the
    gear centres, `duration` [s] the joint period, and `samples` how many of them it has, or 0 where nothing can have
    come back from beyond half the sampling rate.
    """

    force: Complexes
    dte: Complexes
    spacing: float
    mesh_lines: int
    start_phase: Floats
    steady: bool
    periods: int = 1
    repeats: int = 1
    noise: Floats | None = None
    angle_only: bool = False
    samples: int = 0

    @property
    def realisations(self) -> int:
        """Number of realisations."""
        return self.force.shape[0]

    @property
    def highest(self) -> int:
        """Highest line K."""
        return self.force.shape[1] - 1

    @property
    def duration(self) -> float:
        """Length of the joint period [s]."""
        return 1.0 / self.spacing

    def relative(self) -> Floats:
        """Start phases relative to the first realisation's, in (-0.5, 0.5] cycles."""
        return -((self.start_phase[0] - self.start_phase + 0.5) % 1.0 - 0.5)


def joint_periods(samples: int, sampling_rate: float, periods: int, mesh_period: float) -> tuple[int, int]:
    """Excitation periods p in a joint period of excitation and mesh, and mesh periods d in it.

    `samples` [1] a period of excitation, `periods` of which are recorded. p is the smallest number that
    divides `periods` and makes p T_exc / T_mesh whole. Raises SpectraError if there is none.
    """
    ratio = samples / sampling_rate / mesh_period
    for repeats in range(1, periods + 1):
        whole = round(repeats * ratio)
        if periods % repeats == 0 and whole >= 1 and abs(repeats * ratio - whole) < WHOLE * max(1, whole):
            return repeats, whole
    raise SpectraError(
        f"the record of {periods * samples / sampling_rate:.4g} s spans {periods * ratio:.6g} mesh periods"
        f" ({periods} excitation period(s) of"
        f" {ratio:.6g} mesh periods); the identification needs a whole number of them{_advice(ratio, periods)}"
    )


def _advice(ratio: float, periods: int) -> str:
    """What would make excitation periods of `ratio` mesh periods whole."""
    tried = np.arange(1, MOST_REPEATS + 1)
    whole = tried[np.abs(tried * ratio - np.round(tried * ratio)) < WHOLE * np.maximum(1.0, tried * ratio)]
    least = next((int(n) for n in whole if round(n * ratio) >= 1), None)
    lengths = f"an excitation period of {int(ratio)} or {int(ratio) + 1} mesh periods" if ratio > 1 else "longer ones"
    if least is None:
        return f": record {lengths}"
    if least <= periods:
        return f": give a multiple of {least} excitation periods, which hold {round(least * ratio)} mesh periods"
    return f": record {least} excitation periods, which hold {round(least * ratio)} mesh periods, or {lengths}"


def require_mesh_periods(spectra: Spectra) -> None:
    """Raise SpectraError where all lines of a single realisation are mesh harmonics, which the operating response has
    too."""
    if spectra.mesh_lines == 1 and spectra.realisations == 1:
        raise SpectraError(
            f"the record of {spectra.duration:.4g} s holds one mesh period, in which the response to the excitation is"
            f" not told from the operating response; at least 2 mesh periods ({2 * spectra.duration:.4g} s) of one"
            " excitation period, or 2 realisations, are needed"
        )


def period_spectra(signal: Floats, joint: int, highest: int) -> tuple[Complexes, Complexes, Floats | None]:
    """Mean spectrum (lines 0..highest), spectra of the single joint periods, and the variance of the mean.

    `signal` (samples,) holds a whole number of joint periods of `joint` samples; the variance is None for
    one.
    """
    blocks = np.fft.rfft(signal.reshape(-1, joint), axis=1)[:, : highest + 1] / joint
    if blocks.shape[0] == 1:
        return blocks[0], blocks, None
    return blocks.mean(axis=0), blocks, blocks.var(axis=0, ddof=1) / blocks.shape[0]


def is_steady(blocks: Complexes, lines: NDArray[np.int64]) -> bool:
    """Whether the spectra (periods, lines) of successive periods repeat on the given lines.

    True if from the first to the last period they change by less than STEADY of their size, or by no more
    than the last two periods differ (noise); False for a single period, where nothing can be verified.
    """
    if blocks.shape[0] < 2:
        return False
    band = blocks[:, lines]
    size = np.linalg.norm(band[-1])
    change = np.linalg.norm(band[0] - band[-1])
    if change <= STEADY * size:
        return True
    noise = np.linalg.norm(band[-2] - band[-1])
    return bool(blocks.shape[0] > 2 and change <= STEADY_AGAINST_NOISE * noise)

"""Mesh stiffness and damping against phase in zones: what pairs of teeth that enter and leave make of them.

A pair enters and another leaves at one phase of the mesh each. Between these switches stiffness varies slowly, across
them fast: cubics with continuous slopes (Hermite; de Boor 1978), one for each zone and some across each switch, say
with a few numbers what takes a hundred harmonics.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.spectra.joint import Complexes, Floats

# Phases on which functions are sampled, and singular values of theirs below which they are the same function.
SAMPLED = 2048
SAME = 1e-8
# Difference by which derivatives with respect to switches and width are taken [cycles].
DIFFERENCE = 1e-4


@dataclass(frozen=True)
class Zones:
    """`switches`: two phases [cycles]; `width` of each switch [cycles]; `pieces`: cubics across a switch."""

    switches: tuple[float, float]
    width: float
    pieces: int

    @property
    def fits(self) -> bool:
        """Whether the switches leave a zone on either side that is as wide as they are."""
        apart = (self.switches[1] - self.switches[0]) % 1.0
        return self.width > 0.0 and 2 * self.width < min(apart, 1.0 - apart)

    @property
    def breaks(self) -> Floats:
        """Phases (2 pieces + 2,) that rise from the first one by less than 1, those of the first switch first."""
        across = self.width * (np.arange(self.pieces + 1) / self.pieces - 0.5)
        apart = (self.switches[1] - self.switches[0]) % 1.0
        return np.asarray(self.switches[0] % 1.0 + np.concatenate([across, apart + across]))

    def coefficients(self, harmonics: int) -> Complexes:
        """Fourier coefficients (Q, harmonics), l = 1.., of functions without mean, orthogonal and of unit rms."""
        sampled = hermite(self.breaks)
        sampled -= sampled.mean(axis=1, keepdims=True)
        size, vectors = np.linalg.eigh(sampled @ sampled.T / SAMPLED)
        kept = size > SAME * size[-1]
        return _harmonics((vectors[:, kept] / np.sqrt(size[kept])).T @ sampled, harmonics)

    def moves(self, mesh: Floats) -> Floats:
        """Derivatives (4 L, 3) of a `mesh` (4 L,) in these zones with respect to switches and width."""
        rise, fall = self.switches
        others = [
            replace(self, switches=(rise + DIFFERENCE, fall)),
            replace(self, switches=(rise, fall + DIFFERENCE)),
            replace(self, width=self.width + DIFFERENCE),
        ]
        own, *moved = (real_columns(_harmonics(hermite(zones.breaks), mesh.size // 4)) for zones in (self, *others))
        amplitudes = np.linalg.lstsq(own, mesh, rcond=1e-10)[0]
        return np.stack([(columns - own) @ amplitudes / DIFFERENCE for columns in moved], axis=1)


def hermite(breaks: Floats) -> Floats:
    """Periodic cubics with continuous slopes (2 m, SAMPLED) between `breaks` (m,), which rise by less than 1."""
    length = np.diff(breaks, append=breaks[0] + 1.0)
    after = (np.arange(SAMPLED) / SAMPLED - breaks[0]) % 1.0
    index: NDArray[np.int64] = np.searchsorted(breaks - breaks[0], after, side="right") - 1
    t = (after - (breaks - breaks[0])[index]) / length[index]
    here = np.arange(breaks.size)[:, None]
    begins, ends = index == here, (index + 1) % breaks.size == here
    values = begins * (1 - t**2 * (3 - 2 * t)) + ends * (t**2 * (3 - 2 * t))
    slopes = (begins * (t * (1 - t) ** 2) - ends * (t**2 * (1 - t))) * length[index]
    return np.asarray(np.concatenate([values, slopes]))


def _harmonics(sampled: Floats, harmonics: int) -> Complexes:
    return np.asarray(np.fft.rfft(sampled, axis=1)[:, 1 : harmonics + 1] / SAMPLED)


def real_columns(coefficients: Complexes) -> Floats:
    """(4 L, 2 Q) from the amplitudes of functions with these Fourier `coefficients` (Q, L), of k and then of c, to the
    mesh's part of `Model.vector`."""
    one = np.concatenate([coefficients.real.T, coefficients.imag.T])
    none = np.zeros_like(one)
    return np.asarray(np.block([[one, none], [none, one]]))

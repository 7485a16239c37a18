"""What an identification can be expected to err by: the record-length rule, truncation, and variance.

These are estimates from the identification itself, reported beside every result and never used to smooth it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import numpy as np

from gearbench.identification.lpm.estimate import LpmResult
from gearbench.identification.spectra.joint import Floats, Spectra

# E T_joint >= RULE (2L+1)(R+1) / B_3dB, T_joint of distinct excitation.
RULE = 3.0
# L f_mesh >= (highest - lowest natural frequency) + BANDWIDTHS half-power bandwidths.
BANDWIDTHS = 1.5
# Missing branches beyond this part of the ITF matter.
MISSING = 0.03


@dataclass(frozen=True)
class Accuracy:
    """Expected relative rms error of the ITF and what it is made of (all relative to the ITF's rms).

    `variance`: from the residuals; `truncation`: branches beyond L and what polynomials do not follow, from what the
    residuals hold above the noise; `record`: what doubtful channels of the records may cost; `expected`: all three
    together; `bound`: with the whole residual taken as missing response unless repeated periods tell the noise.
    """

    variance: float
    truncation: float
    record: float
    expected: float
    bound: float


@dataclass(frozen=True)
class RecordRule:
    """Record length that the rule asks for: `duration` [s] there is, `needed` [s], `harmonics_needed` branches."""

    duration: float
    needed: float
    bandwidth: float
    harmonics: int
    harmonics_needed: int

    @property
    def factor(self) -> float:
        """How many times too short the record is (below 1: long enough)."""
        return self.needed / self.duration


def expected_accuracy(result: LpmResult, record: float = 0.0) -> Accuracy:
    """Expected error of an identified ITF.

    `record`: what the findings about the records may cost; a wrong channel biases the response whatever is fitted
    to it, independently of variance and truncation, so that squares add.
    """
    power = np.sum(np.abs(result.htf) ** 2, axis=0).sum()
    spread = float(result.itf_covariance[0].real.sum())
    # Errors of least squares add to the power; those of a prior's mean, which is drawn to nothing, are missing in it.
    signal = max(power - spread, 0.1 * power) if result.open_share is None else power + spread
    variance = np.sqrt(spread / signal)
    truncation, missing = (np.sqrt(value / signal) for value in (result.missing, result.missing_bound))
    return Accuracy(
        float(variance),
        float(truncation),
        record,
        hypot(variance, truncation, record),
        hypot(variance, missing, record),
    )


def record_rule(
    spectra: Spectra, harmonics: int, order: int, natural: Floats, damping: Floats, truncation: float
) -> RecordRule | None:
    """The rule for natural frequencies [Hz] and damping ratios (mode, phase); None where no mode was found.

    `truncation`: expected part of the ITF beyond +-L. Where it matters, the branches that count are those that the
    first mode's travel asks for, if they are more than the L used.
    """
    if not natural.size or not np.isfinite(natural[0]).any():
        return None
    low, high = np.nanpercentile(natural[0], [2.0, 98.0])
    bandwidth = float(np.nanmedian(2 * damping[0] * natural[0]))
    mesh_frequency = spectra.mesh_lines * spectra.spacing
    wanted = int(np.ceil((high - low + BANDWIDTHS * bandwidth) / mesh_frequency))
    branches = 2 * (max(harmonics, wanted) if truncation > MISSING else harmonics) + 1
    duration = spectra.realisations * spectra.duration / spectra.repeats
    return RecordRule(duration, RULE * branches * (order + 1) / bandwidth, bandwidth, harmonics, wanted)

"""How far: the rms gap on the held-out record, from the nominal rig to the noise floor.

For each channel and band the rms of measured minus simulated, with the 90 % confidence interval of its expectation
over repetitions of the experiment with other phases. Two kinds of lines make it:

* lines of the rotation (multiples of a shaft order) come back in every repetition but for measurement noise: their
  energy |D + n|^2 has variance 2 s |D|^2 + s^2, s the noise energy of the line (repetitions' scatter, averaged over the
  band);
* all others depend on the phases of the excitation and count as complex Gaussian, one draw each: variance |G|^4,
  estimated by |G|^4 / 2 (E |G|^4 = 2 (E |G|^2)^2). With one repetition the rotation's lines count like these, since
  nothing tells their noise.

The sum is taken as chi-square with the degrees of freedom of that mean and variance (Satterthwaite 1946), which gives
low and high. The floor is the noise of the repetitions' mean with 2 (P - 1) degrees of freedom a line.

Band [0, 0] is the difference of the mean values, with the standard error of the repetitions' means. It is given where
zero means something: for angles if it is unloaded contact (`Measurement.zero_known`), for displacements if they are
about where the nominal supports come to rest, for the DTE if both are so, for the torque always.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from gearbench.bench.nonlinear.followed import follows
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import (
    CHANNELS,
    UNITS,
    about_rest,
    bands,
    frequencies,
    line_energy,
    measured_channels,
    noise_of_mean,
    rotation_lines,
    simulated_channels,
)
from gearbench.diagnosis.replay.adjustable import Simulate
from gearbench.diagnosis.verdict import Gap, Range
from gearbench.rig import Case

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Confidence of the intervals.
COVERAGE = 0.9
# Two-sided normal quantile of the same coverage.
_NORMAL = 1.6448536269514722


def gaps(
    nominal: Case,
    recalibrated: Case,
    with_effect: Case | None,
    held_out: Measurement,
    *,
    simulate: Simulate | None = None,
) -> tuple[Gap, ...]:
    """Gaps per channel (DTE first) and band on the held-out record, the nominal rig's beside those of better ones.

    `simulate(case, record)` gives one steady repetition (default: the replay on the non-linear lumped model). For each
    channel: the whole band first, then its parts, then the mean (band [0, 0]) where it is known. The driven angle has
    none where the replay turns that gear as recorded. Empty for a record whose mesh phase is arbitrary: a replay cannot
    be held against it. Raises what `simulate` raises, and DiagnosisError for a replay of another length.
    """
    if not held_out.phase_known:
        return ()
    if simulate is None:
        # Its time loop is compiled on import, which not every user of this module wants.
        from gearbench.bench.nonlinear.replay import replay

        simulate = replay
    cases = [nominal, recalibrated, *([] if with_effect is None else [with_effect])]
    simulated = [simulated_channels(held_out, simulate(case, held_out.record)) for case in cases]
    return gaps_of(held_out, simulated, "angle_driven" if follows(nominal.rig, held_out.record) else None)


def gaps_of(
    held_out: Measurement, simulated: Sequence[Mapping[str, Array]], given: str | None = None
) -> tuple[Gap, ...]:
    """The same from channels (channel -> (N,)) that are simulated already: of the nominal rig, of the recalibrated one
    and, where there is any, of the one with effects; `given`: the channel that replays take from the record."""
    repetitions, parts = measured_channels(held_out), bands(held_out)
    shown = ((0.0, parts[-1][1]), *parts) if len(parts) > 1 else parts
    found = []
    for channel in CHANNELS:
        if channel == given or channel not in repetitions or any(channel not in values for values in simulated):
            continue
        residuals = [repetitions[channel].mean(axis=0) - values[channel] for values in simulated]
        for band in shown:
            found.append(_band_gap(held_out, channel, band, repetitions[channel], residuals))
        if zero_known(held_out, channel, repetitions, simulated[0]):
            found.append(_mean_gap(held_out, channel, repetitions[channel], residuals))
    return tuple(found)


def zero_known(
    measurement: Measurement, channel: str, repetitions: Mapping[str, Array], nominal: Mapping[str, Array]
) -> bool:
    """Whether the mean value of a channel means something, by its repetitions (channel -> (P, N)) and the nominal rig's
    signals (channel -> (N,))."""
    displaced = [one for one in ("y_driver", "y_driven") if one in repetitions and one in nominal]
    if channel in displaced:
        return about_rest(float(repetitions[channel].mean()), float(nominal[channel].mean()))
    if channel == "dte" and len(displaced) > 1:
        seen, rest = (float((of[displaced[0]] - of[displaced[1]]).mean()) for of in (repetitions, nominal))
        return measurement.zero_known and about_rest(seen, rest)
    return measurement.zero_known or channel not in ("dte", "angle_driver", "angle_driven")


@dataclass(frozen=True)
class BandEnergy:
    """Energy of a signal in a band and the degrees of freedom of the chi-square that it is like."""

    energy: float
    freedom: float

    def rms(self) -> Range:
        """Root mean square with its interval."""
        value = float(np.sqrt(self.energy))
        if self.energy <= 0.0 or not np.isfinite(self.freedom):
            return Range(value=value, low=value, high=value)
        tail = (1 - COVERAGE) / 2
        chi_squared = 2 * gammaincinv(self.freedom / 2, [1 - tail, tail])  # its quantiles
        low, high = np.sqrt(self.energy * self.freedom / chi_squared)
        return Range(value=value, low=min(value, float(low)), high=max(value, float(high)))


def band_energy(energy: Array, repeats: Flags, noise: float | None) -> BandEnergy:
    """Sum of line energies (K,) with its effective degrees of freedom.

    `repeats` (K,): lines that come back in every repetition but for noise, whose energy a line is `noise` (None:
    unknown, so no line counts as such).
    """
    total = float(energy.sum())
    if noise is None:
        repeats = np.zeros_like(repeats)
    drawn = energy[~repeats]
    variance = 0.5 * float((drawn**2).sum())
    if noise is not None:
        steady = np.maximum(energy[repeats] - noise, 0.0)
        variance += float((2 * noise * steady + noise**2).sum())
    # Energy E of nu degrees of freedom has variance 2 E^2 / nu; a sum of squares has one at least, whatever its noise.
    return BandEnergy(total, max(2 * total**2 / variance, 1.0) if variance > 0 else np.inf)


def _band_gap(
    measurement: Measurement, channel: str, band: tuple[float, float], repetitions: Array, residuals: Sequence[Array]
) -> Gap:
    frequency = frequencies(measurement)
    inside = (frequency > band[0] * (1 + 1e-12)) & (frequency <= band[1] * (1 + 1e-12))
    repeats = rotation_lines(measurement)[inside]
    noise, floor = None, None
    if len(repetitions) > 1:
        lines = line_energy(noise_of_mean(repetitions)).sum(axis=0)[inside]
        noise = float(lines.mean())
        floor = BandEnergy(float(lines.sum()), 2 * (len(repetitions) - 1) * lines.size).rms()
    ranges = [band_energy(line_energy(one)[inside], repeats, noise).rms() for one in residuals]
    return _gap(measurement, channel, band, ranges, floor)


def _mean_gap(measurement: Measurement, channel: str, repetitions: Array, residuals: Sequence[Array]) -> Gap:
    error, floor = 0.0, None
    if len(repetitions) > 1:
        error = float(repetitions.mean(axis=1).std(ddof=1) / np.sqrt(len(repetitions)))
        floor = Range(value=error, low=0.0, high=_NORMAL * error)
    values = [abs(float(one.mean())) for one in residuals]
    reach = _NORMAL * error
    ranges = [Range(value=value, low=max(value - reach, 0.0), high=value + reach) for value in values]
    return _gap(measurement, channel, (0.0, 0.0), ranges, floor)


def _gap(
    measurement: Measurement,
    channel: str,
    band: tuple[float, float],
    ranges: Sequence[Range],
    floor: Range | None,
) -> Gap:
    return Gap(
        record=measurement.name,
        channel=channel,
        band_hz=band,
        unit=UNITS[channel],
        nominal=ranges[0],
        recalibrated=ranges[1],
        with_effect=ranges[2] if len(ranges) > 2 else None,
        floor=floor,
    )

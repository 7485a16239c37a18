"""Recalibration: the numbers of a rig that bring its replay closest to the records, by output-error Gauss-Newton.

Minimised over the parameters z (in standard deviations of their priors):

    J = sum_b 2 n_b log(s_b^2 + C_b) + |z - z_prior|^2,
    C_b = mean over the lines of block b of |measured - simulated|^2

A block is one record, channel, band, and either the rotation's lines or the others. Its variance is not known and
has been maximised out of the likelihood, so a block that the model cannot explain loses its weight by itself: that
is what makes the fit robust. s_b^2 is the noise of the repetitions' mean plus the square of a hundredth of the measured
level, below which no model is right (and where flanks separate now and then, J is too rough to descend). Neighbouring
lines err alike: a block counts as n_b <= 8 independent ones.

As log is concave, least squares with weights 2 n_b / (s_b^2 + C_b) bounds J from above: a full Gauss-Newton step
lowers J where the replay is linear. Elsewhere it is halved until it does, or not taken. The Jacobian comes from finite
differences at every step: one replay for each parameter and record. (Broyden's updates of it were tried: they left
the damping 6 % wrong after 20 steps where fresh ones need 5.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import (
    bands,
    frequencies,
    measured_channels,
    noise_of_mean,
    rotation_lines,
    simulated_channels,
)
from gearbench.diagnosis.replay.adjustable import Adjustable, Simulate
from gearbench.rig import Case

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]

FITTED = ("dte", "y_driver", "y_driven", "torque_driven")
# Independent lines that a block counts as, at most.
INDEPENDENT = 8
# Part of the measured level below which no model is right.
LEVEL = 1e-2
# Part of a channel's level that rounding leaves on its silent lines.
ROUNDING = 1e-6
# Finite-difference step, largest step and smallest gain worth another iteration [sd; sd; units of J].
DIFFERENCE, REACH, GAIN = 0.1, 3.0, 0.05
HALVINGS = 4


@dataclass(frozen=True)
class Recalibration:
    """Result: the moved case, its parameters' values (p,) and covariance (p, p) [SI], J before and after.

    `history`: J after each accepted step, falling. `replays`: how many were made.
    """

    case: Case
    names: tuple[str, ...]
    values: Array
    covariance: Array
    cost_before: float
    cost_after: float
    history: tuple[float, ...]
    replays: int

    @property
    def std(self) -> Array:
        """Standard deviations (p,) of the values."""
        return np.sqrt(np.diag(self.covariance))


def recalibrate(
    case: Case,
    parameters: Sequence[Adjustable],
    measurements: Sequence[Measurement],
    simulate: Simulate,
    *,
    iterations: int = 8,
) -> Recalibration:
    """The case with its parameters moved to where J is least near the start; never with a higher J.

    `simulate(case, record)` replays one steady repetition. Raises DiagnosisError without parameters or records; what
    the simulation of the case as given raises passes through, other failing rigs are steps not taken.
    """
    if not parameters or not measurements:
        raise DiagnosisError("recalibration needs at least one parameter and one record")
    search = _Search(_Target(measurements), case, tuple(parameters), simulate)
    return search.run(iterations)


class _Target:
    """Measured lines of all blocks in a row (K,), their blocks' floors and independent counts."""

    def __init__(self, measurements: Sequence[Measurement]) -> None:
        self.measurements = tuple(measurements)
        self.plan: list[tuple[int, str, NDArray[np.bool_]]] = []
        lines: list[Complex] = []
        labels: list[Integers] = []
        floors: list[float] = []
        counts: list[int] = []
        for number, one in enumerate(self.measurements):
            groups = _groups(one)
            kept = groups >= 0
            for channel, repetitions in measured_channels(one).items():
                if channel not in FITTED:
                    continue
                spectrum = _spectrum(repetitions.mean(axis=0))[kept]
                noise = np.zeros(spectrum.size)
                if len(repetitions) > 1:
                    noise = (np.abs(_spectrum(noise_of_mean(repetitions))) ** 2).sum(axis=0)[kept]
                self.plan.append((number, channel, kept))
                least = (ROUNDING**2) * float(np.mean(np.abs(spectrum) ** 2))
                lines.append(spectrum)
                label = np.empty(spectrum.size, dtype=np.int64)
                for group in np.unique(groups[kept]):
                    inside = groups[kept] == group
                    level = float(np.mean(np.abs(spectrum[inside]) ** 2))
                    label[inside] = len(floors)
                    floors.append(float(noise[inside].mean()) + LEVEL**2 * level + least + 1e-60)
                    counts.append(min(INDEPENDENT, int(inside.sum())))
                labels.append(label)
        self.lines = np.concatenate(lines)
        self.labels = np.concatenate(labels)
        self.floors = np.array(floors)
        self.counts = np.array(counts, dtype=float)
        self.sizes = np.bincount(self.labels).astype(float)

    def simulated(self, case: Case, simulate: Simulate) -> Complex:
        """The same lines (K,) of the case's replays."""
        replays = [simulated_channels(one, simulate(case, one.record)) for one in self.measurements]
        parts = []
        for number, channel, kept in self.plan:
            if channel not in replays[number]:
                raise DiagnosisError(f"the replay of {self.measurements[number].name} lacks channel {channel}")
            parts.append(_spectrum(replays[number][channel])[kept])
        return np.concatenate(parts)

    def variances(self, residual: Complex) -> Array:
        """s_b^2 + C_b of each block."""
        energy = np.bincount(self.labels, weights=np.abs(residual) ** 2, minlength=self.floors.size)
        return self.floors + energy / self.sizes

    def misfit(self, residual: Complex) -> float:
        """J without its prior."""
        return float(np.sum(2 * self.counts * np.log(self.variances(residual) / self.floors)))

    def weights(self, residual: Complex) -> Array:
        """Weight (K,) of each line in the least squares that bound J."""
        return (2 * self.counts / (self.variances(residual) * self.sizes))[self.labels]


@dataclass
class _Search:
    """Gauss-Newton over z = (value - start) / sd; counts replays."""

    target: _Target
    case: Case
    parameters: tuple[Adjustable, ...]
    simulate: Simulate
    replays: int = 0

    def __post_init__(self) -> None:
        self.start = np.array([one.get(self.case) for one in self.parameters])
        self.sd = np.array([one.sd for one in self.parameters])
        means = [one.mean for one in self.parameters]
        prior = np.array([value if mean is None else mean for value, mean in zip(self.start, means, strict=True)])
        self.prior = (prior - self.start) / self.sd
        self.low = (np.array([one.low for one in self.parameters]) - self.start) / self.sd
        self.high = (np.array([one.high for one in self.parameters]) - self.start) / self.sd

    def run(self, iterations: int) -> Recalibration:
        """Steps until they gain nothing more."""
        z = np.zeros(len(self.parameters))
        simulated = self._replay(z)
        cost = before = self._cost(z, simulated)
        jacobian = np.zeros((simulated.size, z.size), dtype=complex)
        history: list[float] = []
        for _ in range(iterations):
            jacobian = self._differences(z, simulated)
            found = self._step(z, simulated, cost, jacobian)
            if found is None:
                break
            z, simulated, cost = found
            history.append(cost)
            if len(history) > 1 and history[-2] - cost < GAIN:
                break
        covariance = np.linalg.inv(self._normal(simulated, jacobian)[0]).astype(np.float64)
        return Recalibration(
            self._at(z),
            tuple(one.name for one in self.parameters),
            self.start + self.sd * z,
            covariance * np.outer(self.sd, self.sd),
            before,
            cost,
            tuple(history),
            self.replays,
        )

    def _at(self, z: Array) -> Case:
        case = self.case
        for parameter, value, step in zip(self.parameters, self.start + self.sd * z, z, strict=True):
            # Unmoved numbers stay as they are written, to the last bit.
            case = parameter.set(case, float(value)) if step else case
        return case

    def _replay(self, z: Array) -> Complex:
        self.replays += len(self.target.measurements)
        return self.target.simulated(self._at(z), self.simulate)

    def _try(self, z: Array) -> Complex | None:
        try:
            answer = self._replay(z)
        except ValueError:
            return None
        return answer if np.isfinite(answer).all() else None

    def _cost(self, z: Array, simulated: Complex) -> float:
        return self.target.misfit(self.target.lines - simulated) + float(np.sum((z - self.prior) ** 2))

    def _differences(self, z: Array, simulated: Complex) -> Complex:
        """Jacobian (K, p) per sd, one-sided, downwards where upwards is no rig; a column of zeros where neither is."""
        columns = np.zeros((simulated.size, z.size), dtype=complex)
        for number in range(z.size):
            for step in (DIFFERENCE, -DIFFERENCE):
                moved = z.copy()
                moved[number] += step
                if not self.low[number] <= moved[number] <= self.high[number]:
                    continue
                answer = self._try(moved)
                if answer is not None:
                    columns[:, number] = (answer - simulated) / step
                    break
        return columns

    def _normal(self, simulated: Complex, jacobian: Complex) -> tuple[Array, Array]:
        """Normal matrix (p, p) and gradient (p,) of the data, prior in the matrix."""
        residual = self.target.lines - simulated
        weighted = self.target.weights(residual)[:, None] * jacobian
        matrix = (jacobian.conj().T @ weighted).real + np.eye(jacobian.shape[1])
        return matrix, (weighted.conj().T @ residual).real

    def _step(
        self, z: Array, simulated: Complex, cost: float, jacobian: Complex
    ) -> tuple[Array, Complex, float] | None:
        """The first of the full, half, quarter ... steps that lowers J: new z, its lines, its J."""
        matrix, slope = self._normal(simulated, jacobian)
        step = np.linalg.solve(matrix, slope + self.prior - z)
        step *= min(1.0, REACH / max(float(np.abs(step).max()), np.finfo(float).tiny))
        for halving in range(HALVINGS + 1):
            moved = np.clip(z + step * 0.5**halving, self.low, self.high)
            answer = self._try(moved)
            if answer is not None and (lower := self._cost(moved, answer)) < cost:
                return moved, answer, lower
        return None


def _spectrum(values: Array) -> Complex:
    spectrum: Complex = np.fft.rfft(values, axis=-1) / values.shape[-1]
    return spectrum


def _groups(measurement: Measurement) -> Integers:
    """Block (N // 2 + 1,) of each line: two for each band, -1 for lines outside all of them and the mean."""
    frequency = frequencies(measurement)
    turning = rotation_lines(measurement)
    groups = np.full(frequency.size, -1, dtype=np.int64)
    for number, (low, high) in enumerate(bands(measurement)):
        inside = (frequency > low * (1 + 1e-12)) & (frequency <= high * (1 + 1e-12))
        groups[inside] = 2 * number + turning[inside]
    return groups

"""Sidebands beyond half the sampling rate, which come back into the record unless a filter kept them out.

A record does not say if there was a filter. A line M of the response is sampled as M - q S, S the samples of the joint
period, q the whole number nearest M / S (Oppenheim and Schafer 2010, section 4.2), times one number a: 1 without a
filter, 0 behind an ideal one. The model's own lines beyond half the rate foretell what comes back, and the residual
tells a beside all parameters of the model. What the parameters have taken in of it is in the same least squares:

    r = J p + a f        r residual, f folded lines, J derivatives.

Where lines fold inside their residue class the model shows them with its response, derivatives and all
(`ClassData.sampled`); elsewhere they are subtracted as foretold.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.refine import Refined, response, told_beside
from gearbench.identification.spectra.joint import Complexes, Floats

# Squared size of the folded lines over the noise of one equation below which they move nothing by more than a third of
# a deviation.
FELT = 0.1
# Deviations from both 0 and 1 beyond which neither a perfect filter nor none is believed.
NEITHER = 4.0


@dataclass(frozen=True)
class Folding:
    """`part` of the lines beyond half the sampling rate that is in the record, 0 to 1, what it may be off by,
    `lines` (C, S, E) that they make at part 1, in units of the data, and `shift` (P,) of the model's parameters that
    these make unless they are subtracted."""

    part: float
    deviation: float
    lines: Complexes
    shift: Floats

    @property
    def size(self) -> float:
        """Root of the lines' squared sum."""
        return float(np.linalg.norm(self.lines))

    def like(self, other: Folding | None, noise: float) -> bool:
        """Whether another one takes as good as the same out of data of this `noise`."""
        apart = self.part * self.lines - (other.part * other.lines if other is not None else 0.0)
        return float(np.sum(np.abs(apart) ** 2)) < FELT * noise

    def removed(self, data: ClassData) -> ClassData:
        """The data `without` them."""
        return without(data, self.lines, self.part)

    def counted(self, fit: Refined) -> Refined:
        """The fit with what the part may be off by in its covariance."""
        return replace(fit, root=np.column_stack([fit.root, self.deviation * self.shift]))


def without(data: ClassData, lines: Complexes, part: float = 1.0) -> ClassData:
    """The data without a `part` of folded `lines` (C, S, E): those of a model that foretells them with its response and
    its derivatives, where they fold inside the classes, else subtracted as they are."""
    return replace(data, part=part) if data.folds_inside else replace(data, dte=data.dte - part * lines)


def folding_of(fit: Refined, data: ClassData, believed: float) -> Folding | None:
    """What of the model's lines beyond half the sampling rate the `data`, as recorded, hold; None where these are
    nothing beside the noise. `believed` as in `likely`."""
    lines = folded_of(fit, data)
    if lines is None:
        return None
    told, deviation, shift = told_beside(fit, data, lines)
    return Folding(*likely(told, deviation, believed), lines, shift)


def folded_of(fit: Refined, data: ClassData) -> Complexes | None:
    """`folded` lines of the model; None where these are nothing beside the noise."""
    if not data.folds:
        return None
    lines = folded(response(fit.model, data), data)
    felt = np.sum(np.abs(lines[data.valid]) ** 2)
    return lines if felt > FELT * fit.noise else None


def clear_lines(lines: Complexes, data: ClassData, noise: float) -> NDArray[np.bool_]:
    """Lines (C, S) onto which less folds than there is noise, and half of them at least."""
    power = np.sum(np.abs(lines) ** 2, axis=2) / lines.shape[2]
    return np.asarray(power <= max(noise, float(np.median(power[data.valid]))))


def likely(told: float, deviation: float, believed: float) -> tuple[float, float]:
    """The part that is in the record, and its deviation, where the residual has `told` it within a `deviation`.

    There was a filter or there was none, each as likely as the other at first: the part is the probability of none, by
    Bayes. Where neither agrees with what is told (harmonics, which their prior holds back, tell less than the whole),
    the part is the `believed` one, 0 or 1, and off by its distance from what is told.
    """
    if min(abs(told), abs(told - 1.0)) > NEITHER * deviation:
        return believed, min(abs(told - believed), 1.0)
    part = float(expit((told - 0.5) / max(deviation**2, np.finfo(float).tiny)))
    return part, float(np.sqrt(part * (1.0 - part)))


def folded(seen: Complexes, data: ClassData) -> Complexes:
    """What comes back (C, S, E) of the lines beyond half the sampling rate of `seen` (C, S, E), on lines that hold dte.

    Records were delayed to mesh phase 0 as if each line were where it is seen: what comes from q S lines further is
    turned by 2 pi q S start / d more.
    """
    furthest, samples, runs = data.furthest, data.samples, seen.shape[2]
    two_sided = np.zeros((2 * furthest + 1, runs), dtype=complex)
    for sign, values in ((1, seen), (-1, seen.conj())):
        two_sided[furthest + sign * data.lines[data.modelled]] = values[data.modelled]
    line = np.arange(-furthest, furthest + 1)
    times = np.round(line / samples).astype(int)
    found = np.zeros_like(two_sided)
    for q in np.unique(times[times != 0]):
        own = times == q
        turn = np.exp(2j * np.pi * ((q * samples * data.start_phase) % data.mesh_lines) / data.mesh_lines)
        # Realisations were rotated after they had been delayed, by a reflection, which is its own inverse.
        found[line[own] - q * samples + furthest] += two_sided[own] @ data.rotation @ (turn[:, None] * data.rotation)
    return np.asarray(np.where(data.dte != 0, found[data.lines + furthest], 0.0))

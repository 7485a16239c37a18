"""The smallest size of an effect that records would name, and what else explains an effect of that size.

With I the information, C the posterior covariance under a prior and d the effect's unknowns, each a standard deviation
of its wide prior, an effect of size a raises the evidence of a hypothesis over the background by

    a^2 d' I (C_hypothesis - C_background) I d / 2 + constants,

which is what `evidence.separable` has on average over a prior. It is named from the size on at which that clears the
limit of the selection, or a judged record that had no part in the search makes up for what it lacks up to that, priors
of a good rig do not hold as much, and the judged record's gap grows without it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.detection.information import Known, Without
from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.evidence.calibration import LIMITS
from gearbench.diagnosis.evidence.separable import APART
from gearbench.diagnosis.judging.closing import DUE, GAIN, growth_of
from gearbench.diagnosis.selection.rivals import ALIKE, NEARLY
from gearbench.diagnosis.selection.selection import known_within
from gearbench.diagnosis.selection.weighing import Weighed, entering, is_own, limit_of

Array = NDArray[np.float64]

LARGEST = 10.0  # wide standard deviations: nothing larger is looked for
LEAST = 1e-3
HALVINGS = 30
SIZES = 60  # at which rivals are compared
SEED = 12
NOTHING = Without()


@dataclass(frozen=True, eq=False)
class View:
    """What is known if something is left `without`, with `quiet` times the variance of the noise, where the best rig
    leaves the part `left` of the level of every block; `sharper`: times as much information."""

    known: Known
    hypotheses: tuple[Hypothesis, ...]
    without: Without = NOTHING
    quiet: float = 1.0
    left: float = 0.0
    sharper: float = 1.0

    @cached_property
    def information(self) -> Array:
        """Information (q, q)."""
        return self.sharper * self.known.search.information(self.without, self.quiet, self.left)

    @cached_property
    def plain(self) -> tuple[Array, float]:
        """Posterior covariance (q, q) of the background, and the constant part of its evidence."""
        return self._posterior(self.known.narrow)

    @cached_property
    def posteriors(self) -> tuple[tuple[Array, float], ...]:
        """The same of each hypothesis, over the background's."""
        out = []
        for one in self.hypotheses:
            covariance, constant = self._posterior(wide_prior(self.known, one))
            noise = 0.5 * float(np.sum((covariance - self.plain[0]) * self.information))
            out.append((covariance, constant - self.plain[1] + noise - float(np.log(one.choices))))
        return tuple(out)

    @cached_property
    def growth(self) -> Array:
        """Twice what evidence gains per square of the size (truths, hypotheses)."""
        pulls = np.stack([self.information @ direction(self.known, one)[self.known.active] for one in self.hypotheses])
        gained = [np.einsum("ti,ij,tj->t", pulls, c - self.plain[0], pulls) for c, _ in self.posteriors]
        return np.stack(gained, axis=1)

    def evidence(self, truth: int, size: float) -> Array:
        """Log Bayes factors (hypotheses,) over the background where `truth` has that size."""
        return 0.5 * size**2 * self.growth[truth] + np.array([constant for _, constant in self.posteriors])

    @cached_property
    def shared(self) -> dict[tuple[int, int], float]:
        """Twice what a good rig's share of a rare cause and of all that it gives way to explains per square of the rare
        one's size, by the numbers of both."""
        out: dict[tuple[int, int], float] = {}
        for rare, one in enumerate(self.hypotheses):
            pull = self.information @ direction(self.known, one)[self.known.active]
            usual = [number for number, other in enumerate(self.hypotheses) if one.gives_way_to(other)]
            sd = self.known.narrow.copy()
            for cause in (one, *(self.hypotheses[number] for number in usual)):
                sd[cause.entries(self.known.unknowns)] = 0.0
            if usual:
                shared = float(pull @ (self.plain[0] - self._posterior(sd)[0]) @ pull)
                out |= {(rare, number): shared for number in usual}
        return out

    def std(self, number: int) -> Array:
        """Posterior standard deviations (size,) of all unknowns under a hypothesis."""
        out = wide_prior(self.known, self.hypotheses[number])
        out[self.known.active] = np.sqrt(np.maximum(np.diag(self.posteriors[number][0]), 0.0))
        return out

    def _posterior(self, prior: Array) -> tuple[Array, float]:
        sd = prior[self.known.active]
        scaled = self.information * sd[:, None] * sd[None, :] + np.eye(len(sd))
        return np.linalg.inv(scaled) * sd[:, None] * sd[None, :], -0.5 * float(np.linalg.slogdet(scaled)[1])


def wide_prior(known: Known, one: Hypothesis) -> Array:
    """Priors (size,) under a hypothesis."""
    return one.widened(known.unknowns, known.narrow)


def direction(known: Known, one: Hypothesis) -> Array:
    """Unknowns (size,) of an effect whose entries are each a standard deviation of its wide prior: upwards the first,
    up or down by chance (always the same) the others, as teeth and phases are."""
    at = one.entries(known.unknowns)
    signs = np.where(np.random.default_rng(SEED).random(len(at)) < 0.5, -1.0, 1.0)
    signs[0] = 1.0
    out = np.zeros(known.unknowns.size)
    out[at] = signs * wide_prior(known, one)[at]
    return out


def largest(known: Known, one: Hypothesis) -> float:
    """The largest size within the bounds of its unknowns, LARGEST at most."""
    whole, (low, high) = direction(known, one), known.unknowns.bounds()
    at = np.flatnonzero(whole)
    edges = np.where(whole[at] > 0.0, high[at], low[at]) / whole[at]
    return float(min(LARGEST, edges.min()))


def smallest(view: View, number: int) -> float | None:
    """Size, in standard deviations of the wide prior, from which the hypothesis of that number would be named if it is
    true; None: not within its bounds."""
    known, one = view.known, view.hypotheses[number]
    judged = _Judge(view, number)
    low, high = LEAST, largest(known, one)

    def named(size: float) -> bool:
        lacking = _lacking(view, number, size)
        return lacking is not None and judged.due(size, lacking)

    if not named(high):
        return None
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if named(middle) else (middle, high)
    return high


def _lacking(view: View, number: int, size: float) -> float | None:
    """The nats that an effect of that size lacks up to the limit of the selection; None: it does not enter, or is no
    larger than a good rig's share of it."""
    known, one = view.known, view.hypotheses[number]
    assert one.effect is not None
    at = one.entries(known.unknowns)
    at = at[np.isin(at, known.active)]
    if not at.size:  # these records do not show it at all
        return None
    place = np.searchsorted(known.active, at)
    covariance, wide = view.posteriors[number][0], wide_prior(known, one)[at]
    found = size * (covariance @ view.information @ direction(known, one)[known.active])[place]
    narrow, sound = known.narrow[at], known.unknowns.prior()[at]
    evidence = view.evidence(number, size)[number]
    # What widening its own prior can add to the evidence at most (`selection.weighing.relief`).
    if narrow.all():
        evidence = min(evidence, 0.5 * float((found**2 * (narrow**-2.0 - wide**-2.0)).sum()))
    told = np.clip(1.0 - np.diag(covariance)[place] / wide**2, 1e-6, 1.0)
    relative = float(np.sqrt(np.average((found / sound) ** 2, weights=told)))
    entered = entering(known.unknowns, Weighed(one, float(evidence), None), known.apart)
    return None if entered is None or relative <= LIMITS.size_of(one.effect) else entered.lacking


class _Judge:
    """Whether the judged record's gap grows without an effect (`output.judged`): rig, structure and all that no other
    effect holds are fitted again, so that what is left of it is what they cannot explain."""

    def __init__(self, view: View, number: int) -> None:
        known, one = view.known, view.hypotheses[number]
        unknowns, active = known.unknowns, known.active
        sd = known.narrow.copy()
        for group in unknowns.groups:
            if (group.wide > group.sd).any():
                sd[unknowns[group.key]] = 0.0
        sd[one.entries(unknowns)] = 0.0
        whole = direction(known, one)[active]
        covariance, _ = view._posterior(sd)
        blocks = known.judged
        self.target = replace(blocks.target, noise=view.quiet / view.sharper * blocks.target.noise)
        self.floors = blocks.floors(view.quiet, view.left) / view.sharper
        self.rest = blocks.rest(view.quiet, view.left) / view.sharper
        # A record that is left out of the search is judged on all the same; a channel that is not measured is not.
        kept = blocks.kept(Without(channels=view.without.channels))
        self.energies = blocks.energies(whole - covariance @ view.information @ whole) * kept
        # Of a number of the nominal rig recalibration takes as much as is uncertain.
        self.held = 0.0
        if not all(is_own(unknowns, wide) for wide in one.wide):
            at = one.entries(unknowns)
            self.held = float(known_within(unknowns.prior()[at])[1][0] / wide_prior(known, one)[at][0])

    def due(self, size: float, lacking: float) -> bool:
        """Whether an effect of that size, which lacked so many nats in the search, closes a part of the gap."""
        more = self.energies * max(size - self.held, 0.0) ** 2
        gain = float(np.sum(self.target.counts * np.log1p(more / self.floors)))
        factor, _ = growth_of(self.target, self.rest + more, self.rest)
        return gain > GAIN + lacking and factor > DUE


def rivals_at(view: View, number: int, size: float, usual: bool = True) -> tuple[int, ...]:
    """Hypotheses of other effects that come within three nats of the true one of that size; where the `usual` of two
    causes is named for the other, as these are (`output.rivals`)."""
    truth, evidence = view.hypotheses[number], view.evidence(number, size)
    own = float(evidence[number])
    out = []
    for other, one in enumerate(view.hypotheses):
        if one.effect is truth.effect:
            continue
        needed = max(own - APART, limit_of(view.known.unknowns, one))
        if usual and one.gives_way_to(truth):
            continue
        if usual and truth.gives_way_to(one):
            shared = 0.5 * size**2 * view.shared[number, other]
            needed = min(NEARLY * own, ALIKE * (own + shared) - shared, own - APART)
        if evidence[other] > needed:
            out.append(other)
    return tuple(out)


def apart_from(view: View, number: int, found: float) -> float | None:
    """The size from `found` on above which the true one has no rival; None: at no size within its bounds."""
    sizes = np.geomspace(found, max(largest(view.known, view.hypotheses[number]), found), SIZES)
    mixed = [bool(rivals_at(view, number, float(size))) for size in sizes]
    if mixed[-1]:
        return None
    last = max((place for place, one in enumerate(mixed) if one), default=-1)
    return float(sizes[last + 1])

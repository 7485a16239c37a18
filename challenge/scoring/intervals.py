"""What a count or a few numbers say: binomial intervals, a median with its interval, calibration of probabilities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.stats import beta, binom

COVERAGE = 0.9
DRAWS = 1000  # of outcomes by chance, which leave a hundredth of their range


@dataclass(frozen=True)
class Rate:
    """`count` of `total` with its interval; without cases the share is unknown (None) and the interval 0..1."""

    count: int
    total: int

    @property
    def share(self) -> float | None:
        """count / total."""
        return self.count / self.total if self.total else None

    @property
    def low(self) -> float:
        """Lower end of the interval (Clopper and Pearson 1934)."""
        tail = 0.5 * (1 - COVERAGE)
        return float(beta.ppf(tail, self.count, self.total - self.count + 1)) if self.count else 0.0

    @property
    def high(self) -> float:
        """Upper end."""
        tail = 0.5 * (1 - COVERAGE)
        rest = self.total - self.count
        return float(beta.ppf(1 - tail, self.count + 1, rest)) if rest else 1.0

    def plain(self) -> dict[str, float | int | None]:
        """As numbers for JSON."""
        return {"count": self.count, "total": self.total, "share": self.share, "low": self.low, "high": self.high}


@dataclass(frozen=True)
class Middle:
    """The median of `total` numbers, with the interval that its order statistics give; unknown ends are None."""

    value: float | None
    low: float | None
    high: float | None
    total: int

    def plain(self) -> dict[str, float | int | None]:
        """As numbers for JSON."""
        return {"median": self.value, "low": self.low, "high": self.high, "total": self.total}


def middle(values: Sequence[float]) -> Middle:
    """Median and its interval: the k-th smallest and largest, P(at most k - 1 of n fall below the median) <= 5 %."""
    ordered = np.sort(np.asarray(values, dtype=float))
    count = ordered.size
    if not count:
        return Middle(None, None, None, 0)
    # Largest k with P(B <= k - 1) <= tail, B binomial(n, 1/2): the k-th from either end.
    k = int(np.searchsorted(binom.cdf(np.arange(count), count, 0.5), 0.5 * (1 - COVERAGE), side="right"))
    low, high = (float(ordered[k - 1]), float(ordered[count - k])) if k else (None, None)
    return Middle(float(np.median(ordered)), low, high, count)


def brier(stated: Sequence[Sequence[float]], truth: Sequence[int]) -> float | None:
    """Mean over cases of the summed squared difference of stated probabilities and what was true (Brier 1950):
    0 is perfect, 2 the worst."""
    if not len(truth):
        return None
    p = np.asarray(stated, dtype=float)
    p[np.arange(len(truth)), list(truth)] -= 1.0
    return float((p**2).sum(axis=1).mean())


BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)


def reliability(stated: Sequence[float], right: Sequence[bool]) -> list[dict[str, object]]:
    """For each bin of stated probability: its ends, the mean stated, and the rate that was right."""
    p, hit = np.asarray(stated, dtype=float), np.asarray(right, dtype=bool)
    rows: list[dict[str, object]] = []
    for low, high in pairwise(BINS):
        inside = (p >= low) & ((p < high) if high < 1.0 else (p <= high))
        if inside.any():
            rate = Rate(int(hit[inside].sum()), int(inside.sum()))
            rows.append({"from": low, "to": high, "stated": float(p[inside].mean()), **rate.plain()})
    return rows


def calibration_error(rows: Sequence[Mapping[str, object]]) -> float | None:
    """Mean over cases of how far the rate in their bin lies from the mean stated there (rows of `reliability`)."""
    total = sum(int(str(row["total"])) for row in rows)
    if not total:
        return None
    return sum(int(str(r["total"])) * abs(float(str(r["stated"])) - float(str(r["share"]))) for r in rows) / total


def error_by_chance(stated: Sequence[float]) -> Middle:
    """The calibration error of a program whose probabilities all hold, with its 90 % range: few cases never come out
    as often as stated. Without cases its numbers are None."""
    p = np.asarray(stated, dtype=float)
    if not p.size:
        return Middle(None, None, None, 0)
    draws = np.random.default_rng(0).random((DRAWS, p.size)) < p
    errors = [calibration_error(reliability(stated, right)) for right in draws]
    tail = 50 * (1 - COVERAGE)
    low, value, high = np.percentile(np.array(errors, dtype=float), [tail, 50, 100 - tail])
    return Middle(float(value), float(low), float(high), p.size)

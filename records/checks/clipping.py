"""Clipped channels, and what clipping costs."""

from __future__ import annotations

from math import sqrt

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import Look

Array = NDArray[np.float64]

# Equal samples at an end of the range that make clipping, and how many times as many as the levels beside hold: a
# signal that repeats itself meets its extreme in every period, a coarsely quantised one lingers there.
FEWEST, CROWD = 6, 5.0
# Levels closer than this part of the range are one: rounding, or the noise that comes after what has clipped. A peak
# crowds below its top as well, by less than CROWD: a parabola, and a sine, hold three times as much in the first level
# as in the mean of the next three.
WIDTHS = (1e-9, 1e-4, 1e-3)
# Part of the samples under noise at an end that others there must follow.
RUNS = 0.3
# A signal that spends this part of its time at its ends, such as a binary one, is made so and not clipped.
MADE_SO = 0.95
# A load torque that stands below this part of its largest value is the one of separated teeth.
SEPARATED = 1e-3
CHANNELS = ("torque_driver", "torque_driven", "y_driver", "y_driven", "dte", "force")


def not_clipped(look: Look) -> list[Finding]:
    """No channel stands at the ends of its range."""
    found = []
    for name, (share, row) in clipped_channels(look.record).items():
        error = lost_by_clipping(look.record[name].values[row]) * _share(look, name)
        found.append(
            Finding(
                f"{name} is clipped at {share:.2g} of its samples (limit 0): what it lost there is missing from"
                f" the response, about {error:.0%} of it",
                refused=False,
                error=error,
            )
        )
    return found


def clipped_channels(record: xr.Dataset) -> dict[str, tuple[float, int]]:
    """Channels that stand clipped: part of the samples of the realisation that is worst, and its number."""
    found = {}
    for name in CHANNELS:
        if name not in record:
            continue
        rows = record[name].values
        shares = [clipped_ends(values) for values in rows]
        if name == "torque_driven":  # at zero, the teeth have separated
            shares = [
                (high, 0.0 if abs(values.min()) < SEPARATED * values.max() else low)
                for values, (high, low) in zip(rows, shares, strict=True)
            ]
        row = max(range(len(rows)), key=lambda number: sum(shares[number]))
        if 0.0 < sum(shares[row]) < MADE_SO:
            found[name] = (sum(shares[row]), row)
    return found


def clipped_ends(values: Array) -> tuple[float, float]:
    """Parts of the samples (n,) that stand clipped at the upper and the lower end of the range; 0 where none do."""
    if np.ptp(values) == 0.0:
        return 0.0, 0.0
    high, low = (float(np.mean(_standing(values, end))) for end in (float(values.max()), float(values.min())))
    return high, low


def lost_by_clipping(values: Array) -> float:
    """Rms of what clipping took off (n,) over the rms fluctuation of what is left.

    A run of m samples at an end, entered with the slope a and left with the slope b (per sample), hides an arc of
    height (a + b) m / 8, whose mean square over the run is 8/15 of the height's square (a parabola). The slopes are
    those one step before the end, where a concave flank is steeper: an upper bound for runs of few samples.
    """
    lost = 0.0
    for end in (float(values.max()), float(values.min())):
        edges = np.flatnonzero(np.diff(np.concatenate(([False], _standing(values, end), [False])).astype(int)))
        first, last = edges[::2], edges[1::2]  # runs are first .. last - 1
        inner = (first > 1) & (last < values.size - 1)
        first, last = first[inner], last[inner]
        slopes = np.abs(values[first - 1] - values[first - 2]) + np.abs(values[last] - values[last + 1])
        # The flank's last step is cut short by the end itself: of the run, half a step a side is flank.
        lost += float(np.sum((last - first) * 8 / 15 * (slopes * (last - first + 1) / 8) ** 2))
    return sqrt(lost / values.size) / float(values.std())


def _share(look: Look, name: str) -> float:
    """Which part of force or DTE a channel makes: relative fluctuations."""
    if name in ("force", "dte"):
        return 1.0
    if name.startswith("torque"):
        values = look.channel(name)
        radius = look.number(f"base_radius_{name.removeprefix('torque_')}")
        if name == "torque_driven" and look.record.attrs.get("driven_boundary") == "speed":
            return 0.0
        if values is None or radius is None or look.force is None or not look.force.std() > 0:
            return 1.0
        return min(1.0, float(values.std()) / radius / float(look.force.std()))
    return look.part_of_dte(name)


def _standing(values: Array, end: float) -> NDArray[np.bool_]:
    """Which samples (n,) stand clipped at an end of the range: those within the least of WIDTHS within which they crowd
    there; none where they do within none."""
    for width in WIDTHS:
        size = width * float(np.ptp(values))
        near = np.abs(values - end) <= size
        if int(np.count_nonzero(near)) < FEWEST:
            continue
        # Clipped, a signal stands for samples in a row; a peak that comes back under noise is met once in a period.
        if width > WIDTHS[0] and np.count_nonzero(near[1:] & near[:-1]) < RUNS * np.count_nonzero(near):
            continue
        # Of a periodic signal the same sample comes back but for rounding. Levels that hold none are left out: those
        # between the steps of a quantised signal.
        levels, counts = np.unique(np.floor(np.abs(values - end) / size), return_counts=True)
        beside = counts[1:4]
        if levels[0] == 0 and counts[0] >= CROWD * max(1.0, float(beside.mean()) if beside.size else 0.0):
            return near
    return np.zeros(values.size, dtype=bool)

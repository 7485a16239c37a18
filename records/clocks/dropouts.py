"""Channels that stand still for a while: a transmitter that lost contact, a logger that repeated its last value."""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import Look

# Equal samples in a row, and how many times as many as the usual runs of a quantised signal (its 99th percentile).
LONGEST, UNUSUAL = 32, 8.0
# A channel that stands still for longer than this part is constant or switched, which other checks judge.
MOST = 0.5
CHANNELS = ("torque_driver", "torque_driven", "angle_driver", "angle_driven", "y_driver", "y_driven", "dte", "force")


def channels_do_not_stick(look: Look) -> list[Finding]:
    """No channel holds one value for long, but at the ends of its range, where it is clipped."""
    found = []
    for name in CHANNELS:
        values = look.channel(name)
        if values is None:
            continue
        longest, share = stuck(values)
        if longest == 0 or not share < MOST:
            continue
        error = sqrt(2 * share)
        found.append(
            Finding(
                f"{name} stands still for {longest} samples in a row ({longest / look.rate:.3g} s; limit {LONGEST}),"
                f" and for {share:.2g} of the record: a dropout, which may cost {error:.0%} of the response",
                refused=False,
                error=error,
            )
        )
    return found


def stuck(values: NDArray[np.float64]) -> tuple[int, float]:
    """Longest unusual run of equal samples (n,), and the part of all samples that lie in such runs; 0 for none."""
    edges = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0, [True]]))
    runs = np.diff(edges)
    level = values[edges[:-1]]
    inside = (level > values.min()) & (level < values.max())
    limit = max(LONGEST, UNUSUAL * float(np.percentile(runs, 99)))
    long = runs[inside & (runs >= limit)]
    return (int(long.max()), float(long.sum() / values.size)) if long.size else (0, 0.0)

"""Realisations that hold the same samples: the second one is no measurement of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import Look

Place = tuple[int, int]


def same_samples(records: Sequence[xr.Dataset]) -> tuple[Place, Place] | None:
    """The first two places, (record, realisation), whose driver's angles (without angles: dte) are the same; else None.

    Under constant torque noise-free realisations are alike by right: there, nothing is compared.
    """
    seen: dict[bytes, Place] = {}
    for number, record in enumerate(records):
        response = "angle_driver" if "angle_driver" in record else "dte"
        driving = next((name for name in ("torque_driver", "force") if name in record), None)
        for row, values in enumerate(record[response].values):
            if driving is None or np.ptp(record[driving].values[row]) == 0.0:
                continue
            content = values.tobytes()
            if content in seen:
                return seen[content], (number, row)
            seen[content] = (number, row)
    return None


def realisations_differ(look: Look) -> list[Finding]:
    """Each realisation has samples of its own."""
    found = same_samples([look.record])
    if found is None:
        return []
    (_, first), (_, second) = found
    return [Finding(f"realisations {first} and {second} hold the same samples: each one counts once")]

"""Does the record repeat after a joint period of excitation and mesh?"""

from __future__ import annotations

import numpy as np

from gearbench.records.checks.finding import Finding
from gearbench.records.checks.look import Look

# Part of the rms fluctuation that may differ from period to period.
SCATTER = 0.1
# Departure of a joint period from whole mesh periods [mesh periods] up to which both count as repeating.
WHOLE = 1e-3


def periods_repeat(look: Look) -> list[Finding]:
    """Periods are alike; what differs from one to the next is said as a share. It is noise to an identification, which
    finds it in its residual and counts it in its variance."""
    joint = _joint_samples(look)
    if joint is None:
        return []
    found = []
    for name, values in (("the dte", look.stored_or_own_dte), ("the force", look.force)):
        if values is None:
            continue
        rows = values.reshape(-1, joint)
        mean = rows.mean(axis=0)
        swing = float(mean.std())
        scatter = float(np.sqrt(((rows - mean) ** 2).sum() / (rows.size - joint)))
        if swing > 0 and scatter > SCATTER * swing and scatter > 1e-12 * float(np.abs(values).max()):
            found.append(
                Finding(
                    f"{name} does not repeat from period to period of {joint / look.rate:.4g} s: {scatter / swing:.2g}"
                    f" of its rms fluctuation differs (limit {SCATTER:g}); noise, drift or what turns with a shaft",
                    refused=False,
                )
            )
    return found


def _joint_samples(look: Look) -> int | None:
    """Samples of the shortest run of excitation periods that holds whole mesh periods, if there are two such runs and
    the speed is constant."""
    period, periods = int(look.record.attrs["samples_per_period"]), int(look.record.attrs["periods"])
    if look.mesh_period is None or not look.steady:
        return None
    cycles = period / (look.rate * look.mesh_period)
    for count in range(1, periods // 2 + 1):
        whole = count * cycles
        if periods % count == 0 and round(whole) >= 1 and abs(whole - round(whole)) < WHOLE:
            return count * period
    return None

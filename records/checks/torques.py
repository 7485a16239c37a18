"""Are the torques those that the record itself declares, and do they balance on the mean?"""

from __future__ import annotations

import numpy as np

from gearbench.records.seen.finding import TORQUE_UNITS, Finding, unit_hint
from gearbench.records.seen.look import Look

# Mean against the declared mean; load torque against the mean torque times z2/z1 (friction and bearings take some).
OWN_MEAN, LOAD = 0.02, 0.3
# A mean below this part of the torque's rms says nothing about its sign or ratio.
MEANS_LITTLE = 0.1


def torque_as_declared(look: Look) -> list[Finding]:
    """The mean of torque_driver is torque_mean, and positive."""
    torque = look.channel("torque_driver")
    if torque is None:
        return []
    mean, size = float(torque.mean()), float(np.sqrt(np.mean(torque**2)))
    declared = look.number("torque_mean")
    if declared is not None and abs(mean - declared) > max(OWN_MEAN * abs(declared), 1e-3 * OWN_MEAN * size):
        hint = unit_hint(mean / declared, TORQUE_UNITS, "torque_driver") if declared else ""
        return [
            Finding(
                f"the mean of torque_driver is {mean:.4g} N m, but attribute torque_mean = {declared:.4g} N m"
                f" (limit {OWN_MEAN:.0%}){hint}"
            )
        ]
    if mean < -MEANS_LITTLE * size:
        return [
            Finding(f"the mean of torque_driver is {mean:.4g} N m and must be positive: it closes the working flanks")
        ]
    return []


def load_balances(look: Look) -> list[Finding]:
    """At rest the driven gear takes the driver's torque times z2/z1."""
    torque, load = look.channel("torque_driver"), look.channel("torque_driven")
    r1, r2 = look.number("base_radius_driver"), look.number("base_radius_driven")
    if torque is None or load is None or r1 is None or r2 is None:
        return []
    if float(torque.mean()) < MEANS_LITTLE * float(np.sqrt(np.mean(torque**2))):
        return []
    wanted = float(torque.mean()) * r2 / r1
    factor = float(load.mean()) / wanted
    if abs(factor - 1) <= LOAD:
        return []
    hint = unit_hint(factor, TORQUE_UNITS, "torque_driven") or (
        unit_hint(1 / factor, TORQUE_UNITS, "torque_driver") if factor else ""
    )
    return [
        Finding(
            f"the mean of torque_driven is {factor * wanted:.4g} N m, where the mean of torque_driver and the gear"
            f" ratio want {wanted:.4g} N m (limit {LOAD:.0%}); it is positive against the driven rotation{hint}"
        )
    ]

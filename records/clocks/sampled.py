"""Channels that were interpolated from a clock too slow for what the rig was excited with."""

from __future__ import annotations

import numpy as np

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import GEARS, Look

# Part of the response beyond what a channel can tell that is said.
SAYS = 0.01


def sampled_fast_enough(look: Look) -> list[Finding]:
    """No channel of force or dte lacks a part of the excited band because it came from a slower clock, as the attribute
    `believed_to_hz` of `convert` tells."""
    force, error = look.force, look.stored_or_own_dte
    names = [f"{kind}_{gear}" for kind in ("torque", "angle", "y") for gear in GEARS] + ["dte", "force"]
    limits = {name: look.record[name].attrs.get("believed_to_hz") for name in names if name in look.record}
    known = {name: float(limit) for name, limit in limits.items() if limit is not None}
    if not known or force is None or error is None:
        return []
    lines = look.excited(force)
    frequency, size = look.omega[lines] / (2 * np.pi), np.abs(look.spectrum(error))[lines]
    least = min(known.values())
    beyond = float(np.linalg.norm(size[frequency > least]) / max(float(np.linalg.norm(size)), np.finfo(float).tiny))
    if beyond < SAYS:
        return []
    slow = " and ".join(name for name, limit in known.items() if limit < 1.01 * least)
    return [
        Finding(
            f"{slow} can be believed up to {least:.4g} Hz, as sampled before the conversion, and the force excites up"
            f" to {frequency[-1]:.4g} Hz: {beyond:.0%} of the response lies beyond; identify a band below, or measure"
            " with more pulses or samples",
            refused=False,
            error=beyond,
            above=least,
        )
    ]

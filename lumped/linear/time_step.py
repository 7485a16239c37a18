"""How many Runge-Kutta steps a sample needs.

Over one step h the classical method turns a mode exp(lambda t) by exp(lambda h) to within a relative
error of |lambda h|^4 / 120 in its frequency; its own damping, |lambda h|^5 / 144 of the critical one, is
smaller still.
"""

from __future__ import annotations

from math import ceil

from gearbench.lumped.errors import LumpedError

# Largest relative error of the frequency of the fastest mode.
FREQUENCY_ERROR = 5e-4
# Fewest steps per mesh period: the stiffness is seen on this grid only.
STEPS_PER_MESH = 200
MOST_SUBSTEPS = 1024


def largest_step(fastest_rate: float, mesh_period: float) -> float:
    """Largest step [s] for modes up to `fastest_rate` [rad/s] and the given mesh period [s]."""
    return min((120 * FREQUENCY_ERROR) ** 0.25 / fastest_rate, mesh_period / STEPS_PER_MESH)


def choose_substeps(fastest_rate: float, mesh_period: float, sampling_rate: float, requested: int = 0) -> int:
    """Integration steps per sample: the fewest that the error bound allows, or `requested` if that is not 0.

    Raises LumpedError if the request is too coarse or more than MOST_SUBSTEPS steps are needed.
    """
    needed = max(1, ceil(1 / (sampling_rate * largest_step(fastest_rate, mesh_period)) - 1e-9))
    if needed > MOST_SUBSTEPS:
        raise LumpedError(
            f"sampling_rate_hz = {sampling_rate:g} would need {needed} integration steps a sample (limit"
            f" {MOST_SUBSTEPS}): the fastest mode has {fastest_rate:.4g} rad/s"
        )
    if requested and requested < needed:
        raise LumpedError(
            f"simulation.substeps = {requested} is too coarse for the fastest mode of this rig,"
            f" {fastest_rate:.4g} rad/s: at least {needed}, or 0 to have it chosen"
        )
    return requested or needed

"""Numbers to reach whose subject does not exist yet: shown, never passed."""

from __future__ import annotations

from collections.abc import Callable

from gearbench.commands.checks import Check, NotRun


def missing(what: str) -> Callable[[], float]:
    """A measurement that says what is missing."""

    def measure() -> float:
        raise NotRun(f"{what} does not exist yet")

    return measure


CHECKS = [
    Check(
        "full-transient", "reduced against full transient, to 3 kHz", 0.01, "", missing("the full transient")
    ),
    Check(
        "mesh-feedback-40db", "mesh-feedback ITF at 40 dB", 0.01, "", missing("the mesh-feedback estimator")
    ),
    Check(
        "mesh-feedback-30db", "mesh-feedback ITF at 30 dB", 0.04, "", missing("the mesh-feedback estimator")
    ),
]

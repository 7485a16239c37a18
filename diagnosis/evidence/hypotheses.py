"""What may be at work: single effects of the library, and free forms at each place that name no effect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.fit import Fit, root_of
from gearbench.diagnosis.forces.parameters import Layout
from gearbench.diagnosis.forces.unknowns import DELAYED, ROWS

Array = NDArray[np.float64]

LIBRARY = (
    "backlash",
    "friction",
    "eccentricity",
    "pitch-error",
    "tooth-crack",
    "coupling",
    "bearing-nonlinearity",
    "sensor-delay",
    "torque-ripple",
)


@dataclass(frozen=True)
class Hypothesis:
    """An effect (`effect` empty: a free form) at a place; `groups` and single `entries` of the unknowns get wide
    priors, `name` tells it from others of the same effect, and `choices` is out of how many like it it was picked."""

    name: str
    effect: str
    place: str
    groups: tuple[str, ...] = ()
    entries: tuple[int, ...] = ()
    choices: int = 1

    def prior(self, where: Layout) -> Array:
        """Prior standard deviations (P,) under this hypothesis."""
        return where.prior(self.groups, self.entries)


def library(where: Layout, without: tuple[str, ...] = ()) -> tuple[Hypothesis, ...]:
    """Every single effect of the library in every place where it may be."""
    found = [Hypothesis(name, name, "mesh", (name,)) for name in ("backlash", "friction")]
    found += [
        Hypothesis(f"eccentricity {side}", "eccentricity", "mesh", (f"eccentricity-{side}",), (), 2)
        for side in ("driver", "driven")
    ]
    found += [
        Hypothesis("pitch-error driver", "pitch-error", "mesh", ("pitch-driver",), (), 3),
        Hypothesis("pitch-error driven", "pitch-error", "mesh", ("pitch-driven",), (), 3),
        Hypothesis("pitch-error both", "pitch-error", "mesh", ("pitch-driver", "pitch-driven"), (), 3),
    ]
    teeth = range(*where["crack"].indices(where.size))
    found += [
        Hypothesis(f"tooth-crack {number}", "tooth-crack", "mesh", (), (entry,), len(teeth))
        for number, entry in enumerate(teeth)
    ]
    found.append(Hypothesis("coupling", "coupling", "drive", ("coupling",)))
    found.append(Hypothesis("torque-ripple", "torque-ripple", "drive", ("torque-ripple",)))
    found += [
        Hypothesis(
            f"bearing-nonlinearity {side}", "bearing-nonlinearity", f"{side}-support", (f"bearing-{side}",), (), 2
        )
        for side in ("driver", "driven")
    ]
    found += [
        Hypothesis(f"sensor-delay {channel}", "sensor-delay", "sensor", (f"delay-{channel}",), (), len(DELAYED))
        for channel in DELAYED
    ]
    return tuple(h for h in found if h.effect not in without)


def free_forms() -> tuple[Hypothesis, ...]:
    """Competitors that name a place but no effect."""
    found = [
        Hypothesis("free mesh", "", "mesh", ("tooth-contrast",)),
        Hypothesis("free dissipation", "", "mesh", ("free-dissipation",)),
    ]
    found += [Hypothesis(f"free {row}", "", row, (f"free-{row}",)) for row in ROWS]
    return tuple(found)


def starts(hypothesis: Hypothesis, where: Layout) -> tuple[Array, ...]:
    """Departures (P,) from the background's fit to begin from, for effects whose influence is far from linear."""
    if hypothesis.effect == "coupling":
        # Compliances at which the rotor resonates with the gear between the prior's 6 kHz and a seventh of it.
        values = [where.block("coupling").narrow[0] * ratio**2 for ratio in (2.0, 2.7, 3.6, 4.8, 6.5)]
    elif hypothesis.effect == "sensor-delay":
        values = [-60e-6, -30e-6, 30e-6, 60e-6]
    else:
        return ()
    entry = where[hypothesis.groups[0]].start
    out = []
    for value in values:
        move = np.zeros(where.size)
        move[entry] = value
        out.append(move)
    return tuple(out)


def predicted_evidence(fit: Fit, sd: Array) -> float:
    """Log evidence under other priors `sd` (P,), by the quadratic that the fit found for the data alone."""
    scaled = fit.information * sd[:, None] * sd[None, :] + np.eye(len(sd))
    factor = root_of(scaled)
    half = np.linalg.solve(factor, sd * fit.pull)
    return 0.5 * float(half @ half) - float(np.log(np.diag(factor)).sum())


def predicted_gains(fit: Fit, where: Layout, hypotheses: tuple[Hypothesis, ...]) -> Array:
    """Log evidence (hypotheses,) over that of the background alone, as the fit's quadratic predicts it."""
    base = predicted_evidence(fit, where.prior())
    out = [predicted_evidence(fit, h.prior(where)) - base - np.log(h.choices) for h in hypotheses]
    return np.array(out)

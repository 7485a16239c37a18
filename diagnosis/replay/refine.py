"""From the search's rigs to the best that the lumped model can do under each hypothesis, by simulation.

The search weighs forces, with smooth errors of every row left free; what is simulated has no such freedom. So before
gaps are told, the uncertain numbers of the rig are moved once more, to where the simulation comes closest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.replay.adjustable import Adjustable, Simulate, at_path, uncertain
from gearbench.diagnosis.replay.recalibrate import recalibrate
from gearbench.rig import Case

EXCESS_SD = 5e-6  # of the excess material of all pairs, which shifts the zero of the transmission error [m]
LOSING = 0.05  # part of the time without contact from which a record is too rough to follow downhill
ITERATIONS = 5


@dataclass(frozen=True)
class Addition:
    """An effect to be added to cases: `to(case)` is the case with it, `fields` the numbers that it moves there."""

    to: Callable[[Case], Case]
    fields: tuple[str, ...]


def refined(
    nominal: Case,
    addition: Addition | None,
    measurements: Sequence[Measurement],
    simulate: Simulate,
) -> tuple[Case, Case | None]:
    """The nominal case recalibrated, and recalibrated with an effect added (None: no effect).

    Records whose flanks often separate are left out, unless all do: small changes make jumps there. Raises what the
    simulation of the nominal case raises.
    """
    parameters = (*uncertain(nominal), at_path("rig.mesh.error_mean", EXCESS_SD))
    chosen = [one for one in measurements if _apart(nominal, one, simulate) < LOSING] or list(measurements)
    plain = recalibrate(nominal, parameters, chosen, simulate, iterations=ITERATIONS).case
    if addition is None:
        return plain, None
    start = addition.to(plain)
    held = tuple(_about(one, start if one.name in addition.fields else nominal) for one in parameters)
    return plain, recalibrate(start, held, chosen, simulate, iterations=ITERATIONS).case


def _about(parameter: Adjustable, case: Case) -> Adjustable:
    """The parameter with its prior around the value of a case, whatever the case that it starts from."""
    return replace(parameter, mean=parameter.get(case))


def _apart(case: Case, measured: Measurement, simulate: Simulate) -> float:
    """Part of the replayed period in which no flanks touch."""
    steady = simulate(case, measured.record)
    return float(steady.attrs.get("contact_lost_samples", 0)) / max(int(np.prod(steady["time"].shape)), 1)

"""How fast flanks slide where friction has turned round: the rig that it makes, and a record that tells it."""

from __future__ import annotations

from math import log

import numpy as np
import pytest
import xarray as xr
from shared.simulated_lines import demonstration

from gearbench.bench import simulate
from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.effects.friction import KEY as FRICTION
from gearbench.diagnosis.evidence.problem import problem_of
from gearbench.diagnosis.fitting.fit import fit_afresh
from gearbench.diagnosis.intake.measurements import measurement
from gearbench.diagnosis.selection.weighing import turned_round
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import target_of
from gearbench.diagnosis.structure.rubbing import TURNING
from gearbench.rig import Friction

NOMINAL = 5e-3  # [m/s]


@pytest.fixture(scope="module")
def simulator() -> Simulator:
    return demonstration()


def departed(simulator: Simulator, **values: float) -> np.ndarray:
    p = np.zeros(simulator.layout.size)
    for key, value in values.items():
        p[simulator.layout.unknowns[key.replace("_", "-")]] = value
    return p


def test_friction_turns_round_as_fast_as_the_unknown_says(simulator: Simulator) -> None:
    case = simulator.layout.case
    turned = case(departed(simulator, friction=0.05, friction_turning=log(3.0))).rig.friction
    assert turned.coefficient == pytest.approx(0.05) and turned.transition_speed == pytest.approx(3.0 * NOMINAL)
    # What does not rub turns nothing round: no rig is simulated for that.
    assert case(departed(simulator, friction_turning=1.0)) == case(departed(simulator))


def test_a_record_tells_how_fast(simulator: Simulator) -> None:
    """Friction of 0.06 that turns round at 0.02 m/s, on a rig whose case says 0.005: as surely as it is told."""
    nominal, unknowns = simulator.layout.nominal, simulator.layout.unknowns
    rubbing = nominal.rig.model_copy(update={"friction": Friction(coefficient=0.06, transition_speed=0.02)})
    record = simulate(nominal.model_copy(update={"rig": rubbing}).under(nominal.conditions[0]))
    there = _of(simulator, record)
    sd, chosen = unknowns.prior(), unknowns.of((FRICTION, TURNING))
    sd[unknowns[FRICTION]] = 0.06
    begin = departed(simulator, friction=0.06)
    found = fit_afresh(there, begin, np.where(chosen, sd, 0.0), renewals=4)
    # What has to be moved and simulated is moved anew where a fit begins again, as those that follow each other do.
    found = fit_afresh(there, found.p, found.sd, renewals=4) if found is not None else None
    held = fit_afresh(there, begin, np.where(unknowns.of((FRICTION,)), sd, 0.0), renewals=4)
    assert found is not None and held is not None
    assert found.p[unknowns[FRICTION]] == pytest.approx(0.06, rel=0.02)
    at = unknowns[TURNING].start
    assert abs(found.p[at] - log(0.02 / NOMINAL)) < 3.0 * found.std[at] < 0.3
    assert found.cost < held.cost - 100.0


def test_friction_is_weighed_with_how_fast_it_turns_round(simulator: Simulator) -> None:
    """Beside a rig that has none, which does not feel how fast it would."""
    nominal, unknowns = simulator.layout.nominal, simulator.layout.unknowns
    rubbing = nominal.rig.model_copy(update={"friction": Friction(coefficient=0.06, transition_speed=0.02)})
    record = simulate(nominal.model_copy(update={"rig": rubbing}).under(nominal.conditions[0]))
    there = _of(simulator, record)
    sd = np.where(unknowns.of((FRICTION, TURNING)), unknowns.prior(), 0.0)
    base = fit_afresh(there, departed(simulator), sd, renewals=0)
    assert base is not None and unknowns[TURNING].start not in base.sensitivity.quadratic.active
    hypothesis = Hypothesis("friction", "mesh", (Wide(FRICTION),))
    sd[unknowns[FRICTION]] = unknowns.group(FRICTION).wide
    alone = fit_afresh(there, departed(simulator, friction=0.06), sd, renewals=0, chosen=unknowns.of((FRICTION,)))
    assert alone is not None and not alone.p[unknowns[TURNING]].any()
    found = turned_round(there, hypothesis, alone)
    assert found is not None and found.evidence > alone.evidence + 50.0
    assert found.p[unknowns[TURNING]][0] == pytest.approx(log(0.02 / NOMINAL), abs=0.2)
    assert turned_round(there, Hypothesis("coupling", "drive", (Wide("coupling"),)), alone) is alone


def _of(simulator: Simulator, record: xr.Dataset) -> Simulator:
    """The same rig held against another record of its first condition."""
    nominal = simulator.layout.nominal
    measured = measurement(record, nominal.conditions[0].name, nominal)
    return simulator.of_target(target_of([measured], problem_of([measured], nominal).conditions))

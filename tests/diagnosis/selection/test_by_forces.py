"""A background that ended in a valley of its own: what the force residuals found there leads out of it."""

from __future__ import annotations

import numpy as np
import pytest
from shared.fake_simulator import LINES, FakeSimulator, sensitivities, target, unknowns

from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.fitting.background import prior_of
from gearbench.diagnosis.fitting.fit import Optimum, fit, sensitivity_of
from gearbench.diagnosis.fitting.shown import Shown
from gearbench.diagnosis.selection import by_forces
from gearbench.diagnosis.selection.by_forces import SPEAKS, Start, begun_by_forces

MATRIX = sensitivities()
FRICTION = Hypothesis("friction", "mesh", (Wide("friction"),))
TRUE = np.array([0.05, 0.17, -0.05, 0.3, 0.0, 0.0, 0.0, 0.0])


def valleys(p: np.ndarray) -> np.ndarray:
    """Lines that the second unknown turns round: between two of its values all ways are uphill."""
    return p @ MATRIX + 2.0 * np.exp(40j * p[1]) * MATRIX[1]


@pytest.fixture
def simulator() -> FakeSimulator:
    rng = np.random.default_rng(7)
    noise = 0.02 * (rng.standard_normal(LINES) + 1j * rng.standard_normal(LINES))
    return FakeSimulator(valleys, target(valleys(TRUE) + noise))


def background(simulator: FakeSimulator) -> Optimum:
    sd = prior_of(simulator, unknowns().prior())  # type: ignore[arg-type]
    first = sensitivity_of(simulator, np.zeros(8), unknowns().prior())  # type: ignore[arg-type]
    assert first is not None
    found = fit(simulator, np.zeros(8), sd, first, renewals=8)  # type: ignore[arg-type]
    assert found is not None
    return found


def test_what_the_force_residuals_found_leads_the_background_out_of_its_valley(simulator: FakeSimulator) -> None:
    base = background(simulator)
    assert abs(base.p[1] - TRUE[1]) > 0.05
    start = Start(FRICTION, TRUE + 0.01, 2 * SPEAKS)
    better, begun = begun_by_forces(simulator, base, (FRICTION,), {"friction": start})  # type: ignore[arg-type]
    assert begun["friction"].p == pytest.approx(TRUE, abs=0.03)
    # The background goes with it, so that the effect is held against the best rig without it.
    assert better.evidence > base.evidence + 3.0 and better.p[1] == pytest.approx(TRUE[1], abs=0.02)
    assert (better.sd == base.sd).all() and abs(better.p[3]) < 0.1


def test_a_background_that_is_close_or_forces_that_say_little_begin_nothing(simulator: FakeSimulator) -> None:
    base = background(simulator)
    weak = {"friction": Start(FRICTION, TRUE, 0.5 * SPEAKS)}
    assert begun_by_forces(simulator, base, (FRICTION,), weak) == (base, weak)  # type: ignore[arg-type]
    assert begun_by_forces(simulator, base, (FRICTION,), {}) == (base, {})  # type: ignore[arg-type]
    close = FakeSimulator(valleys, target(valleys(np.zeros(8))))
    near = background(close)
    strong = {"friction": Start(FRICTION, TRUE, 10 * SPEAKS)}
    assert begun_by_forces(close, near, (FRICTION,), strong) == (near, strong)  # type: ignore[arg-type]


@pytest.mark.parametrize("there", [True, False])
def test_another_structure_is_sought_unless_an_effect_explains_the_records(
    there: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulator = FakeSimulator(valleys, target(valleys(TRUE)))
    sought = []
    monkeypatch.setattr(by_forces, "restructured", lambda here, base, *more: sought.append(base) or base)
    starts = {"friction": Start(FRICTION, TRUE if there else -3.0 * TRUE, 2 * SPEAKS)}
    base = background(simulator)
    begun_by_forces(simulator, base, (FRICTION,), starts)  # type: ignore[arg-type]
    assert len(sought) == (0 if there else 1)


def test_where_the_forces_own_rig_is_none_the_effect_alone_is_begun_with_what_is_around(
    simulator: FakeSimulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A rig that leads astray or cannot be simulated says nothing against the effect that it has."""
    base, asked = background(simulator), []
    own = np.isin(np.arange(8), FRICTION.entries(unknowns()))  # type: ignore[arg-type]
    start = Start(FRICTION, np.where(own, TRUE, 50.0), 2 * SPEAKS)

    def around(held: np.ndarray) -> np.ndarray:
        asked.append(held)
        return np.where(np.arange(8) == 1, TRUE, held)

    monkeypatch.setattr(by_forces, "seen_by", lambda shown, unknowns, held: shown.around(held))
    monkeypatch.setattr(by_forces, "levelled", lambda simulator, seen, held, sd: seen)
    better, begun = begun_by_forces(simulator, base, (FRICTION,), {"friction": start}, Shown(around))  # type: ignore[arg-type]
    assert asked[0] == pytest.approx(np.where(own, TRUE, 0.0))
    assert begun["friction"].p == pytest.approx(TRUE, abs=0.03) and better.evidence > base.evidence + 3.0

"""What simulation justifies: what changes between repetitions as far as it matters."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gearbench.diagnosis.effects.eccentricity import ECCENTRICITY
from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.found_by_simulation import changing_of, doubtful, why
from gearbench.diagnosis.judging.closing import Closing
from gearbench.diagnosis.judging.judged import Sizes
from gearbench.diagnosis.selection.weighing import Weighed


@pytest.mark.parametrize(("final", "found"), [(0.1, 0.06 / 0.7), (0.25, 0.0)])
def test_what_changes_counts_where_it_makes_what_is_left_a_tenth_larger(final: float, found: float) -> None:
    """0.06 of a channel beside 0.1 of noise and remainder make 0.117 of it, beside 0.25 no more than 0.257."""
    sizes = {"dte": Sizes(1.0, 0.7, 0.3, final, 0.1), "y_driver": Sizes(10.0, 7.0, 3.0, 2.0, 0.1)}
    judged: Any = SimpleNamespace(sizes=sizes)
    assert changing_of(judged, {"dte": 0.06, "y_driver": 0.05, "torque_driven": 1.0}) == pytest.approx(found)
    assert changing_of(judged, {}) == 0.0


@pytest.mark.parametrize(("plain", "kept", "said"), [(1.05, None, True), (1.2, None, False), (1.05, {}, False)])
def test_it_is_said_where_good_rigs_shares_of_other_effects_close_as_much(plain: float, kept: Any, said: bool) -> None:
    one = Weighed(Hypothesis("run-out", "mesh", (Wide("none"),), effect=ECCENTRICITY), 60.0, None)
    judged: Any = SimpleNamespace(
        sizes={"dte": Sizes(9e-6, 2e-6, plain * 1e-6, 1e-6, 1e-7)},
        closings={"run-out": Closing(60.0, 250.0, ("dte", "0–190"), {})},
        share_of=lambda effect: 0.99,
        kept=kept,
        dropped=(),
    )
    first, *more = why(judged, (one,))
    assert first.startswith(f"Without {ECCENTRICITY.noun} the gap")
    assert [f"({plain:.2f} um, and 1.00 um" in sentence for sentence in more] == [True] * said
    assert not why(judged, ())


@pytest.mark.parametrize("named", [True, False])
def test_what_leads_astray_is_left_out_whether_or_not_it_would_be_named(named: bool) -> None:
    """Beside what a force without a name explains better it would be called unknown."""
    one = Weighed(Hypothesis("run-out", "mesh", (Wide("none"),), effect=ECCENTRICITY), 60.0, None)
    found = SimpleNamespace(selection=SimpleNamespace(entered=(one,)))
    decided: Any = SimpleNamespace(named=(one,) if named else ())
    of: Any = None
    chances: Any = SimpleNamespace(named={"run-out": 0.9})
    judged: Any = SimpleNamespace(found=found, is_astray=True, target=None)
    out, (said,), _ = doubtful(of, judged, decided, chances)
    assert out == (one,) and ECCENTRICITY.noun[1:] in said
    near: Any = SimpleNamespace(found=found, is_astray=False, target=None)
    assert doubtful(of, near, decided, chances) == ((), [], {})

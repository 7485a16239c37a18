"""What a verdict lists of all that was weighed, of selections and gaps made by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gearbench.diagnosis.effects.effect import Effect, Hypothesis, Wide
from gearbench.diagnosis.effects.friction import FRICTION
from gearbench.diagnosis.effects.pitch_error import PITCH_ERROR
from gearbench.diagnosis.effects.torque_ripple import TORQUE_RIPPLE
from gearbench.diagnosis.forces.unknowns import group, unknowns_of
from gearbench.diagnosis.judging.candidates import candidates_of
from gearbench.diagnosis.judging.closing import Closing
from gearbench.diagnosis.judging.judged import Sizes
from gearbench.diagnosis.selection.weighing import Weighed

HELD_OUT: Any = SimpleNamespace(name="heavy")
Listed = dict[tuple[str, ...], tuple[float, float | None]]


def optimum(evidence: float, left: float = 0.0) -> Any:
    """An optimum that leaves a part of the held-out record when it is simulated: its only unknown."""
    return SimpleNamespace(evidence=evidence, p=left, sd=np.array([2.0]))


def held(evidence: float) -> Any:
    """One that was found with backgrounds held, and has its evidence where that of the effect alone is."""
    return SimpleNamespace(evidence=evidence + 165.0, evidence_under=lambda sd: evidence - 1e6 * float(sd.sum()))


def weighed(effect: Effect, nats: float, left: float, which: str = "") -> Weighed:
    hypothesis = Hypothesis(f"{effect.name}{which}", "mesh", (Wide("none"),), effect=effect)
    return Weighed(hypothesis, nats, optimum(nats, left))


def closing(optimum: Any, left: float, own: float | None) -> Closing:
    signals: Any = {"dte": left}
    return Closing(9.0, 2.0, ("dte", "other"), signals, optimum=optimum, own=own and {"dte": own})  # type: ignore[arg-type]


def listed(
    entered: Sequence[Weighed],
    others: Sequence[Weighed],
    without: Mapping[str, tuple[float, float]],
    *,
    nudged: bool = False,
    measured: Any = HELD_OUT,
    own: float | None = None,
) -> Listed:
    """Evidence and gap by effects; `without`: by hypothesis' name evidence and gap without it, `own` if that is another
    by its own motion. The plain rig leaves 0.9, that with all that entered 0.1, what is simulated its own unknown."""

    def channels(p: float, held: Any) -> dict[str, float]:
        if p < 0.0:
            raise ValueError("a rig that answers nothing")
        return {"dte": p}

    judged: Any = SimpleNamespace(
        measured=measured,
        plain={"dte": 0.9},
        signals={"dte": 0.1} if entered else {"dte": 0.9},
        closings={
            name: closing(held(evidence), left, own)
            for name, (evidence, left) in without.items()
        },
        sizes={"dte": Sizes(1.0, 1.0, 0.9, 0.1, 0.01)},
        rms_left=lambda channel, signals: signals[channel],
        found=SimpleNamespace(
            layout=SimpleNamespace(unknowns=unknowns_of([group("none", "1", 1, 0.4, slot="x")], 1)),
            simulator=SimpleNamespace(anchored=not nudged, free=SimpleNamespace(channels=channels)),
            selection=SimpleNamespace(
                base=optimum(-50.0), best=optimum(70.0), entered=tuple(entered), weighed=(*entered, *others)
            ),
        ),
    )
    return {one.effects: (one.log_evidence, one.held_out) for one in candidates_of(judged, HELD_OUT)}


PITCH, CRACKLESS = weighed(PITCH_ERROR, 60.0, 0.3), weighed(FRICTION, -1.0, 0.2)
RIPPLE = weighed(TORQUE_RIPPLE, 40.0, 0.7)
ONE = {PITCH.hypothesis.name: (-50.0, 0.8)}


def test_one_that_entered_is_held_against_the_rig_without_any_part_of_it() -> None:
    found = listed([PITCH], [RIPPLE, CRACKLESS], ONE)
    assert found[("pitch-error",)] == (60.0, 0.1) and found[()] == (0.0, 0.9)
    assert found[("torque-ripple",)] == (40.0, 0.7)
    # Nothing is simulated of what has no evidence.
    assert found[("friction",)] == (-1.0, None) and len(found) == 4
    assert list(found) == sorted(found, key=lambda effects: -found[effects][0])


def test_of_two_that_entered_each_is_left_out_alone() -> None:
    found = listed([PITCH, RIPPLE], [], {"pitch-error": (-10.0, 0.5), "torque-ripple": (15.0, 0.11)})
    assert found[("pitch-error", "torque-ripple")] == (120.0, 0.1)
    # Without the pitch errors the ripple is left, and the other way round.
    assert found[("torque-ripple",)] == (40.0, 0.5) and found[("pitch-error",)] == (60.0, 0.11)


def test_a_gap_is_that_of_a_rig_by_its_own_motion() -> None:
    """Of what was judged along the record's way too, as the gap of all that entered is."""
    gaps = {"pitch-error": (-10.0, 0.5), "torque-ripple": (15.0, 0.11)}
    assert listed([PITCH, RIPPLE], [], gaps, own=0.7)[("torque-ripple",)] == (40.0, 0.7)


def test_of_three_the_pairs_that_stay_are_listed_with_their_evidence() -> None:
    entered = [PITCH, RIPPLE, weighed(FRICTION, 20.0, 0.2)]
    without = {"pitch-error": (5.0, 0.5), "torque-ripple": (10.0, 0.3), "friction": (30.0, 0.15)}
    found = listed(entered, [], without)
    assert found[("pitch-error", "torque-ripple")] == (80.0, 0.15)
    assert found[("torque-ripple", "friction")] == (55.0, 0.5)
    # Alone each is simulated as it was weighed.
    assert found[("friction",)] == (20.0, 0.2) and len(found) == 8


def test_an_effect_in_two_places_is_not_taken_for_left_out_with_one_of_them() -> None:
    both = [weighed(PITCH_ERROR, 60.0, 0.3, " of the driver"), weighed(PITCH_ERROR, 30.0, 0.4, " of the driven gear")]
    found = listed(both, [], {one.hypothesis.name: (0.0, 0.6) for one in both})
    assert found == {("pitch-error",): (60.0, 0.1), (): (0.0, 0.9)}


@pytest.mark.parametrize("others", [weighed(FRICTION, 5.0, -1.0), weighed(FRICTION, 5.0, 0.2)])
def test_what_cannot_be_said_of_the_held_out_record_is_left_out(others: Weighed) -> None:
    # A rig that answers nothing; records that are nudged, where what was weighed goes its own way unfitted.
    assert listed([PITCH], [others], ONE, nudged=others.optimum.p > 0.0)[("friction",)] == (5.0, None)  # type: ignore[union-attr]
    # A verdict that was judged by a record of its search says nothing of another.
    assert all(gap is None for _, gap in listed([PITCH], [others], ONE, measured=object()).values())

"""Decisions on what was judged, made by hand: what is named, what is refused, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.effects.library import LIBRARY
from gearbench.diagnosis.effects.mesh_damping import MESH_DAMPING
from gearbench.diagnosis.evidence.calibration import LIMITS
from gearbench.diagnosis.evidence.decision import Decision
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.steadiness import Unsteady
from gearbench.diagnosis.forces.unknowns import group, unknowns_of
from gearbench.diagnosis.judging.decided import (
    AGAINST,
    FREE,
    GREATER,
    HIDING,
    LEAST_FREE,
    PLAIN,
    VISIBLE,
    Decided,
    decide_simulated,
    unexplained,
)
from gearbench.diagnosis.odds import Odds
from gearbench.diagnosis.population import POPULATION
from gearbench.diagnosis.remainder.drift import Drift
from gearbench.diagnosis.remainder.free_forces import Form, FreeForce
from gearbench.diagnosis.remainder.missing import OUTSTANDING, Missing
from gearbench.diagnosis.selection.weighing import Weighed
from gearbench.diagnosis.structure.structure import LATE
from gearbench.diagnosis.verdict import Outcome
from gearbench.diagnosis.words import percent

EFFECT = next(one for one in LIBRARY if one.name == "friction")
DAMPING = Hypothesis("mesh-damping", "mesh", (Wide("friction"),), effect=MESH_DAMPING)
FRICTION = Hypothesis("friction", "mesh", (Wide("friction"),), effect=EFFECT)
QUIET = np.zeros(5)
STRUCTURE = POPULATION.structure
CLOCK = unknowns_of([group(LATE, "s", ("torque_driver",), 1e-5, slot="structure")], 0)
AT_LIMIT = Odds((-1e-9, 9.0), ((0.0, 0.0), (0.0, 0.0)))
HAND = replace(LIMITS, competitor_factor=1.5, competitor_offset=20.0, free=10.0)


def decided(
    worth: float | None,
    *,
    left: float = 0.05,
    remains: float = 0.05,
    searched: float | None = None,
    hidden: float = 0.0,
    share: float = 0.2,
    free: float = 0.0,
    excess: np.ndarray = QUIET,
    unsteady: np.ndarray = QUIET,
    changing: float = 0.0,
    drift: Drift | None = None,
    late: float = 0.0,
    kept: bool = False,
    forces: Sequence[FreeForce] = (),
    curve: Odds | None = None,
    beyond: float = np.inf,
    effects: Sequence[Hypothesis] = (FRICTION,),
    anchored: bool = True,
) -> Decided:
    """`worth` nats of `effects` (None: nothing was kept), which closes `share` of the gap; `left` of the nominal gap,
    `remains` of a channel's fluctuation in the end, `searched` (None: as much) on the records of the search,
    whose noise may hide `hidden` of it; `forces` without a name; the drive acts `late` s, of sound rigs 1e-5; the
    rig is `kept` on the record's way. Something unknown is as likely as not where a sign of it is at its limit, unless
    there is another `curve`. The transmission error is left with `beyond` times its noise more than that."""
    entered: tuple[Any, ...] = ()
    if worth is not None:
        entered = tuple(Weighed(one, worth, None) for one in effects)
    judged: Any = SimpleNamespace(
        found=SimpleNamespace(
            selection=SimpleNamespace(entered=entered, weighed=entered, best=SimpleNamespace(p=np.array([late]))),
            layout=SimpleNamespace(unknowns=CLOCK),
            simulator=SimpleNamespace(anchored=anchored),
        ),
        share_of=lambda effect: share,
        left=left,
        remains=remains,
        most_left=("torque_driven", remains),
        searched=remains if searched is None else searched,
        hidden=hidden,
        kept={} if kept else None,
        beyond_noise=beyond,
    )
    form = SimpleNamespace(hypothesis=Hypothesis("free drive", "drive", ()), log_bayes_factor=free)
    search: Any = SimpleNamespace(best_free=form if free else None, tried=())
    missing = Missing(excess, ((0.0, 100.0),), np.ones((1, 5)))
    known = replace(POPULATION, changing=0.03, unknown=curve or AT_LIMIT)
    unsettled = Unsteady(unsteady, unsteady)
    return decide_simulated(judged, search, missing, unsettled, changing, HAND, known, drift, forces)


def at(number: int, value: float) -> np.ndarray:
    return np.where(np.arange(5) == number, value, 0.0)


def test_what_was_kept_is_named_at_its_place_even_if_a_remainder_stays() -> None:
    made = decided(40.0)
    assert (made.verdict, made.place) == ("effects", "mesh")
    made = decided(40.0, left=0.9, remains=5 * STRUCTURE, excess=at(0, 50.0), share=0.85)
    assert made.verdict == "effects" and made.sign > 1.0
    assert decided(None).verdict == "none"


def test_the_greater_part_unexplained_is_unknown_unless_any_rig_leaves_as_much() -> None:
    much = {"left": 1.1 * GREATER, "remains": 1.1 * STRUCTURE}
    assert decided(None, **much).verdict == "unknown" and decided(None, **much).place == "none"
    assert decided(None, **much, excess=at(3, 2 * OUTSTANDING["driven-support"])).place == "driven-support"
    assert decided(None, **(much | {"left": 0.9 * GREATER})).verdict == "none"
    assert decided(None, **(much | {"remains": 0.9 * STRUCTURE})).verdict == "none"


DAMPER = "damping at the driven support that is not in proportion to the rate"


def damper(worth: float, size: float = 0.2) -> FreeForce:
    return FreeForce(Form("damper", "driven-support"), worth, size)


def test_a_force_without_a_name_is_unknown_where_nothing_else_is_and_its_size_is_one() -> None:
    made = decided(None, forces=[damper(1.2 * FREE)])
    assert (made.verdict, made.place) == ("unknown", "driven-support") and made.sign == pytest.approx(1.2)
    assert made.because[0].startswith(f"{DAMPER} explains the records clearly better (18 nats, 20 %")
    made = decided(None, forces=[damper(0.8 * FREE)])
    assert made.verdict == "none" and made.sign == pytest.approx(0.8)
    for size in (-0.9 * LEAST_FREE, 1.1 * AGAINST):
        assert decided(None, forces=[damper(3 * FREE, size), damper(2 * FREE)]).verdict == "none"
    assert decided(None, forces=[damper(3 * FREE, size=1.5), damper(2 * FREE)]).sign == pytest.approx(3.0)
    assert decided(None, forces=[damper(2 * FREE, size=-0.3), damper(1.2 * FREE)]).sign == pytest.approx(2.0)


def test_what_stands_out_has_a_place_before_a_force_without_a_name() -> None:
    much: dict[str, Any] = {"left": 1.1 * GREATER, "remains": 1.1 * STRUCTURE, "forces": [damper(3 * FREE)]}
    assert decided(None, **much).place == "driven-support"
    assert decided(None, **much, excess=at(0, 2 * OUTSTANDING["drive"])).place == "drive"


def test_a_force_without_a_name_outbids_what_closes_little_whatever_is_left() -> None:
    much: dict[str, Any] = {"remains": 0.1 * STRUCTURE, "forces": [damper(1.1 * (1.5 * 40.0 + 20.0))]}
    assert decided(40.0, **much).place == "driven-support"
    assert decided(50.0, **much).verdict == "effects"
    made = decided(40.0, **much, share=0.6)
    assert made.verdict == "effects" and made.because[1].startswith(f"{DAMPER} explains what is left")
    assert len(decided(40.0, forces=[damper(0.9 * FREE)]).because) == 1


def test_a_damping_ratio_that_stands_for_another_law_is_unknown() -> None:
    other = FreeForce(Form("damper", "mesh"), 1.2 * FREE, 0.4)
    made = decided(190.0, share=0.8, forces=[other], effects=[DAMPING])
    assert (made.verdict, made.place, made.named) == ("unknown", "mesh", ()) and made.sign == pytest.approx(1.2)
    assert made.because[0].endswith(f"{MESH_DAMPING.noun} may only make up for it")
    # Not where it is no more than sound rigs have, elsewhere, or beside another effect.
    assert decided(190.0, forces=[replace(other, worth=0.9 * FREE)], effects=[DAMPING]).verdict == "effects"
    assert decided(190.0, forces=[damper(1.2 * FREE)], effects=[DAMPING]).verdict == "effects"
    assert decided(190.0, forces=[other], effects=[DAMPING, FRICTION]).verdict == "effects"
    assert decided(190.0, forces=[other]).verdict == "effects"


def test_a_rig_further_from_the_judged_record_than_the_nominal_one_names_nothing() -> None:
    off = {"left": 1.3, "remains": 1.1 * STRUCTURE}
    made = decided(40.0, **off)
    assert (made.verdict, made.named) == ("unknown", ()) and made.sign > 1.0
    assert "friction" in made.because[0] and "130 %" in made.because[0]
    assert decided(40.0, **(off | {"left": 0.9})).verdict == "effects"
    # What any rig leaves is no cause for doubt.
    assert decided(40.0, **(off | {"remains": 0.9 * STRUCTURE})).verdict == "effects"


def test_an_effect_that_closes_less_than_what_stands_out_elsewhere_only_makes_up_for_it() -> None:
    far: dict[str, Any] = {"left": 0.5, "remains": 1.1 * VISIBLE * STRUCTURE, "excess": at(0, 3 * OUTSTANDING["drive"])}
    made = decided(40.0, share=0.2, **far)
    assert (made.verdict, made.place, made.named) == ("unknown", "drive", ()) and "friction" in made.because[0]
    assert decided(40.0, share=0.3, **far).verdict == "effects"
    assert decided(40.0, share=0.2, **(far | {"remains": 0.9 * VISIBLE * STRUCTURE})).verdict == "effects"
    assert decided(40.0, share=0.2, **(far | {"excess": QUIET})).verdict == "effects"


def test_an_effect_that_closes_less_than_what_is_left_of_a_channel_only_makes_up_for_something() -> None:
    """A resonance on a shaft looks like a stiffer support to the angles, and leaves the reaction as it was."""
    much: dict[str, Any] = {"left": 0.33, "remains": 2 * PLAIN * STRUCTURE}
    made = decided(40.0, share=0.04, **much)
    assert (made.verdict, made.place, made.named) == ("unknown", "none", ()) and made.sign == pytest.approx(2.0)
    assert made.because[0].startswith(f"{percent(much['remains'])} of the torque on the driven gear is left")
    assert "more than friction between the flanks would close" in made.because[0]
    assert decided(40.0, share=0.33**2 + 0.01, **much).verdict == "effects"
    assert decided(40.0, share=0.04, **(much | {"remains": 0.9 * PLAIN * STRUCTURE})).verdict == "effects"
    assert decided(40.0, share=0.04, **much, searched=0.9 * PLAIN * STRUCTURE).verdict == "effects"


def test_records_that_are_explained_and_predict_no_other_do_not_determine_the_rig() -> None:
    off = {"left": 1.1 * GREATER, "remains": 1.5 * STRUCTURE}
    made = decided(None, **off, searched=0.2 * STRUCTURE)
    assert made.verdict == "none" and "do not determine the rig" in made.because[0]
    assert decided(None, **off, searched=1.1 * STRUCTURE).verdict == "unknown"


def test_records_whose_noise_hides_what_is_left_say_nothing_for_a_sound_rig() -> None:
    off = {"left": 1.1 * GREATER, "remains": 1.5 * HIDING, "searched": 0.0}
    assert decided(None, **off, hidden=0.9 * HIDING).verdict == "none"
    assert decided(None, **off, hidden=1.1 * HIDING).verdict == "unknown"


def test_a_place_that_stands_out_is_unknown_only_over_a_visible_remainder() -> None:
    out = at(0, 1.1 * OUTSTANDING["drive"])
    made = decided(None, remains=1.1 * VISIBLE * STRUCTURE, excess=out)
    assert (made.verdict, made.place) == ("unknown", "drive")
    assert decided(None, remains=0.9 * VISIBLE * STRUCTURE, excess=out).verdict == "none"
    assert decided(None, remains=1.1 * STRUCTURE, excess=at(0, 0.9 * OUTSTANDING["drive"])).verdict == "none"


def test_a_drive_that_acts_long_after_its_torque_is_measured_is_something_unknown_at_the_drive() -> None:
    made = decided(None, late=4e-5)
    assert (made.verdict, made.place) == ("unknown", "drive") and made.sign == pytest.approx(4 / 3)
    assert "40 us after its channel" in made.because[0] and "before" in decided(None, late=-4e-5).because[0]
    assert decided(None, late=2e-5).verdict == "none"
    assert decided(40.0, late=4e-5).verdict == "effects"


def test_what_is_likelier_unknown_than_not_is_so_below_every_limit() -> None:
    """By what rigs with a known answer were found to leave, at the place that stands out."""
    curve = Odds((1.0, 2.0), ((0.0, 0.0), (0.0, 0.0)))
    even = np.exp(-0.5)
    some = {"remains": 0.99 * even * STRUCTURE * VISIBLE, "excess": at(0, 2 * OUTSTANDING["drive"])}
    made = decided(None, **some, curve=curve)
    assert made.verdict == "none" and made.sign == pytest.approx(0.99 * even)
    some["remains"] *= 1.02 / 0.99
    made = decided(None, **some, curve=curve)
    assert (made.verdict, made.place) == ("unknown", "drive") and made.sign == pytest.approx(1.02 * even)
    likely = percent(1 / (1 + np.exp(-1 - 2 * np.log(1.02 * even))))
    assert f"likelier at work than not ({likely})" in made.because[0]
    assert decided(None, **some).verdict == "none"
    # Nobody sees what the transmission error's noise hides.
    hidden = decided(None, **some, curve=curve, beyond=0.5)
    assert hidden.verdict == "none" and hidden.sign == 0.5
    assert decided(None, **some, curve=curve, beyond=1.0).verdict == "unknown"
    far = {"remains": 1.1 * VISIBLE * STRUCTURE, "excess": at(0, 1.1 * OUTSTANDING["drive"])}
    assert decided(None, **far, beyond=0.5).verdict == "unknown"


def test_the_sign_of_something_unknown_follows_the_remainder() -> None:
    stands = [at(0, factor * OUTSTANDING["drive"]) for factor in (0.5, 1.1, 8.0)]
    signs = [decided(None, remains=1.2 * STRUCTURE, excess=one).sign for one in stands]
    assert signs == pytest.approx([1.2 / PLAIN, 1.1, 1.2 / VISIBLE])
    assert decided(None, remains=3.0 * STRUCTURE).sign == pytest.approx(3.0 / PLAIN)


def test_none_says_where_its_remainder_was_seen() -> None:
    assert "what remains, at most" in decided(None, remains=0.5 * STRUCTURE).because[0]
    there = decided(None, remains=0.5 * STRUCTURE, kept=True)
    assert there.verdict == "none" and "what remains, kept on the record's way, at most" in there.because[0]


def test_far_more_than_any_sound_rig_leaves_is_unknown_whatever_part_of_the_gap_it_is() -> None:
    far = 1.1 * PLAIN * STRUCTURE
    made = decided(None, left=0.1, remains=far, excess=at(4, 0.3 * OUTSTANDING["mesh"]))
    assert (made.verdict, made.place) == ("unknown", "mesh") and percent(STRUCTURE) in made.because[0]
    assert decided(None, left=0.1, remains=far).place == "none"
    assert decided(None, left=0.1, remains=far, searched=0.9 * PLAIN * STRUCTURE).verdict == "none"
    # Noise of the search that may hide as much does not show it.
    assert decided(None, left=0.1, remains=far, searched=0.0, hidden=far).verdict == "none"
    assert decided(40.0, left=0.1, remains=far).verdict == "effects"


def test_a_place_is_told_that_stands_out_far_more_than_any_other_or_where_most_stays() -> None:
    """Of two alike, as the report says, the one where most is missing: only if the greater part of the gap is."""
    greater: dict[str, Any] = {"left": 1.1 * GREATER, "remains": 1.1 * STRUCTURE}
    far: dict[str, Any] = {"left": 0.1, "remains": 1.1 * PLAIN * STRUCTURE}
    faint = at(4, 0.5 * OUTSTANDING["mesh"])
    two = faint + at(0, 0.3 * OUTSTANDING["drive"])
    for left, alike in ((greater, "mesh"), (far, "none")):
        assert decided(None, **left, excess=faint).place == "mesh"
        assert decided(None, **left, excess=two).place == alike
        assert decided(None, **left, excess=0.3 * faint).place == "none"


def test_a_form_without_a_name_outbids_only_an_effect_that_leaves_the_gap() -> None:
    seen = 1.1 * STRUCTURE
    assert decided(40.0, free=90.0, remains=seen).verdict == "unknown"
    assert decided(40.0, free=70.0, remains=seen).verdict == "effects"
    assert decided(40.0, share=0.8, free=900.0, remains=seen).verdict == "effects"
    assert decided(None, free=900.0, remains=seen).verdict == "none"
    # Where nothing that can be seen is left a form without a name has nothing to explain.
    assert decided(40.0, free=900.0, remains=0.9 * STRUCTURE).verdict == "effects"
    # Its place, by equations without structure, gives way to that where the rig found lacks a force.
    assert decided(40.0, free=90.0, remains=seen).place == "drive"
    made = decided(40.0, free=90.0, remains=seen, excess=at(4, 2 * OUTSTANDING["mesh"]))
    assert made.place == "mesh" and "at the drive without any given form" in made.because[0]
    assert made.because[0].endswith("stands out in the mesh")


def test_what_changes_counts_by_its_part_of_the_gap() -> None:
    out = at(3, 1.1 * HAND.unsteady["driven-support"])
    made = decided(900.0, unsteady=out, changing=0.3)
    assert (made.verdict, made.place) == ("unknown", "driven-support") and "repetition" in made.because[0]
    assert decided(900.0, unsteady=out, changing=0.02).verdict == "effects"
    unseen = decided(None, unsteady=out, changing=0.0)
    assert unseen.verdict == "none" and "what is left hardly grows by it" in unseen.because[-1]
    quiet = decided(None, unsteady=out, changing=0.02)
    # What drifts is told even where the gap does not come from it.
    assert quiet.verdict == "none" and "changes from one repetition to the next" in quiet.because[-1]
    assert "2.0 % of the gap" in quiet.because[-1] and len(decided(None).because) == 1
    assert decided(None, unsteady=out, changing=0.04).place == "driven-support"
    assert decided(900.0, unsteady=out, changing=0.3, share=0.8).verdict == "effects"
    # A small part of a gap is no less explained for what changes being a smaller one still.
    small = decided(900.0, unsteady=out, changing=0.04, share=0.006)
    assert small.verdict == "effects" and "4.0 % of the gap" in small.because[-1]
    assert decided(900.0, unsteady=out, changing=0.04, share=0.004).verdict == "unknown"


def test_a_drift_that_explains_what_changes_is_named_and_speaks_against_nothing() -> None:
    support, drift = at(1, 1e4), Drift("driver-support", -0.07, 0.002, 0.98, 200.0)
    unknown = decided(None, unsteady=support, changing=0.2)
    assert (unknown.verdict, unknown.place, unknown.drift) == ("unknown", "driver-support", None)
    alone = decided(None, unsteady=support, changing=0.2, drift=drift)
    assert (alone.verdict, alone.place, alone.named, alone.drift) == ("effects", "driver-support", (), drift)
    assert "98 %" in alone.because[0] and "-7" in alone.because[0]
    both = decided(40.0, unsteady=support, changing=0.2, drift=drift)
    assert both.verdict == "effects" and both.place == "mesh" and both.drift is drift and len(both.named) == 1
    # Records that hardly change need none, and a gap that stays is not closed by one.
    # As much as a sound rig has is named where it makes a part of the nominal gap, more where what is left grows by it.
    for value, changing, verdict in ((-0.07, 0.01, "effects"), (-0.07, 0.0, "none"), (-0.012, 0.01, "none"),
                                     (-0.012, 0.2, "effects")):  # fmt: skip
        smaller = replace(drift, value=value)
        assert decided(None, unsteady=support, changing=changing, drift=smaller).verdict == verdict
    # Forces that see nothing do not speak against one beyond a sound rig's that the records call for.
    for unseen, verdict in ((drift, "effects"), (replace(drift, value=-0.012), "none"),
                            (replace(drift, nats=7.0), "none")):  # fmt: skip
        assert decided(None, changing=0.2, drift=unseen).verdict == verdict
    # What it does not explain speaks for something unknown, unless an effect outweighs that.
    fifth = replace(drift, share=0.2)
    assert decided(None, unsteady=support, changing=0.2, drift=fifth).verdict == "unknown"
    # Where flanks part in all records they must.
    assert decided(None, changing=0.2, drift=drift, anchored=False).verdict == "none"
    assert decided(None, unsteady=support, changing=0.2, drift=drift, anchored=False).verdict == "effects"
    left = decided(None, unsteady=support, changing=0.2, drift=drift, left=0.9, remains=0.9)
    assert left.verdict == "unknown" and left.drift is None and "98 %" in left.because[-1]


@pytest.mark.parametrize(
    ("verdict", "left", "told"), [("none", 0.9, "unknown"), ("none", 0.4, "none"), ("effects", 0.9, "effects")]
)
def test_forces_alone_do_not_call_a_gap_nothing_whose_greater_part_stays(
    verdict: Outcome, left: float, told: Outcome
) -> None:
    before = Decision(verdict, "none" if verdict == "none" else "mesh", None, 0.3, "it is so")
    parts = (0.1, 0.2, 0.6, 0.3, 0.1)
    silent = np.array([LIMITS.silent[place] * part for place, part in zip(PLACES, parts, strict=True)])
    after = unexplained(before, silent, left)
    assert after.verdict == told
    if told == verdict:
        assert after is before
    else:
        assert after.place == PLACES[2] and after.sign == pytest.approx(1.8)

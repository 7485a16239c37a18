"""What is explained and what remains: energies of gaps made by hand, their places, and the sentences."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gearbench.diagnosis.account import (
    parts_of,
    place_in,
    places_of,
    sentence_of_effect,
    sentence_of_judging,
    sentence_of_rivals,
    sentences_of_gap,
    weights,
)
from gearbench.diagnosis.effects.eccentricity import ECCENTRICITY
from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.encoder_runout import ENCODER_RUNOUT
from gearbench.diagnosis.effects.friction import FRICTION
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.judging.closing import Closing
from gearbench.diagnosis.remainder.missing import OUTSTANDING, SILENT, Missing, nothing_missing
from gearbench.diagnosis.verdict import Gap, Range

BANDS = ((0.0, 200.0), (200.0, 3000.0))


def at(place: str, value: float) -> np.ndarray:
    return np.where(np.array(PLACES) == place, value, 0.0)


def about(value: float) -> Range:
    return Range(value=value, low=0.9 * value, high=1.1 * value)


def gap(band: tuple[float, float], nominal: float, last: float, floor: float = 1e-7, channel: str = "dte") -> Gap:
    unit = "N m" if channel == "torque_driven" else "m"
    return Gap(
        record="r", channel=channel, band_hz=band, unit=unit, nominal=about(nominal), recalibrated=about(4e-6),
        with_effect=about(last), floor=about(floor),
    )  # fmt: skip


GAPS = (
    gap((0.0, 3000.0), 5e-6, 3e-6),
    gap((0.0, 200.0), 3e-6, 1.5e-7),
    gap((200.0, 3000.0), 4e-6, 2.9e-6),
    gap((0.0, 0.0), 4e-6, 2.9e-6),
)
# The drive stands out twice as far as the mesh, but lacks its force above 200 Hz alone.
MISSING = Missing(
    2 * at("drive", OUTSTANDING["drive"]) + at("mesh", OUTSTANDING["mesh"]),
    BANDS,
    np.stack([at("mesh", 30.0), at("drive", 12.0) + at("mesh", 40.0)]),
)


def test_places_share_what_remains_by_how_far_they_stand_out() -> None:
    assert weights(MISSING) == pytest.approx(at("drive", 2 / 3) + at("mesh", 1 / 3))
    assert place_in(MISSING, (0.0, 200.0)) == "mesh" and place_in(MISSING, (200.0, 3000.0)) == "drive"
    # What the force residuals account for by a filter of an equation's own does not stand out there.
    silent = 0.1 * at("drive", SILENT["drive"]) + 9 * at("mesh", SILENT["mesh"])
    assert weights(replace(MISSING, silent=silent)) == pytest.approx(at("drive", 0.1 / 1.1) + at("mesh", 1 / 1.1))
    assert place_in(nothing_missing(), (0.0, 200.0)) == "none"
    judged: Any = type("J", (), {"closings": {"f": Closing(9.0, 2.0, ("dte", "excited"), {})}, "left": 0.5})()
    judged.share_of = lambda effect: 0.5
    friction = Hypothesis("f", "sensor", ())
    shares = {one.name: one.share for one in places_of(judged, (friction,), MISSING)}
    # Half of the gap is the sensor's; a quarter by energy remains, two thirds of it at the drive.
    assert shares["sensor"] == pytest.approx(0.5 / 0.75) and shares["drive"] == pytest.approx(0.25 * 2 / 3 / 0.75)
    assert sum(shares.values()) == pytest.approx(1.0)


def test_explained_and_remaining_parts_add_up_by_energy() -> None:
    explained, remaining = parts_of(GAPS, MISSING, ("mesh",))
    whole = next(one for one in explained if one.band_hz == (0.0, 3000.0))
    assert (whole.size, whole.place, whole.unit) == (pytest.approx(4.0), "mesh", "um")
    rest = next(one for one in remaining if one.band_hz == (0.0, 3000.0))
    assert (rest.size, rest.floors, rest.place) == (pytest.approx(3.0), pytest.approx(30.0), "drive")
    assert whole.share + rest.share == pytest.approx(1.0)
    assert whole.low < whole.size < whole.high and (rest.low, rest.high) == pytest.approx((2.7, 3.3))
    # Less than twice the noise is nothing, and the mean is no band.
    assert [one.band_hz for one in remaining if one.channel == "dte"] == [(0.0, 3000.0), (200.0, 3000.0)]
    force = next(one for one in remaining if one.channel == "force")
    assert (force.place, force.size, force.unit) == ("drive", pytest.approx(12.0), "N")


def test_sentences_tell_sizes_band_place_and_noise() -> None:
    _, remaining = parts_of(GAPS, MISSING, ("mesh",))
    first, second = sentences_of_gap(GAPS, remaining)
    assert "explains 36 % of the energy" in first and "5.00 to 4.00 um" in first
    assert "3.00 um rms, 30 times the noise" in second and "200–3000 Hz (2.90 um)" in second
    assert "at the drive; missing forces: 12.0 N at the drive" in second
    quiet = (gap((0.0, 3000.0), 5e-6, 1.1e-7),)
    assert sentences_of_gap(quiet, parts_of(quiet, None)[1])[1].endswith("is measurement noise")
    worse = (GAPS[0].model_copy(update={"recalibrated": about(6e-6)}),)
    assert "does not close" in sentences_of_gap(worse, ())[0]
    words = sentence_of_effect("a cracked tooth", Closing(20.0, 2.53, ("y_driven", "other"), {}), 0.006)
    assert "displacement of the driven gear between the excited lines is 2.5 times as large" in words
    kept = Closing(20.0, 2.53, ("dte", "other"), {}, own={})
    assert "excited lines, kept on the record's way, is 2.5" in sentence_of_effect("a cracked tooth", kept, 0.006)
    assert "at 0–200 Hz" in sentence_of_effect("friction", Closing(20.0, 2.0, ("dte", "0–200"), {}), 0.5)


def test_rivals_are_told_with_what_tells_them_apart() -> None:
    causes = (
        Hypothesis("eccentricity driver", "mesh", (), effect=ECCENTRICITY),
        Hypothesis("encoder-runout driver", "sensor", (), effect=ENCODER_RUNOUT),
        Hypothesis("friction", "mesh", (), effect=FRICTION),
    )
    assert sentence_of_rivals(causes) == (
        "The records cannot tell run-out of a gear (driver) from run-out of an encoder (driver) or friction between the"
        " flanks: either explains them as well"
    )


def test_it_is_said_that_a_record_held_out_could_not_judge() -> None:
    base: Any = SimpleNamespace(name="base", phase_known=True)
    blind: Any = SimpleNamespace(name="fast", phase_known=False)
    (said,) = sentence_of_judging(base, blind)
    assert said.startswith("record fast was held out but cannot judge, since its mesh phase is arbitrary")
    assert "on record base" in said
    known: Any = SimpleNamespace(name="fast", phase_known=True)
    assert "cannot be simulated there" in sentence_of_judging(base, known)[0]
    assert sentence_of_judging(known, known) == sentence_of_judging(base, None) == ()

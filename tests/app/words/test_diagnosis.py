"""Numbers and sentences of a diagnosis."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.diagnosis.effects.library import CHANGING, LIBRARY
from gearbench.diagnosis.intake.signals import CHANNELS
from gearbench.diagnosis.verdict import Detectable, Effect, Gap, Parameter, Probabilities, Range, Smallest, Verdict
from gearbench.figures.gaps.diagnosis_gap import octave_bands
from gearbench.rig.contract import PLACES
from gearbench.words.diagnosis import CHANNELS as CHANNEL_WORDS
from gearbench.words.diagnosis import PLACES as PLACE_WORDS
from gearbench.words.diagnosis import (
    SHORT_CHANNELS,
    confidence,
    detectable_in_words,
    effects_in_words,
    headline,
    length,
    number,
    parameter_in_words,
    parameters_in_words,
    percent,
    whole_band,
    with_std,
)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1234.5, "1230"),
        (0.098765, "0.0988"),
        (9.996, "10.0"),
        (2.5e-5, "2.50e-5"),
        (3.2e7, "3.20e7"),
        (-38.44, "-38.4"),
    ],
)
def test_numbers(value: float, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(("value", "text"), [(0.00939, "0.0094"), (0.123456, "0.123"), (0.00002, "0"), (12.34, "12.3")])
def test_lengths_end_at_a_tenth_of_a_nanometre(value: float, text: str) -> None:
    assert length(value) == text


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (0.05812, 0.00123, "0.0581 ± 0.0012"),
        (49.63, 3.41, "49.6 ± 3.4"),
        (1234.5, 56.7, "1234 ± 57"),
        (7.0, 0.0, "7"),  # of a tooth
        (2.5, 0.0, "2.50"),
        (1.02e8, 3.1e5, "(1.0200 ± 0.0031)e8"),
        (3.1e-5, 2e-6, "(3.10 ± 0.20)e-5"),
    ],
)
def test_a_value_ends_where_its_uncertainty_does(value: float, std: float, text: str) -> None:
    assert with_std(value, std) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(1.0, "100 %"), (0.9999, "> 99 %"), (0.97, "97 %"), (0.028, "2.8 %"), (1e-5, "< 0.1 %"), (0.0, "0 %")],
)
def test_only_certainty_is_called_certain(value: float, text: str) -> None:
    assert percent(value) == text


def test_every_effect_place_and_channel_has_words() -> None:
    assert set(PLACES) == set(PLACE_WORDS)
    for effect in (*LIBRARY, *CHANGING):
        assert effects_in_words([effect.name]) == effect.noun
        assert effect.meaning.endswith(".") and effect.parameters
    assert set(CHANNELS) <= set(CHANNEL_WORDS) == set(SHORT_CHANNELS)
    assert effects_in_words([]) == "the nominal rig"
    assert effects_in_words(["friction", "tooth-crack"]) == "friction between the flanks and a cracked tooth"
    assert effects_in_words(["loose-foot"]) == "loose foot"  # as another program may name it
    assert parameter_in_words("friction", "coefficient") == "coefficient of friction"
    assert parameter_in_words("sensor-delay", "angle_driver.delay") == "delay (angle of the driver)"
    ripple = parameter_in_words("torque-ripple", "order_6.relative_amplitude")
    assert ripple == "amplitude over the mean torque of the conditions (order 6)"
    assert parameter_in_words("loose-foot", "driven.slope") == "slope (driven)"


def gap(channel: str, band: tuple[float, float], nominal: float, with_effect: float | None) -> Gap:
    def about(value: float) -> Range:
        return Range(value=value, low=value, high=value)

    held = None if with_effect is None else about(with_effect)
    return Gap(
        record="r", channel=channel, band_hz=band, unit="m", nominal=about(nominal), recalibrated=about(nominal / 2),
        with_effect=held, floor=None,
    )


FLOOR = Range(value=5e-8, low=4e-8, high=6e-8)


def test_what_is_named_is_told_with_its_numbers() -> None:
    delay = {"angle_driver.delay": Parameter(value=25.0, low=20.0, high=30.0, unit="us")}
    rubs = {"coefficient": Parameter(value=0.0581, low=0.0561, high=0.0601, unit="1")}
    found = Verdict(
        verdict="effects", probability=Probabilities(effect=0.9, none=0.0, unknown=0.1), place="mesh",
        effects=(Effect(name="friction", probability=0.8, parameters=rubs),
                 Effect(name="sensor-delay", probability=0.7, parameters=delay)),
    )  # fmt: skip
    assert parameters_in_words(found) == (
        "Friction between the flanks: coefficient of friction 0.0581 ± 0.0012.",
        "A delay of one sensor: delay (angle of the driver) 25.0 ± 3.0 us.",
    )


def test_the_sentences_of_a_verdict() -> None:
    whole = gap("dte", (0.0, 3000.0), 4e-6, 2.5e-7)
    gaps = (gap("dte", (0.0, 200.0), 9e-6, 1e-6), whole, gap("dte", (0.0, 0.0), 1e-5, 0.0))
    assert whole_band(gaps) == [whole]
    found = Verdict(
        verdict="effects", probability=Probabilities(effect=0.9, none=0.0, unknown=0.1), place="drive", gap=gaps,
        effects=(Effect(name="coupling", probability=0.8), Effect(name="torque-ripple", probability=0.7)),
    )
    assert headline(found) == "Another stiffness of the coupling and ripple of the driving torque explain the gap."
    assert confidence(found) == (
        "Probability of one of the known effects: 90 %. It acts at the drive. On record r (not held out) the rms gap of"
        " the transmission error goes from 4.00 um to 2.00 um recalibrated and 0.250 um with the effects."
    )
    drifts = Effect(name="temperature-drift", probability=0.9)
    also = found.model_copy(update={"effects": (found.effects[0], drifts)})
    assert headline(also) == (
        "Another stiffness of the coupling explains the gap; a stiffness that drifts is at work while the records are"
        " taken."
    )
    alone = found.model_copy(update={"effects": (drifts,)})
    assert headline(alone) == "A stiffness that drifts is at work while the records are taken."
    assert "um with the effect." in confidence(also)  # a rig with what changes between repetitions is none
    blind = found.model_copy(update={"gap": ()})
    assert headline(blind) == "Another stiffness of the coupling and ripple of the driving torque are at work."
    sound = blind.model_copy(update={"verdict": "none", "effects": (), "place": "none"})
    assert headline(sound) == "No known effect is called for; how much of the gap is left cannot be told."
    noisy = gaps[1].model_copy(update={"with_effect": Range(value=1e-6, low=1e-6, high=1e-6), "floor": FLOOR})
    partly = found.model_copy(update={"effects": found.effects[:1], "gap": (noisy,)})
    assert headline(partly) == "Another stiffness of the coupling is at work, and a part of the gap remains."
    assert confidence(partly).endswith(
        "1.00 um with the effect (noise floor 0.0500 um). What remains is 20 times the floor: the rig's own structure,"
        " or another cause."
    )
    assert confidence(partly.model_copy(update={"signs": {"along": 0.15}})).endswith(
        "What remains is 20 times the floor, and 3.0 times it where the rig is kept on the record's way, in which"
        " flanks part."
    )
    small = gaps[1].model_copy(update={"recalibrated": Range(value=5e-7, low=5e-7, high=5e-7)})
    beside = partly.model_copy(update={"gap": (small,)})
    assert headline(beside) == (
        "Another stiffness of the coupling is at work, beside a recalibration that explains most of the gap."
    )
    refused = Verdict(
        verdict="unknown", probability=Probabilities(effect=0.1, none=0.0, unknown=0.9), place="none", held_out="r",
        gap=(gap("dte", (0.0, 3000.0), 4e-6, None),),
    )
    assert headline(refused) == "None of the known effects explains the gap."
    assert confidence(refused) == (
        "Probability of a cause that is not known: 90 %. On the held-out record r the rms gap of the transmission error"
        " goes from 4.00 um to 2.00 um recalibrated."
    )


def test_bands_of_a_sixth_of_an_octave_keep_the_energy() -> None:
    lines = np.zeros(1025)
    lines[[8, 64, 65, 512]] = 3.0, 4.0, 12.0, 1.0
    centre, rms = octave_bands(lines, 2.0)
    # Lines 64 and 65 lie within a twelfth of an octave of 128 Hz.
    for frequency, energy in ((16.0, 3.0), (128.0, np.hypot(4.0, 12.0)), (1024.0, 1.0)):
        assert rms[np.argmin(np.abs(centre - frequency))] == pytest.approx(energy)
    assert (rms**2).sum() == pytest.approx((lines**2).sum())


def test_of_what_is_not_named_it_is_said_from_which_size_on_it_would_have_been() -> None:
    def one(name: str, value: float | None, good: float, unit: str, *on: str) -> Detectable:
        parameter = {"eccentricity": "driver.runout", "coupling": "stiffness"}.get(name, "coefficient")
        size = Smallest(value=value, std=0.1, good=good, unit=unit)
        return Detectable(name=name, place="mesh", on=on, parameters={parameter: size})

    limits = (
        one("friction", 0.02, 0.004, "1"),
        one("eccentricity", None, 0.8, "um", "driver"),
        one("eccentricity", 3.5, 0.8, "um", "driver"),
        one("eccentricity", 4.5, 0.8, "um", "driver"),
        one("coupling", 8e4, 4e5, "N m/rad"),
    )
    rubs = Effect(name="friction", probability=0.9)
    sure = Probabilities(effect=0.9, none=0.1, unknown=0.0)
    verdict = Verdict(verdict="effects", probability=sure, place="mesh", effects=(rubs,), detectable=limits)
    found = detectable_in_words(verdict)
    assert [(row.effect, row.told, row.found, row.good) for row in found] == [
        ("run-out of a gear (driver)", "run-out [um]", 3.5, 0.8),
        ("another stiffness of the coupling", "torsional stiffness [N m/rad]", 8e4, 4e5),
    ]

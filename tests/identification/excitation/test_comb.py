"""Residue combs: what a real signal puts on which line, which kinds coincide, and the choice of the residue."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from gearbench.identification.excitation.comb import (
    CombError,
    hunting_teeth,
    overlaps,
    ranked_residues,
    residue_class,
    residue_of,
)
from gearbench.identification.excitation.multisine import random_phase_multisine

# An excitation period of two hunting periods of 20/30 teeth, and residue 17: hardly anything overlaps.
TEETH, MODULUS, RESIDUE, SAMPLES = (20, 30), 120, 17, 120 * 64


def signals() -> dict[str, np.ndarray]:
    """Answers made in the time domain, each by the one mechanism that gives the line its name."""
    turn = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    comb = {"modulus": MODULUS, "residue": RESIDUE}
    draw = np.random.default_rng(1)
    signal = random_phase_multisine(
        SAMPLES, float(SAMPLES), (1.0, 700.0), rms=1.0, grid="comb", crest=2.0, rng=draw, **comb
    )
    u = signal.sample(SAMPLES)
    mesh = 1 + 0.3 * np.cos(MODULUS * turn) + 0.1 * np.sin(2 * MODULUS * turn)
    # A tooth error of each shaft with three harmonics: MODULUS / z lines are one revolution.
    driver, driven = (sum(np.cos(k * MODULUS // z * turn) for k in (1, 2, 3)) for z in TEETH)
    return {
        "operating": mesh,
        "excited": mesh * u,
        "even": mesh * u**2,
        "odd": mesh * u**3,
        "driver-shaft": driver,
        "driven-shaft": driven,
        "driver-shaft-excited": driver * u,
        "driven-shaft-excited": driven * u,
    }


ALLOWED = {  # further classes that each mechanism reaches by its nature
    "even": {"operating"},
    "odd": {"excited"},
    "driven-shaft": {"driver-shaft"},  # 2 x 30 = 3 x 20 teeth
    "driven-shaft-excited": {"driver-shaft-excited"},
}


@pytest.mark.parametrize("name", list(signals()))
def test_every_mechanism_answers_on_the_lines_of_its_name(name: str) -> None:
    power = np.abs(np.fft.rfft(signals()[name])) ** 2
    labels = residue_class(np.arange(power.size), MODULUS, RESIDUE, *TEETH)
    shares = {str(label): power[labels == label].sum() / power.sum() for label in np.unique(labels)}
    assert shares[name] > 0.05
    assert sum(shares.get(one, 0.0) for one in {name} | ALLOWED.get(name, set())) == pytest.approx(1.0, abs=1e-12)


def test_labels_of_single_lines() -> None:
    lines = np.array([[0, 120, -240], [17, -17, 137], [34, 86, 206], [51, 69, 171], [6, 4, 12], [23, 13, 60]])
    labels = residue_class(lines, MODULUS, RESIDUE, *TEETH)
    assert labels.shape == lines.shape
    assert labels[:4].tolist() == [["operating"] * 3, ["excited"] * 3, ["even"] * 3, ["odd"] * 3]
    assert labels[4].tolist() == ["driver-shaft", "driven-shaft", "driver-shaft"]
    assert labels[5].tolist() == ["driver-shaft-excited", "driven-shaft-excited", "other"]
    plain = residue_class(lines, MODULUS, None, *TEETH)
    assert plain[0].tolist() == ["operating"] * 3 and plain[4].tolist() == labels[4].tolist()
    assert set(plain[[1, 2, 3, 5]].ravel()) == {"other"}
    assert residue_class(np.array([2, 15]), 124, 18, 62, 62).tolist() == ["both-shafts", "other"]
    assert residue_class(np.array([16, 20]), 124, 18, 62, 62).tolist() == ["both-shafts-excited"] * 2


def test_of_several_kinds_the_strongest_gives_the_name() -> None:
    # 13 - 2 x 2 = 9 = 3 x 3: second before third; 2 x 2 = 4 = 13 - 3 x 3 likewise; 6 is 2 x 3 before 3 x 2.
    labels = residue_class(np.array([9, 4, 6]), 60, 13, 20, 30)
    assert labels.tolist() == ["driven-shaft-excited", "driven-shaft", "driver-shaft"]
    # 2 = 4 - 2: of equal sidebands that of the operating response. 2 x 17 + 6 = 40 is of a distortion.
    assert residue_class(np.array([2]), 60, 4, 20, 30).tolist() == ["driven-shaft"]
    assert residue_class(np.array([40]), MODULUS, RESIDUE, *TEETH).tolist() == ["other"]


def brute_force(modulus: int, teeth: tuple[int, int], residue: int) -> dict[frozenset[str], set[int]]:
    """Shared lines of every two kinds, by adding lines modulo the modulus; both signs, nothing folded."""
    comb = {residue, -residue}
    carriers = {
        "operating response": {0},
        "linear response": comb,
        "even distortion": {a + b for a, b in product(comb, comb) if a == b},
        "odd distortion": {a + b + c for a, b, c in product(comb, comb, comb) if a == b == c},
    }
    kinds = {name: {line % modulus for line in lines} for name, lines in carriers.items()}
    for (name, lines), (shaft, z), k in product(
        carriers.items(), zip(("driver-shaft", "driven-shaft"), teeth, strict=True), (1, 2, 3)
    ):
        words = f"{('1st', '2nd', '3rd')[k - 1]} {shaft} sideband of the {name}"
        kinds[words] = {(line + sign * k * modulus // z) % modulus for line in lines for sign in (1, -1)}
    return {
        frozenset((one, two)): shared
        for one, two in product(kinds, kinds)
        if one < two and (shared := kinds[one] & kinds[two])
    }


@pytest.mark.parametrize(
    ("modulus", "teeth", "residue"),
    [
        (60, (20, 30), 13),
        (60, (20, 30), 9),
        (60, (20, 30), 20),
        (120, (20, 30), 17),
        (40, (20, 40), 7),
        (50, (25, 10), 9),
    ],
)
def test_overlaps_are_those_of_adding_lines(modulus: int, teeth: tuple[int, int], residue: int) -> None:
    truth = brute_force(modulus, teeth, residue)
    found = overlaps(modulus, *teeth, residue)
    for one in found:
        shared = truth.pop(frozenset((one.first, one.second)))
        assert {min(line, modulus - line) for line in shared} == set(one.lines)
    # What is not listed coincides around every class alike and is listed once, around the operating response.
    inherent = {frozenset((one.first, one.second)) for one in found if one.inherent}
    for pair in truth:
        (carrier,) = {words.rpartition(" of the ")[2] for words in pair}
        assert frozenset(words.replace(carrier, "operating response") for words in pair) in inherent
    assert list(found) == sorted(found, key=lambda one: -one.strength)


def test_overlaps_read_as_an_engineer_says_it() -> None:
    # 20/30 teeth, one revolution of the driver is 3 lines: 2 x 24 = 48 = -12 is the 4th, but 3 x 24 = 72 = 12 too.
    sentences = [str(one) for one in overlaps(60, 20, 30, 17)]
    assert "3rd driver-shaft sideband of the operating response falls on the odd distortion" in sentences
    same = [text for text in sentences if text.endswith("whatever the residue")]
    assert same == [
        "3rd driven-shaft sideband of the operating response falls on the 2nd driver-shaft sideband of the"
        " operating response, whatever the residue"
    ]
    assert [str(one) for one in overlaps(62, 62, 62, 9)] == [
        "every driven-shaft sideband falls on the driver-shaft sideband of equal number, whatever the residue"
    ]
    worst = overlaps(60, 20, 30, 20)[0]
    assert (worst.first, worst.second, worst.strength) == ("even distortion", "linear response", 0.3)


@pytest.mark.parametrize(
    ("teeth", "times"), [((20, 30), 1), ((20, 30), 2), ((16, 48), 1), ((25, 40), 1), ((62, 62), 1)]
)
def test_chosen_residues_keep_the_classes_apart_and_overlap_least(teeth: tuple[int, int], times: int) -> None:
    modulus = times * hunting_teeth(*teeth)
    ranked = ranked_residues(modulus, *teeth).tolist()
    apart = []
    for r in range(1, (modulus + 1) // 2):
        classes = [{k * r % modulus, -k * r % modulus} for k in range(4)]
        if sum(len(one) for one in classes) == len(set().union(*classes)):
            apart.append(r)
    assert sorted(ranked) == apart
    cost = [sum(one.strength * len(one.lines) for one in overlaps(modulus, *teeth, r)) for r in ranked]
    assert cost[0] <= min(cost) + 1e-9
    assert np.mean(cost[: len(cost) // 4 + 1]) <= np.mean(cost)


def test_hunting_ratios_leave_no_overlap_at_once() -> None:
    residue = ranked_residues(3906, 62, 63)[0]
    assert overlaps(3906, 62, 63, residue) == ()
    # Of equals the widest gap: between 3906/7 and 3906/6 three classes lie at least 3906/7 - 2 lines apart.
    assert min(residue, 3906 // 2 - 2 * residue) >= 550


def test_the_residue_can_be_read_off_the_lines() -> None:
    assert residue_of(np.array([13, 47, 73, 107, -13]), 60) == 13
    for lines in ([13, 48], [30, 90], [60, 120], []):
        assert residue_of(np.array(lines, dtype=int), 60) is None


@pytest.mark.parametrize(
    ("modulus", "residue", "words"),
    [
        (60, 0, "residue = 0 must lie between 1 and 29"),
        (60, 30, "residue = 30 must lie between 1 and 29"),
        (60, -13, "residue = -13"),
        (50, 7, r"modulus = 50 must be a multiple of lcm\(20, 30\) = 60"),
        (0, 7, "residue = 7"),
    ],
)
def test_combs_that_cannot_be(modulus: int, residue: int, words: str) -> None:
    with pytest.raises(CombError, match=words):
        overlaps(modulus, 20, 30, residue)
    with pytest.raises(CombError, match=words):
        residue_class(np.arange(5), modulus, residue, 20, 30)


def test_too_few_lines_for_a_comb() -> None:
    with pytest.raises(CombError, match="modulo 5 has no residue"):
        ranked_residues(5, 5, 5)
    assert ranked_residues(6, 6, 6)[0] == 1

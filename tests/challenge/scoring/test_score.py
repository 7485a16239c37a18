"""The arithmetic of the score, with verdicts made by hand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom
from shared.fake_verdicts import says_friction, verdict

from gearbench.challenge.answers import Answer, read_answers, write_answers
from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.scoring.intervals import Rate, brier, error_by_chance, middle, reliability
from gearbench.challenge.scoring.judge import score_folder
from gearbench.challenge.scoring.outcomes import judge, without
from gearbench.challenge.scoring.reach import REACHES
from gearbench.challenge.scoring.score import score, third_of
from gearbench.challenge.scoring.text import score_text

FRICTION = Answer(
    "effect",
    ("friction",),
    "mesh",
    {"friction": {"coefficient": {"value": 0.05, "unit": "1"}}},
    {"friction": 0.83},
)
CRACK = Answer("effect", ("tooth-crack",), "mesh", {"tooth-crack": {}}, {"tooth-crack": 1.5})
NONE = Answer("none")
DRIFT = Answer("foreign", ("temperature-drift",), "mesh", {"temperature-drift": {}}, {"temperature-drift": 1.0})
TWO = Answer("effect", ("friction", "coupling"), "mesh", {"friction": {}, "coupling": {}})


@pytest.mark.parametrize(
    ("answer", "given", "result"),
    [
        (FRICTION, verdict("effect", "friction"), "right"),
        (FRICTION, verdict("effect", "pitch-error"), "wrong"),
        (FRICTION, verdict("effect", "friction", "pitch-error"), "wrong"),
        (FRICTION, verdict("effect", "pitch-error", indistinguishable=[["friction", "pitch-error"]]), "class"),
        (FRICTION, verdict("effect", "coupling", indistinguishable=[["friction", "pitch-error"]]), "wrong"),
        (FRICTION, verdict("none"), "missed"),
        (FRICTION, verdict("unknown"), "refused"),
        (FRICTION, None, "failed"),
        (NONE, verdict("none"), "right"),
        (NONE, verdict("effect", "friction"), "named"),
        (NONE, verdict("unknown"), "flagged"),
        (DRIFT, verdict("unknown"), "refused"),
        (DRIFT, verdict("none"), "missed"),
        (DRIFT, verdict("effect", "tooth-crack"), "blamed"),
        (TWO, verdict("effect", "coupling", "friction"), "right"),
        (TWO, verdict("effect", "coupling"), "part"),
        (TWO, verdict("effect", "coupling", "backlash"), "wrong"),
    ],
)
def test_one_outcome(answer: Answer, given: dict[str, Any] | None, result: str) -> None:
    assert judge("x", answer, given).result == result


def test_place_counts_whatever_the_verdict() -> None:
    assert judge("x", FRICTION, verdict("unknown", place="mesh")).place_right
    assert not judge("x", FRICTION, verdict("effect", "friction", place="drive")).place_right
    assert judge("x", NONE, verdict("none", place="none")).place_right


def test_an_effect_taken_out_of_the_library_must_be_refused() -> None:
    assert judge("x", without(FRICTION, "friction"), verdict("unknown")).result == "refused"
    assert judge("x", without(FRICTION, "friction"), verdict("effect", "coupling")).result == "blamed"
    assert without(FRICTION, "coupling") == FRICTION and without(NONE, "friction") == NONE


@pytest.mark.parametrize(("count", "total"), [(0, 9), (3, 9), (9, 9), (61, 81)])
def test_interval_leaves_five_per_cent_on_either_side(count: int, total: int) -> None:
    rate = Rate(count, total)
    assert rate.low <= count / total <= rate.high
    if count:
        assert binom.sf(count - 1, total, rate.low) == pytest.approx(0.05, abs=1e-9)
    else:
        assert rate.low == 0.0 and rate.high == pytest.approx(1 - 0.05 ** (1 / total))
    if count < total:
        assert binom.cdf(count, total, rate.high) == pytest.approx(0.05, abs=1e-9)
    else:
        assert rate.high == 1.0


def test_interval_of_nothing_is_everything() -> None:
    assert Rate(0, 0).plain() == {"count": 0, "total": 0, "share": None, "low": 0.0, "high": 1.0}


def test_median_and_its_interval() -> None:
    assert middle([]).plain() == {"median": None, "low": None, "high": None, "total": 0}
    assert middle([3.0, 1.0, 2.0]).low is None
    # n = 10: P(B <= 1) = 11/1024 = 0.0107, P(B <= 2) = 0.055: the second from either end.
    ten = middle([float(i) for i in range(10)])
    assert (ten.value, ten.low, ten.high) == (4.5, 1.0, 8.0)
    rng = np.random.default_rng(1)
    samples = (middle(list(rng.exponential(size=25))) for _ in range(2000))
    covered = [m.low <= np.log(2) <= m.high for m in samples if m.low is not None and m.high is not None]
    assert 0.89 < np.mean(covered) < 0.97


def test_brier() -> None:
    assert brier([[1, 0, 0], [0, 0, 1]], [0, 2]) == 0.0
    assert brier([[0.5, 0.3, 0.2]], [1]) == pytest.approx(0.25 + 0.49 + 0.04)
    assert brier([], []) is None


def test_reliability_counts_every_case_once() -> None:
    stated = [0.2, 0.5, 0.95, 1.0, 0.99, 0.75]
    rows = reliability(stated, [False, True, True, True, False, True])
    assert sum(row["total"] for row in rows) == 6  # type: ignore[misc]
    last = rows[-1]
    assert (last["from"], last["count"], last["total"]) == (0.95, 2, 3)
    assert last["stated"] == pytest.approx(0.98)


def test_chance_alone_is_as_far_off_as_the_binomial_says() -> None:
    """All of one bin: the error is that of one binomial share."""
    found, total, stated = error_by_chance([0.85] * 40), 40, 0.85
    shares = np.arange(total + 1) / total
    away, weight = np.abs(shares - stated), binom.pmf(np.arange(total + 1), total, stated)
    order = np.argsort(away)
    below = np.cumsum(weight[order])
    for got, quantile in ((found.low, 0.05), (found.value, 0.5), (found.high, 0.95)):
        assert got is not None
        # Of a distribution in steps a sample's quantile lies within a hundredth of probability.
        low, high = (away[order][np.searchsorted(below, quantile + d)] for d in (-0.03, 0.03))
        assert low - 1e-12 <= got <= high + 1e-12
    # Of two bins the errors do not make up for each other.
    both = error_by_chance([0.85] * 40 + [0.75] * 40)
    assert both.value is not None and found.value is not None and both.value > 0.8 * found.value
    assert error_by_chance([]).value is None


def test_thirds_are_equal_in_the_logarithm() -> None:
    edge = 0.35 * (1.6 / 0.35) ** (1 / 3)
    assert [third_of(s) for s in (0.35, edge * 0.999, edge * 1.001, 1.6)] == ["light", "light", "medium", "severe"]


def outcomes_by_hand() -> list[Any]:
    given = verdict("effect", "friction", stated=0.8)
    given["effects"][0]["parameters"] = {
        "coefficient": {"value": 0.06, "std": 0.01, "unit": "1"},
        "elsewhere": {"value": 1.0, "std": 0.0, "unit": "1"},
    }
    given["candidates"] = [
        {"effects": ["friction"], "log_evidence": 1.0, "held_out": 0.2},
        {"effects": [], "log_evidence": 0.0, "held_out": 0.9},
    ]
    row = {"channel": "y", "band_hz": [0, 1], "unit": "m", "record": "held-out"}
    ones = {
        key: [v, v, v] for key, v in (("nominal", 4.0), ("recalibrated", 2.0), ("with_effect", 1.0), ("floor", 0.5))
    }
    given["gap"] = [
        {**row, **ones},
        {**row, **ones, "with_effect": [0.25, 0.2, 0.3]},
        {**row, "record": "base", **ones},
    ]
    given["held_out"] = "held-out"
    missed = verdict("none", place="none", stated=0.6)
    missed["candidates"] = [
        {"effects": ["tooth-crack"], "log_evidence": 0.0, "held_out": 0.3},
        {"effects": [], "log_evidence": 0.0, "held_out": 0.6},
    ]
    return [
        judge("a", FRICTION, given),
        judge("b", CRACK, missed),
        judge("c", NONE, verdict("none", place="none", stated=1.0)),
        judge("d", NONE, verdict("effect", "friction")),
        judge("e", DRIFT, verdict("unknown")),
        judge("f", DRIFT, verdict("unknown", place="drive")),
    ]


def test_score_by_hand() -> None:
    table = score(outcomes_by_hand())
    assert table["cases"] == {"effect": 2, "none": 2, "foreign": 2}
    assert {key: table["effect"][key]["count"] for key in ("right", "wrong", "missed", "place_right")} == {
        "right": 1,
        "wrong": 0,
        "missed": 1,
        "place_right": 1,
    }
    assert table["none"]["named"]["share"] == 0.5
    assert table["foreign"]["refused"]["count"] == 2
    assert table["foreign"]["refused_at_right_place"]["count"] == 1
    assert table["by_effect"]["friction"]["right"]["count"] == 1
    assert table["by_effect"]["temperature-drift"]["refused"]["count"] == 2
    assert table["by_severity"]["severe"]["missed"]["count"] == 1
    assert table["by_severity"]["medium"]["right"]["count"] == 1
    assert table["confusion"]["none"] == {"none": 1, "friction": 1}
    (error,) = table["parameters"]
    assert (error["effect"], error["parameter"], error["cases"]) == ("friction", "coefficient", 1)
    assert error["bias"] == pytest.approx(0.01) and error["median_relative"] == pytest.approx(0.2)
    assert error["within"]["count"] == 1
    shrunk = table["shrinkage"]
    # Ratios 1 (right) and 2 (none chosen where the crack would have halved the gap).
    assert shrunk["oracle"]["median"] == pytest.approx(1.5)
    assert shrunk["oracle_within_1.5"]["count"] == 1
    # 1/4 and 1/16 on the held-out record: geometric mean 1/8.
    assert shrunk["with_effect"]["median"] == pytest.approx(0.125)
    assert shrunk["recalibrated"]["median"] == pytest.approx(0.5)
    # Brier: the six cases' own sums.
    sums = [0.2**2 + 2 * 0.1**2, 0.8**2 + 0.6**2 + 0.2**2, 0.0, 0.95**2 + 0.9**2 + 0.05**2]
    assert table["calibration"]["brier"] == pytest.approx((sum(sums) + 2 * (0.1**2 + 2 * 0.05**2)) / 6)
    assert sum(row["count"] for row in table["calibration"]["effect"]) == 1
    assert len(table["reach"]) == len(REACHES)


def many(right: int, total: int) -> list[Any]:
    good, bad = verdict("effect", "friction"), verdict("none")
    return [judge(str(i), FRICTION, good if i < right else bad) for i in range(total)]


@pytest.mark.parametrize(
    ("right", "total", "status"), [(81, 81, "met"), (70, 81, "point estimate"), (50, 81, "not met")]
)
def test_reach_is_met_by_the_unfavourable_end(right: int, total: int, status: str) -> None:
    rows = {row["what"]: row for row in score(many(right, total))["reach"]}
    assert rows["due effects that are found"]["status"] == status
    assert rows["false alarm, named"]["status"] == "not run"
    # All of 63 named: at least 95.4 % by the interval, so ninety-seven stay a point estimate.
    assert rows["named effects that are true"]["status"] == ("met" if right >= 99 else "point estimate")


def test_text_says_the_figures() -> None:
    text = score_text(score(outcomes_by_hand()))
    for words in ("1 of 2, 50 % (3-97)", "friction", "Brier", "place right, no blame", "point estimate"):
        assert words in text
    assert "no cases" in score_text(score(outcomes_by_hand()[:2]))


# --- folders ------------------------------------------------------------------------------------------------


def read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    answers = {"c1": FRICTION, "c2": NONE, "c3": FRICTION}
    for name in answers:
        (tmp_path / "cases" / name).mkdir(parents=True)
        for file in ("record-b.nc", "record-a.nc", "nominal.toml"):
            (tmp_path / "cases" / name / file).touch()
    write_answers(answers, tmp_path / "answers.json")
    return tmp_path


def test_answers_come_back(folder: Path) -> None:
    assert read_answers(folder / "answers.json")["c1"] == FRICTION


@pytest.mark.parametrize("workers", [0, 2])
def test_cases_are_diagnosed_and_failures_told(folder: Path, workers: int) -> None:
    cases, answers = folder / "cases", folder / "answers.json"
    outcomes, failed = score_folder(cases, answers, read, says_friction, workers=workers)
    assert [(o.name, o.result) for o in outcomes] == [("c1", "right"), ("c2", "named"), ("c3", "failed")]
    assert failed == {"c3": "no wish to"}
    assert read(cases / "c1" / "verdict.json")["seen"] == ["record-a.nc", "record-b.nc"]


def test_some_verdicts_need_resume(folder: Path) -> None:
    cases, answers = folder / "cases", folder / "answers.json"
    (cases / "c2" / "verdict.json").write_text(json.dumps(verdict("none")), encoding="utf-8")
    with pytest.raises(ChallengeError, match=r"1 of 3 cases in .* add --resume"):
        score_folder(cases, answers, read, says_friction, workers=0)
    outcomes, _ = score_folder(cases, answers, read, says_friction, resume=True, workers=0)
    assert [o.result for o in outcomes] == ["right", "right", "failed"]


def test_without_an_effect_its_cases_alone_are_judged_apart(folder: Path) -> None:
    cases, answers = folder / "cases", folder / "answers.json"
    outcomes, _ = score_folder(cases, answers, read, says_friction, withheld="friction", workers=0)
    assert [(o.name, o.answer.kind, o.result) for o in outcomes] == [
        ("c1", "foreign", "refused"),
        ("c3", "foreign", "failed"),
    ]
    assert not (cases / "c1" / "verdict.json").exists()
    with pytest.raises(ChallengeError, match=r"no case of .* has that effect"):
        score_folder(cases, answers, read, says_friction, withheld="backlash", workers=0)


def test_missing_and_bad_verdicts_are_named(folder: Path) -> None:
    cases, answers = folder / "cases", folder / "answers.json"
    with pytest.raises(ChallengeError, match=r"3 of 3 cases in .* have no verdict.json, such as c1"):
        score_folder(cases, answers, read)
    for name in ("c1", "c2", "c3"):
        (cases / name / "verdict.json").write_text(json.dumps(verdict("none")), encoding="utf-8")
    (cases / "c2" / "verdict.json").write_text("{", encoding="utf-8")
    with pytest.raises(ChallengeError, match=r"c2/verdict.json: "):
        score_folder(cases, answers, read)
    (cases / "c2" / "verdict.json").write_text('{"verdict": "perhaps", "place": "mesh"}', encoding="utf-8")
    with pytest.raises(ChallengeError, match="must give verdict, one of effect, none, unknown"):
        score_folder(cases, answers, read)


def test_folders_and_answers_must_belong_together(folder: Path) -> None:
    cases, answers = folder / "cases", folder / "answers.json"
    (cases / "c9").mkdir()
    with pytest.raises(ChallengeError, match="holds c9, of which the answers say nothing"):
        score_folder(cases, answers, read)
    with pytest.raises(ChallengeError, match="lacks 3 of the 3 cases"):
        score_folder(folder, answers, read)
    with pytest.raises(ChallengeError, match="does not exist"):
        score_folder(folder / "nowhere", answers, read)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"c1": {"kind": "effect"', "truncated or no JSON"),
        ("[]", "must be a JSON object"),
        ('{"c1": 3}', "c1 must be an object"),
        ('{"c1": {"kind": "effect", "effects": ["friction"], "place": "mesh"}}', "lacks the key parameters"),
        ('{"c1": {"kind": "odd", "effects": [], "place": "mesh", "parameters": {}}}', "kind = 'odd'"),
        ('{"c1": {"kind": "none", "effects": ["friction"], "place": "mesh", "parameters": {}}}', "do not go with"),
        ('{"c1": {"kind": "none", "effects": [], "place": "moon", "parameters": {}}}', "place = 'moon'"),
        ('{"c1": {"kind": "none", "effects": "x", "place": "none", "parameters": {}}}', "list of names"),
        ('{"c1": {"kind": "none", "effects": [], "place": "none", "parameters": []}}', "must be objects"),
    ],
)
def test_bad_answers_are_named(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "answers.json").write_text(text, encoding="utf-8")
    with pytest.raises(ChallengeError, match=words):
        read_answers(tmp_path / "answers.json")
    with pytest.raises(ChallengeError, match="do not exist"):
        read_answers(tmp_path / "none.json")

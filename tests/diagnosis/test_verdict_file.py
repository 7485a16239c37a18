"""verdict.json: the contract as a literal file, and one sentence for everything that can be wrong with one."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gearbench.diagnosis import verdict_file as module
from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.verdict import (
    Candidate,
    Detectable,
    Effect,
    Found,
    Gap,
    Parameter,
    Part,
    Probabilities,
    Range,
    Share,
    Smallest,
    Verdict,
)
from gearbench.diagnosis.verdict_file import parse_verdict, read_verdict, verdict_json, write_verdict
from gearbench.files import FileError

# As another program would write it from the specification.
TREE: dict[str, Any] = {
    "schema": "gearbench-verdict/2",
    "verdict": "effects",
    "probability": {"effect": 0.9, "none": 0.04, "unknown": 0.06},
    "effects": [
        {
            "name": "friction",
            "probability": 0.88,
            "due": True,
            "parameters": {"coefficient": {"value": 0.05, "low": 0.04, "high": 0.07, "unit": ""}},
            "share": 0.75,
            "closes": {"dte": [1.5, 1.2, 1.9]},
            "grows": 9.5,
        }
    ],
    "candidates": [
        {"effects": ["friction"], "log_evidence": -12.5, "held_out": 0.11},
        {"effects": [], "log_evidence": -90, "held_out": None},
    ],
    "place": "mesh",
    "because": ["the gap is closed"],
    "explained": [
        {
            "channel": "dte", "band_hz": [0, 200], "place": "mesh", "size": 2.2, "low": 2, "high": 2.5, "unit": "um",
            "share": 0.6, "floors": 220,
        }
    ],
    "remainder": [
        {
            "channel": "force", "band_hz": [0, 200], "place": "drive", "size": 12, "low": 12, "high": 12, "unit": "N",
            "share": 0.1, "floors": None,
        }
    ],
    "structure": [{"name": "housing", "value": 0.06, "low": 0.05, "high": 0.07, "unit": "1"}],
    "limits": "population",
    "where": [{"kind": "channel", "name": "dte", "share": 0.75, "floor": 0.02}],
    "gap": [
        {
            "record": "held-out",
            "channel": "dte",
            "band_hz": [0, 200],
            "unit": "m",
            "nominal": [3e-6, 2e-6, 4e-6],
            "recalibrated": [2e-6, 1e-6, 3e-6],
            "with_effect": None,
            "floor": [1e-8, 1e-8, 1e-8],
        }
    ],
    "held_out": "held-out",
    "indistinguishable": [["pitch-error", "eccentricity"]],
    "detectable": [
        {
            "name": "eccentricity",
            "place": "mesh",
            "on": ["driver"],
            "parameters": {"driver.runout": {"value": None, "std": 0.3, "good": 0.8, "unit": "um"}},
        }
    ],
    "advice": ["measure at 320 N m"],
}

VERDICT = Verdict(
    verdict="effects",
    probability=Probabilities(effect=0.9, none=0.04, unknown=0.06),
    effects=(
        Effect(
            name="friction",
            probability=0.88,
            due=True,
            parameters={"coefficient": Parameter(value=0.05, low=0.04, high=0.07, unit="")},
            share=0.75,
            closes={"dte": Range(value=1.5, low=1.2, high=1.9)},
            grows=9.5,
        ),
    ),
    candidates=(
        Candidate(effects=("friction",), log_evidence=-12.5, held_out=0.11),
        Candidate(effects=(), log_evidence=-90.0),
    ),
    place="mesh",
    because=("the gap is closed",),
    explained=(
        Part(channel="dte", band_hz=(0.0, 200.0), place="mesh", size=2.2, low=2.0, high=2.5, unit="um", share=0.6,
             floors=220.0),
    ),
    remainder=(
        Part(channel="force", band_hz=(0.0, 200.0), place="drive", size=12.0, low=12.0, high=12.0, unit="N",
             share=0.1),
    ),
    structure=(Found(name="housing", value=0.06, low=0.05, high=0.07, unit="1"),),
    limits="population",
    where=(Share(kind="channel", name="dte", share=0.75, floor=0.02),),
    gap=(
        Gap(
            record="held-out",
            channel="dte",
            band_hz=(0.0, 200.0),
            unit="m",
            nominal=Range(value=3e-6, low=2e-6, high=4e-6),
            recalibrated=Range(value=2e-6, low=1e-6, high=3e-6),
            with_effect=None,
            floor=Range(value=1e-8, low=1e-8, high=1e-8),
        ),
    ),
    held_out="held-out",
    indistinguishable=(("pitch-error", "eccentricity"),),
    detectable=(
        Detectable(
            name="eccentricity",
            place="mesh",
            on=("driver",),
            parameters={"driver.runout": Smallest(value=None, std=0.3, good=0.8, unit="um")},
        ),
    ),
    advice=("measure at 320 N m",),
)
TOLD = VERDICT.model_copy(update={"signs": {"lines": 400.0}, "calibrated_on": 12})


def test_a_foreign_file_reads_as_the_same_values() -> None:
    assert parse_verdict(json.dumps(TREE)) == VERDICT


def test_what_is_written_is_the_specified_file(tmp_path: Path) -> None:
    path = tmp_path / "verdict.json"
    write_verdict(TOLD, path)
    tree = json.loads(path.read_text(encoding="utf-8"))
    # Two further keys tell the floors apart.
    assert tree["where"][0].pop("floor_noise") is None and tree["where"][0].pop("floor_nominal") is None
    assert tree.pop("confirmed") is None  # finite elements were not asked
    # And two what probabilities were read from.
    assert tree.pop("signs") == {"lines": 400.0} and tree.pop("calibrated_on") == 12
    assert tree == TREE
    assert list(tree) == list(TREE)
    assert read_verdict(path) == TOLD
    assert [entry.name for entry in tmp_path.iterdir()] == ["verdict.json"]


def test_version_1_reads_as_what_it_says_now() -> None:
    old = {key: TREE[key] for key in ("candidates", "place", "where", "gap", "held_out", "indistinguishable", "advice")}
    five = {"value": 5, "std": 1, "unit": ""}
    effect = {"name": "friction", "probability": 0.88, "parameters": {"coefficient": five}}
    tree = {"schema": "gearbench-verdict/1", "verdict": "effect", "probability": TREE["probability"], **old}
    found = parse_verdict(json.dumps(tree | {"effects": [effect]}))
    assert found.verdict == "effects" and found.gap == VERDICT.gap and found.effects[0].due is None
    parameter = found.effects[0].parameters["coefficient"]
    # Nine of ten draws of a normal distribution lie within 1.645 standard deviations.
    assert (parameter.low, parameter.high) == (pytest.approx(3.3551, abs=1e-4), pytest.approx(6.6449, abs=1e-4))
    assert parameter.std == pytest.approx(1.0)
    assert parse_verdict(verdict_json(found)) == found


def test_minimal_verdict_of_a_foreign_program() -> None:
    text = json.dumps(
        {
            "schema": "gearbench-verdict/1",
            "verdict": "none",
            "probability": {"effect": 0, "none": 1, "unknown": 0},
            "place": "none",
        }
    )
    assert parse_verdict(text).effects == ()


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="nowhere must exist"):
        write_verdict(VERDICT, tmp_path / "nowhere" / "verdict.json")


def test_values_are_frozen() -> None:
    with pytest.raises(ValueError, match="frozen"):
        VERDICT.__setattr__("place", "drive")


def put(*path: Any) -> Callable[[dict[str, Any]], None]:
    """Sets the value at a path of keys; the last argument is the value."""
    *keys, last, value = path

    def change(tree: Any) -> None:
        for key in keys:
            tree = tree[key]
        tree[last] = value

    return change


def drop(*path: Any) -> Callable[[dict[str, Any]], None]:
    *keys, last = path

    def change(tree: Any) -> None:
        for key in keys:
            tree = tree[key]
        del tree[last]

    return change


DEFECTS: list[tuple[Callable[[dict[str, Any]], None], str]] = [
    (put("schema", "gearbench-verdict/3"), 'schema is "gearbench-verdict/3", but a verdict has "gearbench-verdict/2"'),
    (drop("schema"), "schema is null"),
    (drop("place"), "key place is missing"),
    (drop("where", 0, "floor"), "key where.0.floor is missing"),
    (put("plase", "mesh"), "key plase is unknown; did you mean place?"),
    (put("where", 0, "shar", 1), "key where.0.shar is unknown; did you mean share?"),
    (put("place", "housing"), "place must be one of 'mesh', 'driver-support', 'driven-support', 'drive', 'load',"),
    (put("verdict", "maybe"), "verdict must be one of 'effects', 'none' or 'unknown'"),
    (put("probability", "none", 0.5), "probability: effect + none + unknown = 1.46 must be 1"),
    (put("probability", {"effect": 1.2, "none": -0.2, "unknown": 0}), "probability.effect should be less than"),
    (put("probability", "none", float("nan")), "holds NaN, but numbers must be finite"),
    (put("candidates", 0, "log_evidence", float("-inf")), "holds -Infinity, but numbers must be finite"),
    (put("effects", []), 'effects is empty, but verdict "effects" names at least one'),
    (put("verdict", "unknown"), 'effects names friction, but verdict "unknown" names none'),
    (put("effects", 0, "name", ""), "effects.0.name"),
    (put("effects", 0, "probability", "0.9"), "effects.0.probability should be a valid number"),
    (put("effects", 0, "probability", True), "effects.0.probability should be a valid number"),
    (put("effects", TREE["effects"] * 2), 'effects names "friction" 2 times, must once'),
    (put("effects", 0, "parameters", "coefficient", "low", 0.06), "effects.0.parameters.coefficient: value 0.05"),
    (put("effects", 0, "parameters", "coefficient", {"value": 1, "std": -1, "unit": ""}), "effects.0.param"),
    (put("effects", 0, "closes", "dte", [1, 2]), "effects.0.closes.dte: must be a list of three numbers"),
    (put("remainder", 0, "place", "housing"), "remainder.0.place must be one of 'mesh'"),
    (put("where", 0, "share", 1.5), "where.0.share should be less than or equal to 1"),
    (put("where", 0, "share", -0.1), "where.0.share should be greater than or equal to 0"),
    (put("where", 0, "kind", "row"), "where.0.kind must be one of 'channel', 'band'"),
    (put("gap", 0, "nominal", [1, 2]), "gap.0.nominal: must be a list of three numbers, [value, low, high]"),
    (put("gap", 0, "nominal", 1), "gap.0.nominal: must be a list of three numbers, [value, low, high]"),
    (put("gap", 0, "nominal", [1, 2, 3]), "gap.0.nominal: value 1 must lie between low 2 and high 3"),
    (put("gap", 0, "nominal", None), "gap.0.nominal: must be a list"),
    (put("gap", 0, "band_hz", [200, 0]), "gap.0: band_hz = [200, 0] must rise"),
    (put("gap", 0, "band_hz", [200]), "key gap.0.band_hz.1 is missing"),
    (put("where", {}), "where should be a valid"),
]


@pytest.mark.parametrize(("change", "words"), DEFECTS, ids=[words[:40] for _, words in DEFECTS])
def test_each_defect_is_one_sentence(
    change: Callable[[dict[str, Any]], None], words: str, tmp_path: Path
) -> None:
    tree = json.loads(json.dumps(TREE))
    change(tree)
    path = tmp_path / "verdict.json"
    path.write_text(json.dumps(tree), encoding="utf-8")
    with pytest.raises(DiagnosisError) as caught:
        read_verdict(path)
    sentence = str(caught.value)
    assert sentence.startswith(f"verdict {path}: {words}")
    assert "\n" not in sentence and len(sentence) < 300 + len(str(path))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"", "no JSON at line 1, column 1"),
        (b"[1]", "a verdict is a JSON object"),
        (b'{"schema": "gearbench-verdict/1", ', "no JSON at line 1"),
        (b"\xff\xfe", "not UTF-8"),
        (b"[" * 100_000, "JSON nested too deeply"),
        (b'{"a": 1, "a": 2}', 'key "a" stands twice'),
        (b'{"a": ' + b"1" * 5000 + b"}", "no usable JSON"),
    ],
)
def test_broken_files(text: bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / "verdict.json"
    path.write_bytes(text)
    with pytest.raises(DiagnosisError, match=words):
        read_verdict(path)


def test_an_overflowing_number_is_not_finite() -> None:
    with pytest.raises(DiagnosisError, match=r"candidates\.0\.log_evidence should be a finite number"):
        parse_verdict(json.dumps(TREE).replace("-12.5", "-1e999"))


def test_a_missing_or_huge_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DiagnosisError, match="does not exist"):
        read_verdict(tmp_path / "verdict.json")
    path = tmp_path / "verdict.json"
    write_verdict(VERDICT, path)
    monkeypatch.setattr(module, "LARGEST_FILE", 100)
    with pytest.raises(DiagnosisError, match="bytes, at most 100"):
        read_verdict(path)

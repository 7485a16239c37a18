"""Nothing in a challenge's folder tells what was withheld."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from shared.truth_plants import STIFFNESS, short_case

from gearbench.bench import simulate
from gearbench.challenge.answers import Answer, read_answers
from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.making import cases as making
from gearbench.challenge.making.cases import make_challenge
from gearbench.challenge.making.nominal import nominal_text
from gearbench.challenge.making.plan import Mix
from gearbench.challenge.truth import elastic
from gearbench.challenge.truth.effects import EFFECTS, FOREIGN
from gearbench.records import read_record
from gearbench.rig import read_case

SEED = 20_240_607
MIX = Mix(1, (1,) * len(EFFECTS), len(FOREIGN), 1, 1, 2)
# The rotor's inertia stands in a table of that name in the nominal rig of every case.
NOMINAL_WORDS = {"coupling"}


@pytest.fixture(scope="module")
def challenge(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("challenge")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(making, "nominal_stiffness", lambda nominal: STIFFNESS)
        # Finite elements would take minutes; what is written does not depend on who simulates.
        patch.setattr(elastic, "simulate", lambda case, model, workers: simulate(case, "lumped", workers=workers))
        make_challenge(short_case(), MIX, SEED, folder / "cases", folder / "answers.json", "test")
    return folder / "cases", folder / "answers.json"


def files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


def spellings(value: float) -> list[bytes]:
    """A number as text of several lengths and in binary; short ones would occur by chance."""
    texts = {repr(value), f"{value:.6g}", f"{value:.8e}", f"{value:.5f}" if value > 10 else repr(value)}
    binary = [struct.pack(order + kind, value) for order in "<>" for kind in "df"]
    return [*(text.encode() for text in texts if sum(c.isdigit() for c in text) >= 5), *binary]


def test_no_effect_is_named_in_any_byte(challenge: tuple[Path, Path]) -> None:
    words = [*EFFECTS, *FOREIGN, "foreign", "control", "severity", "truth", "test", "development", "effect"]
    words += [word.replace("-", "_") for word in words]
    for path in files(challenge[0]):
        content = path.read_bytes().lower()
        found = {word for word in words if word.encode() in content}
        assert found <= (NOMINAL_WORDS if path.suffix == ".toml" else set()), path


def test_no_truth_is_written_in_any_byte(challenge: tuple[Path, Path]) -> None:
    answers = read_answers(challenge[1])
    values = [float(SEED)]
    for answer in answers.values():
        values += [entry["value"] for named in answer.parameters.values() for entry in named.values()]
        values += answer.severity.values()
        # In SI, as the simulation held them.
        scales = {"um": 1e-6, "us": 1e-6}
        values += [
            entry["value"] * scales.get(entry["unit"], 1.0)
            for named in answer.parameters.values()
            for entry in named.values()
        ]
    drawn = [value for value in values if value != round(value, 3) or value == SEED]
    assert len(drawn) > 40
    needles = [spelling for value in drawn for spelling in spellings(value)] + [str(SEED).encode()]
    for path in files(challenge[0]):
        content = path.read_bytes()
        assert [needle for needle in needles if needle in content] == [], path


def test_cases_differ_in_nothing_but_values(challenge: tuple[Path, Path]) -> None:
    folder, answers = challenge
    names = sorted(read_answers(answers))
    assert sorted(path.name for path in folder.iterdir()) == names
    seen = set()
    for name in names:
        shape: list[object] = []
        for path in files(folder / name):
            status = path.stat()
            shape.append((path.name, status.st_size, status.st_mtime_ns, status.st_mode))
            if path.suffix == ".nc":
                with h5py.File(path) as file:
                    shape.append([(key, *(str(a) for a in file[key].attrs)) for key in file])
                    shape.append([(key, str(v)) for key, v in file.attrs.items() if key != "provenance"])
            else:
                shape.append(path.read_text(encoding="utf-8"))
        shape.append(os.stat(folder / name).st_mtime_ns)
        seen.add(repr(shape))
    assert len(seen) == 1


def test_provenance_holds_the_name_alone(challenge: tuple[Path, Path]) -> None:
    for path in files(challenge[0]):
        if path.suffix == ".nc":
            assert json.loads(read_record(path).attrs["provenance"]) == {"challenge": path.parent.name}


def test_names_say_nothing(challenge: tuple[Path, Path]) -> None:
    answers = read_answers(challenge[1])
    order = [answers[name].number for name in sorted(answers)]
    assert order != sorted(order)
    assert len({len(name) for name in answers}) == 1


def test_answers_hold_the_schema_and_alone_the_seed(challenge: tuple[Path, Path]) -> None:
    tree = json.loads(challenge[1].read_text(encoding="utf-8"))
    assert len(tree) == MIX.cases
    kinds = [entry["kind"] for entry in tree.values()]
    assert {kind: kinds.count(kind) for kind in kinds} == {"none": 2, "effect": 18, "foreign": 4}
    for entry in tree.values():
        assert {"kind", "effects", "place", "parameters"} <= set(entry)
        assert entry["seed"] == SEED
        assert (entry["kind"] == "none") == (entry["effects"] == []) == (entry["place"] == "none")
        assert set(entry["parameters"]) == set(entry["effects"])


def test_nominal_text_is_the_nominal_case(tmp_path: Path) -> None:
    nominal = short_case()
    (tmp_path / "nominal.toml").write_text(nominal_text(nominal), encoding="utf-8")
    assert read_case(tmp_path / "nominal.toml") == nominal


def test_effects_change_the_record(challenge: tuple[Path, Path]) -> None:
    """Not a leak but the point: no two cases have the same values."""
    seen = {read_record(path)["y_driver"].values[0, 100] for path in files(challenge[0]) if path.suffix == ".nc"}
    assert len(seen) == MIX.cases


def test_made_again_it_is_the_same_and_goes_on(challenge: tuple[Path, Path], tmp_path: Path) -> None:
    nominal, mix = short_case(), Mix(1, (0,) * len(EFFECTS), 1)
    out, answers = tmp_path / "cases", tmp_path / "answers.json"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(making, "nominal_stiffness", lambda nominal: STIFFNESS)
        names = sorted(make_challenge(nominal, mix, 3, out, answers))
        before = {name: read_record(out / name / "record-base.nc")["y_driver"].values for name in names}
        for path in files(out / names[0]):
            path.unlink()
        (out / names[0]).rmdir()
        (out / f".{names[0]}").mkdir()
        assert sorted(make_challenge(nominal, mix, 3, out, answers)) == names
        assert sorted(path.name for path in out.iterdir()) == names
        after = {name: read_record(out / name / "record-base.nc")["y_driver"].values for name in names}
        assert all(np.array_equal(before[name], after[name]) for name in names)
        with pytest.raises(ChallengeError, match="answers of another challenge"):
            make_challenge(nominal, mix, 4, out, answers)
        (out / "stranger").mkdir()
        with pytest.raises(ChallengeError, match="holds stranger"):
            make_challenge(nominal, mix, 3, out, answers)


@pytest.mark.parametrize("inside", ["cases/answers.json", "cases", "cases/../cases/a/b.json"])
def test_answers_inside_the_folder_are_refused(inside: str, tmp_path: Path) -> None:
    with pytest.raises(ChallengeError, match="lies inside --out"):
        make_challenge(short_case(), MIX, 1, tmp_path / "cases", tmp_path / inside)
    assert not (tmp_path / "cases").exists()


def test_no_cases_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ChallengeError, match="at least 1"):
        make_challenge(short_case(), Mix(0, (0,) * len(EFFECTS), 0), 1, tmp_path / "cases", tmp_path / "answers.json")


def test_diagnosis_never_loads_the_truth() -> None:
    """All modules of the diagnosis loaded: none of the challenge's are."""
    code = (
        "import sys, pkgutil, importlib, gearbench.diagnosis as d\n"
        "[importlib.import_module(m.name) for m in pkgutil.walk_packages(d.__path__, 'gearbench.diagnosis.')]\n"
        "print(len([n for n in sys.modules if n.startswith('gearbench.diagnosis.')]) > 40)\n"
        "print([n for n in sys.modules if n.startswith('gearbench.challenge')])\n"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:2] == ["True", "[]"]


def test_diagnosis_reads_no_provenance() -> None:
    folder = Path(__file__).resolve().parents[2] / "diagnosis"
    sources = list(folder.rglob("*.py"))
    assert sources
    for path in sources:
        text = path.read_text(encoding="utf-8")
        assert "provenance" not in text and "gearbench.challenge" not in text, path


def test_answers_say_what_was_drawn(challenge: tuple[Path, Path]) -> None:
    for answer in read_answers(challenge[1]).values():
        assert isinstance(answer, Answer)
        for name, severity in answer.severity.items():
            assert severity == 1.0 if name in FOREIGN else 0.35 <= severity <= 1.6

"""Keys by what people mean, values by what they smell of, gear files from the caller's folder."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import gearbench as gb
from gearbench.rig import CaseError
from gearbench.rig.casefile.meanings import MEANINGS
from gearbench.rig.casefile.reference import reference_text
from gearbench.rig.casefile.smells import smells


@pytest.mark.parametrize(
    ("setting", "key"),
    [
        ("rig.driver.z1=3", "teeth"),
        ("rig.driver.zahnzahl=3", "teeth"),
        ("rig.driver.modul=2", "module_mm"),
        ("rig.driver.alpha=20", "pressure_angle_deg"),
        ("rig.driver.x=0.1", "profile_shift"),
        ("rig.driver.b_mm=20", "face_width_mm"),
        ("rig.z2=30", "rig.driver.teeth or rig.driven.teeth"),
    ],
)
def test_a_word_from_elsewhere_is_led_to_its_key(setting: str, key: str) -> None:
    with pytest.raises(CaseError, match=f"did you mean {key}\\?"):
        gb.read_case("quick_lumped", [setting])


def test_every_meaning_is_a_key() -> None:
    text = reference_text()
    assert [key for key in set(MEANINGS.values()) if f"{key} = " not in text] == []


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("rig.driver.face_width_mm=0.02", "0.02 m meant, which is 20 mm"),
        ("rig.material.density_kg_m3=7.81", r"7.81 g/cm\^3 meant, which is 7810"),
        ("rig.material.youngs_modulus_gpa=0.206", "0.206 TPa meant, which is 206 GPa"),
        ("rig.support.stiffness_n_per_m=600", "600 N/um meant"),
    ],
)
def test_a_value_that_smells_is_questioned_and_taken(setting: str, words: str) -> None:
    found = smells(gb.read_case("quick_lumped", [setting]))
    assert found and all(sentence.count("is unusual: was") == 1 for sentence in found)
    assert re.search(words, found[0])


def test_a_number_that_was_computed_is_not_questioned() -> None:
    for typed, doubts in (("0.012", 1), ("0.01199", 1), ("0.00519917", 0)):
        assert len(smells(gb.read_case("quick_lumped", [f"rig.driver.runout_um={typed}"]))) == doubts


def test_shipped_cases_and_plastics_smell_of_nothing() -> None:
    from gearbench.cases import case_files

    for name in case_files():
        assert smells(gb.read_case(name)) == ()
    plastic = ["rig.material.youngs_modulus_gpa=2.8", "rig.material.density_kg_m3=1410"]
    assert smells(gb.read_case("quick_lumped", plastic)) == ()


def test_a_setting_finds_a_gear_in_the_callers_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from gearbench.cases import case_path

    gear = (case_path("quick_lumped").parent / "gears" / "z62_m2_b20.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(gear, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    case = gb.read_case("quick_lumped", ["rig.driver=mine.toml", "rig.driver.face_width_mm=19"])
    assert case.rig.driver.face_width == 0.019
    with pytest.raises(CaseError, match=r"yours\.toml does not exist"):
        gb.read_case("quick_lumped", ["rig.driver=yours.toml"])

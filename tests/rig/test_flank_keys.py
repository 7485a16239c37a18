"""Micro-geometry and errors of a gear in a case: units, neutral values, round trip, refusals."""

from __future__ import annotations

from math import radians
from pathlib import Path

import pytest

from gearbench.cases import case_path
from gearbench.rig import Case, CaseError, dump_case, effects_in, read_case, sound_gear

REFERENCE = case_path("reference")  # 62/62 teeth
RELIEF = ("rig.driver.tip_relief_um=15", "rig.driver.tip_relief_start_diameter_mm=126.2")
ROOT = ("rig.driver.root_relief_um=8", "rig.driver.root_relief_start_diameter_mm=122")
FORM = ("rig.driven.profile_form_um=[0, 1.5, -1]", "rig.driven.profile_form_diameter_mm=[121, 124, 127.5]")
WEAR = ("rig.driven.wear_depth_um=[0, 4.5]", "rig.driven.wear_roll_deg=[10, 30]")


def teeth(key: str, count: int = 62, first: str = "1.5") -> str:
    return f"rig.driver.{key}=[" + ", ".join([first] + ["0"] * (count - 1)) + "]"


def changed(*settings: str) -> Case:
    return read_case(REFERENCE, settings)


ALL = (
    *RELIEF, "rig.driver.tip_relief_shape=parabolic", *ROOT, "rig.driver.profile_slope_um=-3",
    teeth("profile_slope_tooth_um"), *FORM, "rig.driven.wear_um=0.5", *WEAR, teeth("wear_tooth"),
    "rig.driver.wear_um=1",
)  # fmt: skip


def test_keys_are_read_in_their_unit() -> None:
    one, two = changed(*ALL).rig.driver, changed(*ALL).rig.driven
    assert (one.tip_relief, one.tip_relief_start_diameter, one.tip_relief_shape) == (15e-6, 126.2e-3, "parabolic")
    assert (one.root_relief, one.root_relief_start_diameter, one.root_relief_shape) == (8e-6, 122e-3, "linear")
    assert (one.profile_slope, one.profile_slope_tooth[:2]) == (-3e-6, (1.5e-6, 0.0))
    assert (two.profile_form, two.profile_form_diameter) == ((0.0, 1.5e-6, -1e-6), (121e-3, 124e-3, 127.5e-3))
    assert two.wear_roll == pytest.approx((radians(10), radians(30)), rel=1e-15)
    assert (two.wear, two.wear_depth, one.wear_tooth[:2]) == (0.5e-6, (0.0, 4.5e-6), (1.5, 0.0))


def test_they_are_effects_and_a_sound_gear_has_none() -> None:
    rig = changed(*ALL).rig
    assert effects_in(rig) == (
        "rig.driver.tip_relief_um",
        "rig.driver.root_relief_um",
        "rig.driver.profile_slope_um",
        "rig.driver.profile_slope_tooth_um",
        "rig.driver.wear_um",
        "rig.driven.profile_form_um",
        "rig.driven.wear_um",
        "rig.driven.wear_depth_um",
    )
    assert sound_gear(rig.driver) == changed().rig.driver
    assert sound_gear(rig.driven) == changed().rig.driven
    assert effects_in(changed("rig.driven.iso_grade=6").rig) == ("rig.driven.iso_grade",)


@pytest.mark.parametrize(
    "settings",
    [
        ("rig.driver.tip_relief_start_diameter_mm=126", "rig.driver.tip_relief_shape=parabolic"),
        (teeth("profile_slope_tooth_um", first="0"), teeth("wear_tooth")),
        ("rig.driver.profile_form_um=[0, 0]", "rig.driver.profile_form_roll_deg=[10, 30]"),
        ("rig.driver.iso_seed=4",),
    ],
)
def test_shapes_without_an_amount_are_neutral(settings: tuple[str, ...]) -> None:
    assert effects_in(changed(*settings).rig) == ()


def test_round_trip(tmp_path: Path) -> None:
    full = changed(*ALL, "rig.driven.iso_seed=9", "rig.driver.profile_slope_um={value = 2, sd = 0.5}")
    copy = tmp_path / "copy.toml"
    copy.write_text(dump_case(full), encoding="utf-8")
    assert read_case(copy) == full
    graded = changed("rig.driver.iso_grade=6", "rig.driver.iso_seed=3")
    copy.write_text(dump_case(graded), encoding="utf-8")
    assert read_case(copy) == graded


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ((teeth("profile_slope_tooth_um", 61),), ["profile_slope_tooth_um has 61 values", "none or 62"]),
        ((teeth("wear_tooth", 63),), ["wear_tooth has 63 values", "none or 62"]),
        ((teeth("profile_slope_tooth_um", first="nan"),), ["profile_slope_tooth_um[0] = nan", "finite"]),
        ((FORM[0].replace("1.5", "nan"), FORM[1]), ["rig.driven.profile_form_um[1] = nan", "finite"]),
        ((FORM[0],), ["profile_form_um has 3", "profile_form_roll_deg has 0", "equally many"]),
        ((FORM[0], FORM[1].replace("124", "120")), ["profile_form_diameter_mm[1] = 120", "greater than", "121"]),
        ((*FORM, "rig.driven.profile_form_roll_deg=[1, 2, 3]"), ["both given"]),
        (
            ("rig.driver.wear_depth_um=[1]", "rig.driver.wear_roll_deg=[20]"),
            ["wear_depth_um has 1 value", "at least 2"],
        ),
        ((WEAR[0].replace("4.5", "-4.5"), WEAR[1]), ["wear_depth_um[1] = -4.5", "between 0 and 1000"]),
        ((RELIEF[0],), ["tip_relief_start_diameter_mm is missing", "tip_relief_um"]),
        (("rig.driver.tip_relief_um=-5",), ["rig.driver.tip_relief_um = -5", "at least 0 um"]),
        (("rig.driver.tip_relief_shape=cubic",), ["tip_relief_shape", '"linear" or "parabolic"']),
        (("rig.driver.iso_grade=12",), ["rig.driver.iso_grade = 12", "at most 11"]),
        (("rig.driver.iso_grade=6", "rig.driver.runout_um=5"), ["iso_grade = 6", "runout_um", "one of them"]),
        (("rig.driver.crowning_um=5",), ["rig.driver.crowning_um", "face width", "plane models"]),
        (("rig.driver.tip_relif_um=5",), ["did you mean tip_relief_um?"]),
    ],
)
def test_bad_tables_are_refused_in_one_sentence(settings: tuple[str, ...], words: list[str]) -> None:
    with pytest.raises(CaseError) as caught:
        changed(*settings)
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value), str(caught.value)

"""What `check` refuses is what the commands behind it refuse, in the same sentence, before anything is solved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gearbench.bench.errors import BenchError
from gearbench.bench.experiment import simulate
from gearbench.bench.readiness import check_case, check_gears
from gearbench.bench.statics import static
from gearbench.cases import case_path
from gearbench.cli import run_command_line
from gearbench.geometry import GeometryError, sector_mesh
from gearbench.geometry.tooth.profile import profile
from gearbench.rig import Case, read_case

# Settings of one key each, and a part of the sentence: key, value, limit.
BAD: list[tuple[str, tuple[str, ...]]] = [
    ("rig.driver.tip_relief_um=250", ("rig.driver.tip_relief_um", "250 um", "at most 200 um")),
    ("rig.driver.profile_slope_um=-201", ("rig.driver.profile_slope_um", "201 um", "at most 200 um")),
    ("rig.driven.wear_um=300", ("rig.driven.wear_um", "300 um", "at most 200 um")),
    ("rig.driver.runout_um=900", ("runout_um", "307.8 um", "at most 294 um")),
    ("rig.driver.hub_radius_mm=60", ("rig.driver.hub_radius_mm = 60", "at most 59.3")),
    ("rig.driver.tip_diameter_mm=140", ("rig.driver.tip_diameter_mm = 140", "pointed")),
    ("rig.driver.mass_kg=0.1", ("rig.driver.mass_kg = 0.1", "at least")),
    ("simulation.element_size_um=1200", ("simulation.element_size_um = 1200", "1000 (module/2)")),
    ("experiment.torque_mean_nm=3500", ("experiment.torque_mean_nm = 3500", "at most 3496")),
    ("rig.centre_distance_mm=0.124", ("rig.centre_distance_mm = 0.124", "must exceed")),
]


def case_with(*settings: str) -> Case:
    return read_case(case_path("quick_fe"), ["rig.driver.tip_relief_start_diameter_mm=126", *settings])


@pytest.mark.parametrize(("setting", "words"), BAD)
def test_check_refuses_with_key_value_and_limit(setting: str, words: tuple[str, ...]) -> None:
    case = case_with(setting)
    with pytest.raises((GeometryError, BenchError)) as caught:
        check_case(case)
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("setting", "words"), [row for row in BAD if row[0].startswith("rig.dri")])
def test_solvers_refuse_gears_in_the_same_words(setting: str, words: tuple[str, ...]) -> None:
    case = case_with(setting)
    said = []
    for solve in (lambda: check_gears(case.rig), lambda: static(case, positions=2), lambda: simulate(case)):
        with pytest.raises(GeometryError) as caught:
            solve()
        said.append(str(caught.value))
    assert len(set(said)) == 1


def test_table_that_misses_the_flank_is_refused() -> None:
    case = case_with("rig.driver.profile_form_um=[1, 2]", "rig.driver.profile_form_diameter_mm=[127, 128]")
    with pytest.raises(GeometryError, match=r"rig\.driver\.profile_form_diameter_mm runs from 127 to 128 mm"):
        check_case(case)


def test_a_crack_that_runs_out_of_its_tooth_is_refused() -> None:
    keys = "tooth = 0, length_mm = 30.0, direction_deg = 60.0"
    with pytest.raises(GeometryError, match=r"rig\.driver\.crack\.length_mm = 30 .* less than"):
        check_case(case_with(f"rig.driver.crack={{{keys}}}"))


def test_a_crack_among_quadrilaterals_is_refused_by_all() -> None:
    keys = "tooth = 0, length_mm = 0.5, direction_deg = 60.0"
    case = case_with(f"rig.driven.crack={{{keys}}}", 'simulation.element="quadrilateral"')
    said = []
    words = r'rig\.driven\.crack .* simulation\.element = "quadrilateral"'
    for solve in (lambda: check_case(case), lambda: static(case, positions=2), lambda: simulate(case)):
        with pytest.raises(GeometryError, match=words) as caught:
            solve()
        said.append(str(caught.value))
    assert len(set(said)) == 1


def test_grade_outside_the_standard_is_refused() -> None:
    gear: dict[str, Any] = {"module_mm": 0.4, "hub_radius_mm": 5, "thinning_um": 10, "bore_radius_mm": 0}
    both = [f"rig.{side}.{key}={value}" for side in ("driver", "driven") for key, value in gear.items()]
    case = case_with(*both, "rig.driven.iso_grade=7")
    with pytest.raises(GeometryError, match=r"rig\.driven: ISO 1328-1 has no tolerance for module_mm = 0\.4 mm"):
        check_case(case)


def test_mesh_refuses_the_element_size_that_check_refuses() -> None:
    gear = case_with().rig.driven
    with pytest.raises(GeometryError) as caught:
        sector_mesh(profile(gear), gear, 1.2e-3)
    with pytest.raises(GeometryError) as checked:
        check_case(case_with("simulation.element_size_um=1200"))
    assert str(caught.value) == str(checked.value)


def test_errors_up_to_the_limit_pass() -> None:
    check_case(
        case_with("rig.driver.tip_relief_um=200", "rig.driver.runout_um=850", "rig.driven.profile_slope_um=-200")
    )


@pytest.mark.parametrize(
    ("setting", "sentence"),
    [
        ("rig.driver.profile_form_um=[1, nan]", "rig.driver.profile_form_um[1] = nan must be a finite number in um"),
        ("rig.driver.pitch_error_um=[1, 2, 3]", "pitch_error_um has 3 values, must have none or 62"),
        ("rig.driver.module_mm=0.002|rig.driven.module_mm=0.002", "rig.driver.module_mm = 0.002 is too small: at"),
        ("rig.driver.tip_relief_um=250", "at most 200 um"),
    ],
)
def test_check_exits_2_with_one_sentence(setting: str, sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    settings = ["--set", "rig.driver.tip_relief_start_diameter_mm=126"]
    for one in setting.split("|"):
        settings += ["--set", one]
    assert run_command_line(["check", "quick_fe", *settings]) == 2
    out, err = capsys.readouterr()
    refusals = [line for line in err.splitlines() if "warning:" not in line]
    assert len(refusals) == 1 and sentence in refusals[0] and not out


@pytest.mark.parametrize(
    ("option", "value", "sentence"),
    [
        ("--torque-nm", "0", "torque_nm = 0 must be finite and greater than 0"),
        ("--torque-nm", "-5", "torque_nm = -5 must be finite and greater than 0"),
        ("--torque-nm", "nan", "torque_nm = nan must be finite and greater than 0"),
        ("--torque-nm", "inf", "torque_nm = inf must be finite and greater than 0"),
        ("--torque-nm", "3500", "torque_nm = 3500 is more than the modelled flanks can carry: at most 3496"),
        ("--dte-um", "0", "dte_um = 0 must be finite and greater than 0"),
        ("--dte-um", "-3", "dte_um = -3 must be finite and greater than 0"),
        ("--dte-um", "nan", "dte_um = nan must be finite and greater than 0"),
        ("--dte-um", "101", "dte_um = 101 presses the flanks further than they are modelled: at most 100"),
    ],
)
def test_static_loads_are_refused_before_any_work(
    option: str, value: str, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "static.nc"
    assert run_command_line(["static", "quick_fe", "--out", str(out), option, value]) == 2
    err = capsys.readouterr().err.strip().splitlines()
    assert sentence in err[-1] and not list(tmp_path.iterdir())


def test_the_lumped_model_refuses_a_dte_beyond_its_table_in_the_same_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["static", "quick_fe", "--model", "lumped", "--set", 'simulation.mesh_stiffness="finite-element"']
    assert run_command_line([*words, "--out", str(tmp_path / "static.nc"), "--dte-um", "5000"]) == 2
    err = capsys.readouterr().err.strip().splitlines()
    assert "dte_um = 5000 presses the flanks further than they are modelled: at most 100" in err[-1]
    assert not list(tmp_path.iterdir())

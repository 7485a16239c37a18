"""Case files as users write them: units, files, settings, and one sentence for every mistake."""

from __future__ import annotations

import os
from math import pi
from pathlib import Path

import pytest

from gearbench.rig import Case, CaseError, read_case

GEAR = """
teeth = 62
module_mm = 2.0
face_width_mm = 20.0
hub_radius_mm = 25.0
"""

CASE = f"""
name = "pair"
[rig.driver]{GEAR}
[rig.driven]{GEAR}
[rig.support]
stiffness_n_per_m = 6e6
damping_n_s_per_m = 8e4
[experiment]
mesh_frequency_hz = 2.0
torque_mean_nm = 2.0
sampling_rate_hz = 8192
samples_per_period = 8192
[experiment.multisine]
amplitude_nm = 0.4
band_hz = [1, 3000]
"""


@pytest.fixture
def write(tmp_path: Path):
    def _write(text: str = CASE, name: str = "case.toml") -> Path:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        return path

    return _write


def refusal(path: Path, *settings: str) -> str:
    with pytest.raises(CaseError) as caught:
        read_case(path, settings)
    sentence = str(caught.value)
    assert "\n" not in sentence
    return sentence


def test_units_become_si(write) -> None:
    case = read_case(
        write(CASE.replace("[rig.driven]", "pressure_angle_deg = 25\nthinning_um = 12.3\n[rig.driven]"))
    )
    driver = case.rig.driver
    assert (driver.module, driver.face_width, driver.thinning) == (0.002, 0.02, 12.3e-6)
    assert driver.pressure_angle == pytest.approx(25 * pi / 180, rel=1e-15)
    assert case.rig.material.youngs_modulus == 206e9
    assert case.experiment.sampling_rate == 8192.0
    assert case.experiment.multisine is not None
    assert case.experiment.multisine.band == (1.0, 3000.0)
    fast = read_case(write(CASE.replace("mesh_frequency_hz = 2.0", "speed_driver_rpm = 60.0")))
    assert fast.experiment.mesh_frequency_for(62) == pytest.approx(62.0, rel=1e-15)


def test_a_decimal_reads_as_the_float_nearest_to_it_in_si(write) -> None:
    # 2.1 * 1e-3 in binary is 0.0021000000000000003.
    assert read_case(write(), ["rig.driver.module_mm=2.1"]).rig.driver.module == 0.0021


def test_common_support_serves_both_and_tables_override(write) -> None:
    both = read_case(write()).rig.support
    assert both.driver == both.driven
    assert (both.driver.stiffness, both.driver.damping, both.direction) == (6e6, 8e4, "tangential")
    own = CASE.replace(
        "[experiment]",
        "direction = 'line-of-action'\n[rig.support.driven]\nstiffness_n_per_m=1e7\n[experiment]",
    )
    support = read_case(write(own)).rig.support
    assert (support.driver.stiffness, support.driven.stiffness) == (6e6, 1e7)
    assert (support.driven.damping, support.direction) == (8e4, "line-of-action")


def test_setting_the_common_support_wins_over_the_file(write) -> None:
    own = CASE.replace("[experiment]", "[rig.support.driven]\nstiffness_n_per_m=1e7\n[experiment]")
    support = read_case(write(own), ["rig.support.stiffness_n_per_m=3e7"]).rig.support
    assert (support.driver.stiffness, support.driven.stiffness) == (3e7, 3e7)
    support = read_case(write(own), ["rig.support.driver.stiffness_n_per_m=3e7"]).rig.support
    assert (support.driver.stiffness, support.driven.stiffness) == (3e7, 1e7)


def test_value_with_standard_deviation(write) -> None:
    text = CASE.replace("= 6e6", "= { value = 6e6, sd = 1e6 }").replace(
        "mm = 25.0", "mm = {value = 25, sd = 0.5}"
    )
    case = read_case(write(text))
    assert case.rig.support.driven.stiffness == 6e6
    assert case.rig.driver.hub_radius == 0.025
    assert case.uncertainty == {
        "rig.driver.hub_radius": 0.0005,
        "rig.driven.hub_radius": 0.0005,
        "rig.support.driver.stiffness": 1e6,
        "rig.support.driven.stiffness": 1e6,
    }
    own = text.replace("[experiment]", "[rig.support.driven]\nstiffness_n_per_m=1e7\n[experiment]")
    assert "rig.support.driven.stiffness" not in read_case(write(own)).uncertainty


def test_gear_from_a_file_beside_the_case(write, monkeypatch, tmp_path_factory) -> None:
    write(GEAR.replace("62", "25"), "gears/z25.toml")
    text = CASE.replace(f"[rig.driver]{GEAR}", "[rig]\ndriver = 'gears/z25.toml'")
    path = write(text)
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    assert read_case(path).rig.driver.teeth == 25
    assert read_case(path, ["rig.driver.teeth=30"]).rig.driver.teeth == 30
    assert (
        read_case(path, ["rig.driven=gears/z25.toml", "rig.driven.face_width_mm=9"]).rig.driven.face_width
        == 0.009
    )
    missing = refusal(path, "rig.driven=gears/z26.toml")
    assert "rig.driven" in missing and "z26.toml" in missing and "does not exist" in missing


def test_settings_create_tables_and_fall_back_to_strings(write) -> None:
    case = read_case(
        write(),
        [
            "rig.damping.mesh_ratio=0.07",
            "rig.load.boundary=torque",
            "name=a b",
            "experiment.multisine.band_hz=[2, 30]",
        ],
    )
    assert case.rig.damping.mesh_ratio == 0.07
    assert case.rig.load.boundary == "torque"
    assert case.name == "a b"
    assert case.experiment.multisine is not None and case.experiment.multisine.band == (2.0, 30.0)


def test_conditions_inherit_the_experiment(write) -> None:
    text = CASE + (
        '[[condition]]\nname = "slow"\ntorque_mean_nm = 3.0\n'
        '[[condition]]\nname = "fast"\nspeed_driver_rpm = 6.0\nmultisine = { rms_nm = 0.1 }\n'
    )
    case = read_case(write(text), ["condition.0.periods=7"])
    slow, fast = case.conditions
    assert (slow.name, slow.experiment.torque_mean, slow.experiment.periods) == ("slow", 3.0, 7)
    assert slow.experiment.mesh_frequency == 2.0
    assert fast.experiment.mesh_frequency is None and fast.experiment.speed_driver == pytest.approx(0.2 * pi)
    assert fast.experiment.multisine is not None
    assert (fast.experiment.multisine.amplitude, fast.experiment.multisine.band) == (None, (1.0, 3000.0))
    assert case.under(slow).experiment == slow.experiment
    for name in ("../../etc", "a b", "", "x" * 61):
        assert "condition[0].name" in refusal(write(CASE + f'[[condition]]\nname = "{name}"\n'))
    twice = CASE + '[[condition]]\nname = "a"\n[[condition]]\nname = "a"\n'
    assert '"a" is given 2 times' in refusal(write(twice))
    assert "condition[0].torque_men_nm" in refusal(
        write(CASE + '[[condition]]\nname = "a"\ntorque_men_nm = 1\n')
    )


def test_a_condition_that_names_its_grid_chooses_its_residue_anew(write) -> None:
    comb = CASE + 'grid = "comb"\nresidue = 5\n'
    text = comb + "".join(
        f'[[condition]]\nname = "{name}"\nmultisine = {{ {keys} }}\n'
        for name, keys in (
            ("same", "amplitude_nm = 1"),
            ("chosen", 'grid = "comb"'),
            ("full", 'grid = "full"'),
            ("other", "residue = 7"),
        )
    )
    found = [condition.experiment.multisine for condition in read_case(write(text)).conditions]
    combs = [(multisine.grid, multisine.residue) for multisine in found if multisine]
    assert combs == [("comb", 5), ("comb", None), ("full", None), ("comb", 7)]


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("rig.driver.teeth=4", ["rig.driver.teeth = 4", "at least 5"]),
        ("rig.driver.teeth=20.5", ["rig.driver.teeth = 20.5", "whole number"]),
        ("rig.driver.teeth=true", ["rig.driver.teeth = true", "number"]),
        ("rig.driver.module_mm=-2", ["rig.driver.module_mm = -2", "greater than 0 mm"]),
        ("rig.driver.module_mm=101", ["rig.driver.module_mm = 101", "at most 100 mm"]),
        ("rig.driver.module_mm=nan", ["rig.driver.module_mm = nan", "finite"]),
        ("rig.driver.module_mm=-inf", ["rig.driver.module_mm", "finite"]),
        ("rig.driver.module_mm=1e999", ["rig.driver.module_mm", "finite"]),
        ("rig.driver.module_mm=1e99999999999999999999999", ["rig.driver.module_mm", "number in mm"]),
        ("rig.driver.module_mm='2'", ['rig.driver.module_mm = "2"', "number in mm"]),
        ("rig.driver.module_mm=[2]", ["rig.driver.module_mm = [2]", "number in mm"]),
        ("rig.driver.module_mm=1979-05-27", ["rig.driver.module_mm", "number in mm"]),
        ("rig.driver.module_mm=true", ["rig.driver.module_mm = true", "number in mm"]),
        ("rig.driver.pressure_angle_deg=40", ["rig.driver.pressure_angle_deg = 40", "at most 35 deg"]),
        ("rig.material.youngs_modulus_gpa=2001", ["2001", "at most 2000 GPa"]),
        ("rig.material.poisson=0.5", ["rig.material.poisson = 0.5", "less than 0.5"]),
        ("rig.material.state=3d", ['rig.material.state = "3d"', '"plane-stress" or "plane-strain"']),
        ("rig.support.direction=tangent", ["rig.support.direction", 'did you mean "tangential"?']),
        ("rig.support.stiffness_n_per_m=0", ["rig.support.stiffness_n_per_m = 0", "greater than 0 N/m"]),
        (
            "rig.support.driver.damping_n_s_per_m=-1",
            ["rig.support.driver.damping_n_s_per_m = -1", "at least 0 N s/m"],
        ),
        ("rig.support.driver=3", ["rig.support.driver = 3", "table"]),
        ("rig=3", ["rig = 3", "table"]),
        ("name=''", ["name", "not empty"]),
        ("name=3", ["name = 3", "text"]),
        ("experiment.multisine.band_hz=[5]", ["experiment.multisine.band_hz = [5]", "2 numbers"]),
        ("experiment.multisine.band_hz=5", ["experiment.multisine.band_hz = 5", "list"]),
        (
            "experiment.multisine.band_hz=[5, true]",
            ["experiment.multisine.band_hz[1] = true", "number in Hz"],
        ),
        ("experiment.multisine.band_hz=[50, 5]", ["experiment.multisine", "band_hz = [50.0, 5.0]", "rise"]),
        (
            "experiment.multisine.band_hz=[1, 5000]",
            ["multisine.band_hz ends at 5000", "sampling_rate_hz = 8192"],
        ),
        ("experiment.multisine.rms_nm=1", ["experiment.multisine", "exactly one of amplitude_nm and rms_nm"]),
        ("experiment.speed_driver_rpm=1", ["exactly one of mesh_frequency_hz and speed_driver_rpm"]),
        (
            "identification.band_hz=[1, 4096]",
            ["identification.band_hz ends at 4096", "below half", "4096 Hz"],
        ),
        ("simulation.mesh_stiffness=rectangular", ["simulation", "stiffness_single_n_per_m"]),
        ("rig.driver.module_mm={value=2}", ["rig.driver.module_mm = { value = 2 }", "sd"]),
        ("rig.driver.module_mm={value=2, sd=-1}", ["rig.driver.module_mm.sd = -1", "at least 0 mm"]),
        ("rig.driver.module_mm={value=-2, sd=1}", ["rig.driver.module_mm.value = -2", "greater than 0 mm"]),
        ("rig.driver.modul_mm=2", ["rig.driver.modul_mm", "did you mean module_mm?"]),
        ("rig.driver.module_m=0.002", ["rig.driver.module_m ", "spelt module_mm"]),
        ("rig.driver.module=2", ["rig.driver.module ", "spelt module_mm"]),
        ("rig.driver.teeth_mm=2", ["rig.driver.teeth_mm", "spelt teeth"]),
        ("rig.support.stiffness=2", ["rig.support.stiffness ", "spelt stiffness_n_per_m"]),
        ("rig.torque_mean_nm=2", ["rig.torque_mean_nm", "belongs to experiment.torque_mean_nm"]),
        (
            "rig.driver.helix_angle_deg=10",
            ["rig.driver.helix_angle_deg", "helical gears are not supported: spur gears only"],
        ),
        ("rig.driver.web_width_mm=5", ["rig.driver.web_width_mm", "webs and rims are not modelled", "hub_radius_mm"]),
        ("rig.driven.rim_thickness_mm=5", ["rig.driven.rim_thickness_mm", "webs and rims are not modelled"]),
        ("rig.support.web_mm=5", ["rig.support.web_mm", "not a known key"]),
        ("uncertainty={}", ["uncertainty", "not a known key"]),
        ("zzz=1", ["zzz is not a known key"]),
        ("rig.driver.teeth", ["rig.driver.teeth", "dotted.key=value"]),
        ("=3", ["dotted.key=value"]),
        ("rig.driver.teeth.x=3", ["rig.driver.teeth", "not a table"]),
        ("experiment.seed=123456789012345678901234567890", ["experiment.seed", "at most"]),
    ],
)
def test_bad_settings_are_refused_in_one_sentence(write, setting: str, words: list[str]) -> None:
    sentence = refusal(write(), setting)
    for word in words:
        assert word in sentence, sentence


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("teeth = 62\n", "", ["rig.driver.teeth is missing", "number of teeth"]),
        (
            "stiffness_n_per_m = 6e6\n",
            "",
            ["rig.support.driver: stiffness_n_per_m is missing"],
        ),
        ("mesh_frequency_hz = 2.0\n", "", ["exactly one of mesh_frequency_hz and speed_driver_rpm"]),
        ("= 8192\n", "= \n", ["not valid TOML", "line"]),
        ("torque_mean_nm = 2.0", "torque_mean_nm = 2.0\ntorque_mean_nm = 2.0", ["not valid TOML", "line"]),
        ("torque_mean_nm = 2.0", "torque_mean_nm = 1" + "0" * 5000, ["not valid TOML"]),
        ("torque_mean_nm = 2.0", "torque_mean_nm = " + "[" * 100000, ["nested too deeply"]),
    ],
)
def test_bad_files_are_refused_in_one_sentence(write, old: str, new: str, words: list[str]) -> None:
    sentence = refusal(write(CASE.replace(old, new, 1)))
    for word in words:
        assert word in sentence, sentence


def test_unreadable_files(write, tmp_path: Path) -> None:
    assert "does not exist" in refusal(tmp_path / "none.toml")
    assert "is a folder" in refusal(tmp_path)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b'name = "\xff\xfe"')
    assert "not UTF-8" in refusal(binary)
    empty = tmp_path / "empty.toml"
    empty.write_text("")
    assert "rig is missing" in refusal(empty)
    truncated = tmp_path / "truncated.toml"
    truncated.write_text(CASE[: CASE.index("[experiment]") + 6])
    assert "not valid TOML" in refusal(truncated)
    huge = tmp_path / "huge.toml"
    huge.write_text("#" * 5_000_000)
    assert "larger than" in refusal(huge)


def test_a_byte_order_mark_is_harmless(tmp_path: Path) -> None:
    path = tmp_path / "bom.toml"
    path.write_bytes(b"\xef\xbb\xbf" + CASE.encode())
    assert isinstance(read_case(path), Case)


def test_devices_pipes_and_folders_are_refused_at_once(write, tmp_path: Path) -> None:
    """As a case and as a gear file; a device or a pipe would be read for ever."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for name, words in ((str(pipe), "is not a plain file"), ("/dev/zero", "is not a plain file"), (".", "is a folder")):
        with pytest.raises(CaseError, match=words):
            read_case(tmp_path / name)
        with pytest.raises(CaseError, match=rf"gear file rig.driver = \S+ {words}"):
            read_case(write(), [f'rig.driver="{name}"'])


def test_a_file_that_grows_while_it_is_read_has_a_limit(write, tmp_path: Path) -> None:
    sparse = tmp_path / "sparse.toml"
    with sparse.open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(CaseError, match="larger than 4 MB"):
        read_case(sparse)

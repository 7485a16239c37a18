"""A speed table from a CSV file: the same case as with its columns written out, and one sentence for what is none."""

from __future__ import annotations

from pathlib import Path

import pytest

from gearbench.rig import Case, CaseError, dump_case, read_case

CASE = """
[rig]
driver = "gear.toml"
driven = "gear.toml"
[rig.support]
stiffness_n_per_m = 1e8
[experiment]
torque_mean_nm = 50
sampling_rate_hz = 4096
samples_per_period = 4096
"""
GEAR = "teeth = 20\nmodule_mm = 3\nface_width_mm = 20\nhub_radius_mm = 20\n"
COURSE = "# of the rig's log\ntime_s;torque_nm;driver_rpm\n0.1;1;60\n0.35; 2 ;612.5\n\n0.9;3;90\n"
COLUMNS = "time_s = [0.1, 0.35, 0.9], driver_rpm = [60, 612.5, 90]"


def read(folder: Path, table: str, *settings: str, below: str = "") -> Case:
    (folder / "gear.toml").write_text(GEAR)
    (folder / "one.toml").write_text(f"{CASE}{table}\n{below}")
    return read_case(folder / "one.toml", list(settings))


def test_the_file_is_as_good_as_its_columns(tmp_path: Path) -> None:
    written = read(tmp_path, f"speed_table = {{ {COLUMNS} }}")
    for text in (COURSE, COURSE.replace(";", ","), COURSE.replace(";", "\t"), COURSE.replace(";", "  ")):
        (tmp_path / "course.csv").write_text(text)
        case = read(tmp_path, '[experiment.speed_table]\nfile = "course.csv"')
        assert case == written and "course.csv" not in dump_case(case)
    below = '[[condition]]\nname = "up"\nspeed_table = { file = "course.csv" }\n'
    (condition,) = read(tmp_path, "mesh_frequency_hz = 20", below=below).conditions
    assert condition.experiment.speed_table == written.experiment.speed_table


def test_a_setting_finds_it_beside_the_caller_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "mine.csv").write_text(COURSE)
    monkeypatch.chdir(tmp_path / "here")
    case = read(tmp_path, "", "experiment.speed_table.file=mine.csv")
    assert case.experiment.speed_table is not None and len(case.experiment.speed_table.time) == 3


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s;speed\n0;1\n", "course.csv has no column driver_rpm: its first line must name time_s and driver_rpm"),
        ("", "no column time_s"),
        ("time_s;driver_rpm\n0;60\n1;fast\n", "line 3: driver_rpm = 'fast' must be a number"),
        ("time_s;driver_rpm\n0;60\n1\n", "line 3: 1 values, the first line names 2"),
        ("time_s;driver_rpm\n1;60\n0;70\n", "must rise"),
        ("time_s;driver_rpm\n1;60\n2;inf\n", "must be a finite number"),
        ("time_s;driver_rpm\n1;60\n", "at least 2"),
    ],
)
def test_what_is_no_course_is_refused(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "course.csv").write_text(text)
    with pytest.raises(CaseError, match=words):
        read(tmp_path, '[experiment.speed_table]\nfile = "course.csv"')


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ('file = "none.csv"', r"speed file experiment.speed_table.file = \S+none.csv does not exist"),
        ('file = "gear.toml"\ntime_s = [0, 1]', "both file and time_s"),
        ("file = 3", "must name a CSV file"),
    ],
)
def test_what_names_no_file_is_refused(tmp_path: Path, table: str, words: str) -> None:
    with pytest.raises(CaseError, match=words):
        read(tmp_path, f"[experiment.speed_table]\n{table}")

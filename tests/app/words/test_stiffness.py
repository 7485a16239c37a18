"""Text, JSON and picture of the stiffness table and of the ISO root stress."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gearbench.bench.results.stiffness_table import StiffnessTable, stiffness_table
from gearbench.bench.statics import static
from gearbench.cases import case_path
from gearbench.commands.gears.static_methods import draw_largest, methods_data, methods_lines, stiffness_tables
from gearbench.figures.gears.stiffness import draw_stiffness_table
from gearbench.geometry import pair
from gearbench.lumped.stiffness.iso6336_root import root_stress
from gearbench.rig import Case, read_case
from gearbench.shell.failure import InputError
from gearbench.words.iso_root_stress import root_stress_data, root_stress_lines
from gearbench.words.stiffness import stiffness_data, stiffness_lines


@pytest.fixture(scope="module")
def case() -> Case:
    return read_case(case_path("paper_lumped"))


@pytest.fixture(scope="module")
def table(case: Case) -> StiffnessTable:
    return stiffness_table(case, static(case, "lumped", torque=[50.0], positions=16))


def test_every_row_is_a_line_with_its_figures(table: StiffnessTable) -> None:
    lines = stiffness_lines(table)
    assert lines[0].startswith("mesh stiffness at 50 N m [N/um]")
    assert [line[2:45].strip() for line in lines[2:7]] == [row.model for row in table.rows]
    lumped, energy, *_, iso = lines[2:7]
    figures = [float(word) for word in energy[45:].split()]
    row = table.rows[1]
    wanted = [value / 1e6 for value in (row.single, row.mean, row.least, row.most)]
    assert figures[:4] == pytest.approx(wanted, abs=0.06)
    assert figures[4] == pytest.approx(row.mean / 0.02 / 1e9, abs=6e-3)
    assert lumped[45:].split()[0] == "-" and iso[45:].split()[2:4] == ["-", "-"]
    assert lines[-1].startswith("  note: load 40.3 N/mm is below")


def test_json_has_the_same(table: StiffnessTable) -> None:
    data = stiffness_data(table)
    assert data["torque_nm"] == pytest.approx(50.0)
    assert data["notes"] == list(table.notes)
    row = data["rows"][1]
    assert (row["model"], row["contains_body_torsion"]) == ("potential energy, hub to hub", True)
    assert row["mean_n_per_um"] * 1e6 == pytest.approx(table.rows[1].mean)
    assert data["rows"][4]["least_n_per_um"] is None


def test_picture(tmp_path: Path, table: StiffnessTable) -> None:
    draw_stiffness_table(tmp_path / "k.svg", table)
    text = (tmp_path / "k.svg").read_text(encoding="utf-8")
    for label in ("lumped model", "potential energy", "Weber-Banaschek", "c_gamma", "mesh phase"):
        assert label in text


def test_root_stress_of_both_gears(case: Case) -> None:
    data = root_stress_data(case.rig, 50.0)
    meshing = pair(case.rig)
    found = root_stress(case.rig, meshing, "driven", 50.0 / meshing.driver.base_radius)
    assert data["gears"]["driven"]["sigma_f0_mpa"] == pytest.approx(found.stress / 1e6)
    line = root_stress_lines(data)[1]
    assert re.fullmatch(r"ISO 6336-3 nominal root stress, driven: [\d.]+ MPa \(Y_F = [\d.]+, Y_S = [\d.]+\)", line)
    assert f"{found.stress / 1e6:.1f} MPa" in line


def test_a_cracked_tooth_is_said_to_be_taken_as_sound() -> None:
    keys = "tooth = 3, length_mm = 0.8, direction_deg = 60"
    data = root_stress_data(read_case(case_path("paper_lumped"), [f"rig.driven.crack={{{keys}}}"]).rig, 50.0)
    sound = root_stress_data(read_case(case_path("paper_lumped")).rig, 50.0)
    assert data["gears"] == sound["gears"]
    assert root_stress_lines(data)[-1].startswith("  note: rig.driven.crack: the teeth are taken as sound")
    assert not any("crack" in line for line in root_stress_lines(sound))


def test_root_stress_is_left_out_where_two_pairs_always_carry() -> None:
    changes = [f"rig.{gear}.{key}" for gear in ("driver", "driven") for key in ("addendum=1.35", "dedendum=1.6")]
    changes += [f"rig.{gear}.rack_tip_radius=0.2" for gear in ("driver", "driven")]
    case = read_case(case_path("paper_lumped"), changes)
    data = root_stress_data(case.rig, 50.0)
    assert data["gears"] == {}
    assert root_stress_lines(data)[0].startswith("  note: ISO 6336-3 root stress needs")


def test_every_load_that_carries_has_a_table(case: Case) -> None:
    result = static(case, "lumped", torque=[50.0, 150.0, 100.0], positions=8)
    tables = stiffness_tables(case, result)
    assert [table.torque for table in tables] == pytest.approx([50.0, 150.0, 100.0])
    data = methods_data(case, tables)
    assert [one["torque_nm"] for one in data["stiffness"]] == pytest.approx([50.0, 150.0, 100.0])
    ratio = [one["gears"]["driver"]["sigma_f0_mpa"] for one in data["iso_root_stress"]]
    assert ratio[1] == pytest.approx(3 * ratio[0])
    lines = methods_lines(case, tables)
    assert lines[0].startswith("mesh stiffness at 150 N m")
    assert any(f"{ratio[1]:.1f} MPa" in line for line in lines)
    result["stiffness_secant"].values[1, 3] = 0.0  # a gap that a given error does not close
    assert [table.torque for table in stiffness_tables(case, result)] == pytest.approx([50.0, 100.0])
    assert methods_lines(case, []) == []


def test_picture_shows_the_largest_load(tmp_path: Path, case: Case) -> None:
    tables = stiffness_tables(case, static(case, "lumped", torque=[150.0, 50.0], positions=8))
    draw_largest(tables, tmp_path / "k.svg")
    assert "Mesh stiffness at 150 N m" in (tmp_path / "k.svg").read_text(encoding="utf-8")
    with pytest.raises(InputError, match="needs a load"):
        draw_largest([], tmp_path / "none.svg")

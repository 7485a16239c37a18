"""`static` with stress: names and refusals of its files, the table beside ISO 6336-3, the pictures' data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from gearbench.bench.stress.fields import Contact, PairFields
from gearbench.cases import case_path
from gearbench.cli import run_command_line
from gearbench.commands.gears.stress_output import field_files, field_phases
from gearbench.figures.gears.stress import limits, plot_fields, plot_root_stress, rounded_up, tooth_history
from gearbench.geometry import PairMesh
from gearbench.lumped.stiffness.iso6336_root import root_stress
from gearbench.rig import Case, read_case
from gearbench.shell.failure import InputError
from gearbench.words.root_stress import root_lines, root_tables


@pytest.mark.parametrize(
    ("words", "phases"),
    [(["0,0.25,0.5"], [0.0, 0.25, 0.5]), (["0", "0.25"], [0.0, 0.25]), (["-0.5", "0.1,-0.5"], [-0.5, 0.1]), ([], [])],
)
def test_phases_in_a_row_or_with_commas(words: list[str], phases: list[float]) -> None:
    assert field_phases(words) == phases


@pytest.mark.parametrize(("word", "says"), [("0,x", "'x' is not a mesh phase"), ("nan", "must be a mesh phase")])
def test_other_words_are_refused(word: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        field_phases([word])


def test_files_are_named_after_the_result(tmp_path: Path) -> None:
    ((phase, fields, picture), (_, odd, _)) = field_files(tmp_path / "a.nc", [0.25, 0.12345], [])
    assert (phase, fields.name, picture.name) == (0.25, "a_phase0.250.vtu", "a_phase0.250.png")
    assert odd.name == "a_phase0.12345.vtu" and odd.parent == tmp_path
    with pytest.raises(InputError, match="would replace"):
        field_files(tmp_path / "a.nc", [0.25], [tmp_path / "a_phase0.250.png"])


@pytest.mark.parametrize(
    ("case", "more", "words"),
    [
        ("quick_lumped", ["--fields", "0"], "--fields needs finite elements"),
        ("quick_lumped", ["--root-figure", "{folder}/root.png"], "--root-figure needs finite elements"),
        ("quick_fe", ["--fields", "0", "0.5", "x"], "x"),
        ("quick_fe", ["--fields", "inf"], "must be a mesh phase"),
        ("quick_fe", ["--fields", "0", "--figure", "{folder}/static_phase0.000.png"], "would replace"),
        ("quick_fe", ["--root-figure", "{folder}/a.png", "--figure", "{folder}/a.png"], "which it would replace"),
        ("quick_fe", ["--fields", "0", "--set", "rig.driver.crack={tooth=1, stiffness_loss=0.1}"], "rig.driver.crack"),
        (
            "quick_fe",
            ["--root-figure", "{folder}/root.png", "--set", "rig.driver.crack={tooth=1, stiffness_loss=0.1}"],
            "--root-figure cannot be drawn",
        ),
    ],
)
def test_refused_before_any_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], case: str, more: list[str], words: str
) -> None:
    out = tmp_path / "static.nc"
    given = [part.replace("{folder}", str(tmp_path)) for part in more]
    assert run_command_line(["static", case, "--out", str(out), "--positions", "4", *given]) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def case() -> Case:
    return read_case(case_path("quick_fe"))


@pytest.fixture
def result() -> xr.Dataset:
    """A static result made by hand: two loads, four phases, three teeth."""
    phase, teeth = np.arange(4) / 4, np.array([-1, 0, 1])
    stress = np.arange(24.0).reshape(2, 4, 3) * 1e6
    data: dict[str, Any] = {"torque": (("load", "phase"), np.array([[10.0] * 4, [50.0] * 4]))}
    data["root_stress_tooth"] = ("root", teeth)
    for name, factor in (("driver", 1.0), ("driven", 2.0)):
        data[f"root_stress_{name}"] = (("load", "phase", "root"), factor * stress)
        for key, value in (("peak", 23e6), ("radius", 0.06), ("angle", np.pi / 6), ("phase", 0.3), ("outer", 30e6)):
            data[f"root_stress_{key}_{name}"] = ("load", np.full(2, factor * value))
    return xr.Dataset(data, coords={"phase": phase, "load": [10.0, 50.0]})


def test_table_beside_iso(case: Case, result: xr.Dataset) -> None:
    tables = root_tables(case, result)
    assert [one["torque_nm"] for one in tables] == [10.0, 50.0]
    gear = tables[1]["gears"]["driver"]
    from gearbench.geometry import pair

    meshing = pair(case.rig)
    iso = root_stress(case.rig, meshing, "driver", 50.0 / meshing.driver.base_radius).stress
    assert gear["sigma_f0_mpa"] == pytest.approx(1e-6 * iso)
    assert (gear["largest_mpa"], gear["radius_mm"], gear["outer_point_mpa"]) == pytest.approx((23.0, 60.0, 30.0))
    assert gear["tangent_deg"] == pytest.approx(30.0)
    lines = root_lines(tables[1])
    assert lines[0].split() == ["root", "stress", "at", "50", "N", "m", "driver", "driven"]
    assert lines[1].split()[-2:] == ["23.0", "46.0"] and lines[6].split()[-2] == f"{1e-6 * iso:.1f}"
    assert all(line.startswith("  note: ") for line in lines[7:]) and len(lines) == 9
    assert root_tables(case, result.drop_vars("root_stress_tooth")) == []


def test_history_of_a_tooth(result: xr.Dataset) -> None:
    """Tooth n is where tooth 0 was n cycles before."""
    phase, stress = tooth_history(result, "driver", 0)
    np.testing.assert_allclose(phase, np.arange(-4, 8) / 4)
    found = result["root_stress_driver"].values[0]
    np.testing.assert_array_equal(stress[:4], found[:, 2])
    np.testing.assert_array_equal(stress[-4:], found[:, 0])


def test_picture_of_root_stress(tmp_path: Path, result: xr.Dataset) -> None:
    plot_root_stress(result, tmp_path / "root.svg", {"driver": 40.0})
    text = (tmp_path / "root.svg").read_text(encoding="utf-8")
    for label in ("Tension in the tooth root at 50 N m", "driven gear, finite elements", "driver, ISO 6336-3 sigma_F0"):
        assert label in text
    assert "driven gear, ISO" not in text


@pytest.mark.parametrize(
    ("value", "limit"), [(1.0, 1.0), (1.01, 1.25), (686.0, 800.0), (0.31, 0.4), (9e4, 1e5), (0.0, 1e-3), (-2.0, 1e-3)]
)
def test_limits_of_colours_read_well(value: float, limit: float) -> None:
    assert rounded_up(value) == pytest.approx(limit, rel=1e-12)


@pytest.fixture
def fields() -> PairFields:
    """A square of two triangles around a contact, stress growing with x to 1.7 MPa, and 90 MPa at the contact."""
    x, y = (values.ravel() for values in np.meshgrid([-1e-3, 0.0, 1e-3], [-1e-3, 0.0, 1e-3]))
    xx = np.where(np.hypot(x, y) < 1e-6, 90e6, 1.7e9 * x)
    zero, none = np.zeros(9), np.zeros(2, dtype=np.int64)
    return PairFields(
        mesh=PairMesh(np.column_stack([x, y]), np.array([[0, 2, 8, 1, 5, 4], [0, 8, 6, 4, 7, 3]]), none, none),
        displacement=np.zeros((9, 2)),
        stress=np.column_stack([xx, zero, zero]),
        out_of_plane=zero,
        contacts=(Contact(np.zeros(2), 2e-4),),
        phase=0.25,
        torque=12.0,
        dte=1e-6,
    )


def test_colours_reach_to_the_stress_beside_the_contact(fields: PairFields) -> None:
    assert limits(fields, 1e-3) == pytest.approx((2.0, 2.0))


def test_picture_of_fields_without_pyvista(tmp_path: Path, fields: PairFields) -> None:
    plot_fields(fields, 1e-3, tmp_path / "fields.svg")
    text = (tmp_path / "fields.svg").read_text(encoding="utf-8")
    for words in ("mesh phase 0.25, driver torque 12 N m", "von Mises stress [MPa]", "largest principal stress [MPa]"):
        assert words in text
    for tick in ("0.8", "1.2", "-0.4"):  # fifths of the limits, and one below zero
        assert f">{tick}</text>" in text.replace("\N{MINUS SIGN}", "-")

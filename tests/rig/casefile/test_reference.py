"""The reference case and the schema name every key; the shipped cases are valid."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from gearbench.cases import case_files, case_path
from gearbench.rig import Case, CaseError, Support, dump_case, read_case
from gearbench.rig.casefile.reader import table_type
from gearbench.rig.casefile.reference import reference_text
from gearbench.rig.casefile.schema import case_schema
from gearbench.rig.value import Value, fields_of


def all_keys(model: type[Value] = Case, path: str = "") -> list[str]:
    keys: list[str] = []
    for key, (_, info) in fields_of(model).items():
        inner = table_type(info)
        keys += [f"{path}{key}"] if inner is None else all_keys(inner, f"{path}{key}.")
    return keys


def written_keys(text: str) -> list[str]:
    """Dotted keys of the settings in a case file, commented-out ones included."""
    table, keys = "", []
    body = text.partition("\n\n")[2]  # without the explanation on top
    for line in body.splitlines():
        bare = line.removeprefix("# ")
        if bare.startswith("["):
            table = bare.partition("]")[0].strip("[]") + "."
        elif " = " in bare.partition("#")[0]:
            keys.append(table + bare.partition(" = ")[0])
    return keys


def test_reference_lists_every_key_once() -> None:
    keys = [key for key in written_keys(reference_text()) if not key.startswith("condition.")]
    assert sorted(keys) == sorted(all_keys())


def test_reference_file_is_what_the_program_writes() -> None:
    assert case_path("reference").read_text(encoding="utf-8") == reference_text()


def test_reference_holds_the_defaults(tmp_path: Path) -> None:
    """Leaving out every key that has a default changes nothing."""
    lines = []
    for line in reference_text().splitlines():
        keep = not line.startswith("#") and ("=" not in line or "required" in line)
        alternatives = ("mesh_frequency_hz = 2.0", "amplitude_nm = 0.4", "stiffness_n_per_m = 6e6")
        if keep or line.startswith(alternatives):
            lines.append(line)
    bare = tmp_path / "bare.toml"
    bare.write_text("\n".join(lines))
    assert read_case(bare) == read_case(case_path("reference"))


@pytest.mark.parametrize("name", sorted(case_files()))
def test_shipped_cases_round_trip(name: str, tmp_path: Path) -> None:
    case = read_case(case_path(name))
    assert case.name == name
    copy = tmp_path / "copy.toml"
    copy.write_text(dump_case(case), encoding="utf-8")
    assert read_case(copy) == case.model_copy(update={"assumed": ()})  # what was assumed is written


@pytest.mark.parametrize(
    "gear", sorted((case_path("reference").parent / "gears").glob("*.toml")), ids=lambda p: p.stem
)
def test_gear_files_fit_into_a_case(gear: Path) -> None:
    case = read_case(case_path("reference"), [f"rig.driver='{gear}'"])
    assert case.rig.driver.teeth == tomllib.loads(gear.read_text())["teeth"]


def test_every_comment_carries_its_unit() -> None:
    for line in reference_text().splitlines():
        setting, hash_, note = line.removeprefix("# ").partition(" # ")
        key = setting.partition(" =")[0].strip()
        if hash_ and key.endswith("_mm"):
            assert "; mm" in note
        if hash_ and key.endswith("_n_per_m"):
            assert "; N/m" in note


def leaves(schema: dict[str, Any], path: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, entry in schema["properties"].items():
        inner = (
            entry
            if "properties" in entry
            else next((o for o in entry.get("oneOf", []) if "properties" in o), None)
        )
        if inner is None or "value" in inner["properties"]:
            found[f"{path}{key}"] = entry
        else:
            found |= leaves(inner, f"{path}{key}.")
    return found


def test_schema_names_every_key_with_unit_default_and_limits() -> None:
    found = leaves(case_schema())
    extra = {"condition", *all_keys(Support, "rig.support.")}
    assert set(found) - extra == set(all_keys())
    module = found["rig.driver.module_mm"]
    assert (
        module["unit"] == "mm"
        and module["oneOf"][0]["exclusiveMinimum"] == 0
        and module["oneOf"][0]["maximum"] == 100
    )
    assert found["rig.driver.tip_edge_radius_um"]["default"] == 50
    assert found["rig.driver.pressure_angle_deg"]["default"] == 20
    assert found["rig.material.state"]["enum"] == ["plane-stress", "plane-strain"]
    assert found["experiment.multisine.band_hz"]["minItems"] == 2
    assert all(entry.get("description") for entry in found.values())


def test_unknown_case_name_lists_the_names() -> None:
    with pytest.raises(KeyError, match="paper_fe"):
        case_path("papr_fe")
    with pytest.raises(CaseError, match="does not exist"):
        read_case("papr_fe.toml")

"""The contact model for CalculiX: complete, in mm, hub and flanks where they belong, nothing refused in silence."""

from __future__ import annotations

import re
from math import hypot
from typing import Any

import numpy as np
import pytest

from gearbench.bench.errors import BenchError
from gearbench.bench.export.calculix import ContactModel, contact_model
from gearbench.cases import case_path
from gearbench.geometry.export.calculix import deck_text, plane_strain_constants
from gearbench.geometry.mesh.quality import quality
from gearbench.rig import Case, Material, read_case

SMALL = [
    *(f"rig.{side}.{key}" for side in ("driver", "driven") for key in ("hub_radius_mm=12", "bore_radius_mm=8")),
    "rig.driver.teeth=20",
    "rig.driven.teeth=21",
    "simulation.modes=0",
    "simulation.element_size_um=700",
    "experiment.torque_mean_nm=50",
]


def case(*settings: str) -> Case:
    return read_case(case_path("paper_fe"), [*SMALL, *settings])


@pytest.fixture(scope="module")
def model() -> ContactModel:
    return contact_model(case(), 0.2, name="pair.toml")


def blocks(text: str, keyword: str) -> dict[str, list[str]]:
    """Data lines of each card that starts with `keyword`, by the whole card."""
    found: dict[str, list[str]] = {}
    rows: list[str] | None = None
    for line in text.splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            rows = found.setdefault(line, []) if line.startswith(keyword) else None
        elif rows is not None:
            rows.append(line)
    return found


def numbers(rows: list[str]) -> np.ndarray:
    return np.array([[float(x) for x in row.split(",") if x.strip()] for row in rows])


def test_both_gears_are_whole_and_sound(model: ContactModel) -> None:
    for gear, teeth, hub in zip(model.deck.gears, (20, 21), (12e-3, 12e-3), strict=True):
        mesh = gear.mesh
        found = quality(mesh)
        assert found.jacobian > 0.3 and np.degrees(found.angle) > 8
        assert mesh.teeth == teeth and found.nodes == len(mesh.points)
        assert np.allclose(np.hypot(*mesh.points[mesh.hub].T), hub, rtol=1e-12)
        # No two nodes at one place: sectors are joined, not laid side by side.
        assert len(np.unique(mesh.points.round(10), axis=0)) == len(mesh.points)
        from gearbench.geometry import gear_area, profile

        tooth = profile(getattr(case().rig, "driver" if teeth == 20 else "driven"))
        assert found.area == pytest.approx(gear_area(tooth)[0] - np.pi * hub**2, rel=1e-4)


def test_surfaces_face_each_other_across_the_line_of_action(model: ContactModel) -> None:
    text = deck_text(model.deck)
    nodes = {int(r[0]): r[1:3] for rows in blocks(text, "*NODE, NSET=N_").values() for r in numbers(rows)}
    cells = {
        int(r[0]): r[1:].astype(int) for rows in blocks(text, "*ELEMENT, TYPE=CPE6").values() for r in numbers(rows)
    }
    surfaces = blocks(text, "*SURFACE, NAME=")
    assert len(surfaces) == 2 * len(model.deck.touches) >= 2
    middles = {}
    for card, rows in surfaces.items():
        where = []
        for row in rows:
            element, side = row.split(", S")
            where.append(nodes[int(cells[int(element)][2 + int(side)])])
        middles[card.split("=")[1].split(",")[0]] = np.array(where)
    for k in range(len(model.deck.touches)):
        slave, master = middles[f"SLAVE{k}"], middles[f"MASTER{k}"]
        gaps = [min(hypot(*(one - two)) for two in master) for one in slave]
        # Before the driver turns the flanks just touch; closer than the finest element somewhere, never far apart.
        assert min(gaps) < 2e3 * model.deck.touches[k].size
        assert max(gaps) < 0.5


def test_the_driver_turns_and_the_hubs_are_rigid(model: ContactModel) -> None:
    text = deck_text(model.deck)
    rb = 20 * 1e-3 * np.cos(np.radians(20))
    assert model.deck.rotation == pytest.approx(model.dte / rb, rel=1e-12)
    turns = re.findall(r"^MOMENT_(\w+), 1, 1, (\S+)$", text, re.M)
    assert turns[0] == ("DRIVER", f"{model.deck.rotation:.12g}") and turns[1] == ("DRIVEN", "0")
    ties = re.findall(r"^(\d+), 2, 1\., (\d+), 1, (-\S+)$", text, re.M)
    assert len(ties) == sum(len(gear.mesh.hub) for gear in model.deck.gears)
    assert {float(radius) for *_, radius in ties} == {-12.0}
    assert all(len(x.strip()) <= 20 for line in text.splitlines() if line[:1].isdigit() for x in line.split(","))


def test_the_head_says_what_to_compare(model: ContactModel) -> None:
    head = [line for line in deck_text(model.deck).splitlines() if line.startswith("**")][:11]
    text = "\n".join(head)
    assert "pair.toml" in text and f"--dte-um {1e6 * model.dte:.9g}" in text and "mesh phase 0.2" in text
    assert model.torques[0] == pytest.approx(50.0, rel=1e-9) and "50000.0 N mm at the driver" in text


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_plane_strain_of_the_equivalent_material_is_plane_stress(poisson: float) -> None:
    material = Material(youngs_modulus=206e9, poisson=poisson, density=7800.0, state="plane-stress")
    e, nu = plane_strain_constants(material)
    # In plane strain the in-plane law has E/(1 - nu^2) and nu/(1 - nu).
    assert e / (1 - nu**2) == pytest.approx(206e3)
    assert nu / (1 - nu) == pytest.approx(poisson)


@pytest.mark.parametrize(
    ("settings", "options", "words"),
    [
        (["rig.driver.runout_um=5"], {}, "rig.driver.runout_um must have its neutral value"),
        ([], {"dte": 5e-6, "torque": 3.0}, "give one"),
        ([], {"torque": -1.0}, "torque = -1 N m must be greater than 0"),
        ([], {"phase": float("nan")}, "mesh phase = nan must be a number"),
    ],
)
def test_refusals(settings: list[str], options: dict[str, Any], words: str) -> None:
    with pytest.raises(BenchError, match=words):
        contact_model(case(*settings), **options)

"""Contact: a Hertz cylinder pair, and the stored CalculiX pairs."""

from __future__ import annotations

import json
from functools import cache
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.commands.house.checks import Check, NotRun
from gearbench.fem.contact.law import Law, elastic_pair, make_law
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.gear.body import condense
from gearbench.rig import Gear, Material, Rig, Support, Supports

STORED = Path(__file__).parent / "calculix" / "reference.json"


@cache
def calculix() -> list[tuple[str, Law, list[dict[str, Any]]]]:
    """Stored pairs: name, our law of the same pair, positions."""
    if not STORED.is_file():
        raise NotRun(f"{STORED.name} is missing")
    out = []
    for name, kept in json.loads(STORED.read_text(encoding="utf-8"))["pairs"].items():
        stored = kept["rig"]
        idle = Support(stiffness=1e8)
        rig = Rig(
            centre_distance=stored["centre_distance"],
            driver=Gear(**stored["driver"]),
            driven=Gear(**stored["driven"]),
            material=Material(**stored["material"]),
            support=Supports(driver=idle, driven=idle),
        )
        gears = [condense(gear, rig.material, modes=0) for gear in (rig.driver, rig.driven)]
        out.append((name, make_law(elastic_pair(rig), *gears, rig.material), kept["positions"]))
    return out


def against_calculix(corner: bool) -> float:
    """Largest relative difference of either torque at the positions with or without contact on tip edges or undercut
    corners."""
    worst = 0.0
    for _, law, positions in calculix():
        for position in positions:
            if (position["tip_corner"] or position.get("undercut_corner", False)) == corner:
                cycle = static_cycle(law, np.array([position["phase"]]), dte=[position["dte"]])
                for ours, key in (
                    (cycle.torque_driver, "torque_driver"),
                    (cycle.torque_driven, "torque_driven"),
                ):
                    worst = max(worst, abs(ours.item() / position[key] - 1))
    return worst


def hertz() -> float:
    """Half-width and peak pressure of two parallel cylinders, against Hertz (Johnson 1985, eqs. 4.43, 4.45)."""
    from gearbench.fem.contact.line import cell_edges, complementarity, log_integral

    modulus, width, r1, r2 = 206e9, 0.02, 0.012, 0.03
    radius, effective = r1 * r2 / (r1 + r2), modulus / 2
    worst = 0.0
    for force in (50.0, 2e3, 4e4):
        half = sqrt(4 * force * radius / (pi * effective * width))
        edges = cell_edges(-1.25 * half, 1.25 * half, 32)
        centres = 0.5 * (edges[1:] + edges[:-1])
        widths = np.diff(edges)
        matrix = np.array(
            [
                [
                    -2 / (pi * effective * width) * log_integral(edges[j] - c, edges[j + 1] - c) / widths[j]
                    for j in range(len(centres))
                ]
                for c in centres
            ]
        )
        q = complementarity(matrix, centres**2 / (2 * radius), force).force
        pressure = q / widths / width
        # For a semi-ellipse the second moment is b^2/4, whatever the cells.
        found = 2 * sqrt(float(np.sum(q * (centres**2 + widths**2 / 12)) / force))
        peak = 2 * force / (pi * half * width)
        worst = max(worst, abs(found / half - 1), abs(float(pressure.max()) / peak - 1))
    return worst


CHECKS = [
    Check(
        "calculix-line",
        "torque at given DTE against CalculiX, on the line of action",
        5e-3,
        "",
        lambda: against_calculix(False),
    ),
    Check(
        "calculix-corner",
        "torque at given DTE against CalculiX, at tip corners and undercut corners",
        1e-2,
        "",
        lambda: against_calculix(True),
    ),
    Check("hertz", "half-width and peak pressure of a cylinder pair", 5e-3, "", hertz),
]

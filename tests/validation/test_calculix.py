"""The contact law against CalculiX: torque at given transmission error, over the mesh cycle and both
handovers.

The reference is computed by calculix/make_reference.py with full rings of second-order triangles,
surface-to-surface contact and none of the code under test except the profile; here only its stored numbers
are read.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from gearbench.fem.contact.law import Law, make_law
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.gear.body import condense
from gearbench.geometry.pair.kinematics import pair
from gearbench.rig import Gear, Material, Rig, Support, Supports

pytestmark = pytest.mark.validation

REFERENCE = json.loads((Path(__file__).parent / "calculix" / "reference.json").read_text(encoding="utf-8"))
ON_LINE, AT_CORNER = 5e-3, 1e-2  # numbers to reach
POSITIONS = [(name, p) for name, kept in REFERENCE["pairs"].items() for p in kept["positions"]]
NAMED = pytest.mark.parametrize(
    ("name", "position"), POSITIONS, ids=[f"{name}:{p['phase']:+.3f}" for name, p in POSITIONS]
)


@pytest.fixture(scope="module")
def laws() -> dict[str, Law]:
    """The contact law of every stored pair."""
    found = {}
    for name, kept in REFERENCE["pairs"].items():
        stored = kept["rig"]
        idle = Support(stiffness=1e8)
        rig = Rig(
            centre_distance=stored["centre_distance"],
            driver=Gear(**stored["driver"]),
            driven=Gear(**stored["driven"]),
            material=Material(**stored["material"]),
            support=Supports(driver=idle, driven=idle),
        )
        gears = condense(rig.driver, rig.material), condense(rig.driven, rig.material)
        found[name] = make_law(pair(rig), *gears, rig.material)
    return found


def at_corner(position: dict) -> bool:
    """Whether a pair touches off the line of action: on a tip edge, or on the corner that ends an undercut flank."""
    return position["tip_corner"] or position.get("undercut_corner", False)


@NAMED
def test_torque_at_given_transmission_error(laws: dict[str, Law], name: str, position: dict) -> None:
    cycle = static_cycle(laws[name], np.array([position["phase"]]), dte=[position["dte"]])
    limit = AT_CORNER if at_corner(position) else ON_LINE
    assert cycle.torque_driver.item() == pytest.approx(position["torque_driver"], rel=limit)
    assert cycle.torque_driven.item() == pytest.approx(position["torque_driven"], rel=limit)


# The law's levers are rigid. In the reference the ratio departs from them with load (at -0.06 of z20-40 by
# 2.7e-3; at half the deflection by 0.8e-3), probably because force turns with the deformed surface: at a tip
# corner by about pressure / E. So these limits are what was found, rounded up; without the corner's lever the
# first one is exceeded.
RATIO = {"z62-62": 6e-4, "z20-40": 3e-3, "z16-48": 2.3e-3, "z25-33": 2.5e-3, "z31-13": 2.5e-3, "z11-38": 6.5e-3}


@NAMED
def test_corner_contact_changes_the_torque_ratio_as_in_the_reference(
    laws: dict[str, Law], name: str, position: dict
) -> None:
    """Off the line of action the levers differ; the ratio of torques shows it without the stiffness."""
    rig = REFERENCE["pairs"][name]["rig"]
    nominal = rig["driven"]["teeth"] / rig["driver"]["teeth"]
    cycle = static_cycle(laws[name], np.array([position["phase"]]), dte=[position["dte"]])
    ours = cycle.torque_driven.item() / cycle.torque_driver.item() / nominal
    theirs = position["torque_driven"] / position["torque_driver"] / nominal
    assert ours == pytest.approx(theirs, abs=RATIO[name])


def test_both_kinds_of_contact_and_both_handovers_are_covered() -> None:
    for kept in REFERENCE["pairs"].values():
        corners = [p["phase"] for p in kept["positions"] if at_corner(p)]
        assert len(kept["positions"]) >= 8
        assert min(corners) < 0 < max(corners)
        assert len(kept["positions"]) - len(corners) >= 3
    undercut = [p for p in REFERENCE["pairs"]["z11-38"]["positions"] if p["undercut_corner"]]
    assert len(undercut) >= 5 and not any(p["tip_corner"] for p in undercut)


@NAMED
def test_the_reference_is_in_equilibrium(name: str, position: dict) -> None:
    force = position["torque_driver"] / REFERENCE["pairs"][name]["rig"]["centre_distance"]
    assert position["force_residual"] < 1e-6 * force


CHECKS = [(name, c) for name, kept in REFERENCE["pairs"].items() for c in kept["convergence"]]


@pytest.mark.parametrize(("name", "check"), CHECKS, ids=[f"{name}:{k}" for k, (name, _) in enumerate(CHECKS)])
def test_the_reference_has_converged(name: str, check: dict) -> None:
    """Penalty, mesh, kind of element and geometric non-linearity move it by less than a third of what is to
    be reached."""
    where = check["phase"], check["dte"]
    (same,) = (p for p in REFERENCE["pairs"][name]["positions"] if (p["phase"], p["dte"]) == where)
    assert check["torque_driver"] == pytest.approx(same["torque_driver"], rel=ON_LINE / 3)

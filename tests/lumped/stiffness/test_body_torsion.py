"""Torsion of the gear body against the integral over its rings, and against what is left in series."""

from __future__ import annotations

from math import inf, pi

import numpy as np
import pytest
from scipy.integrate import quad

from gearbench.geometry import pair
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.stiffness.body_torsion import body_stiffness, without_body_torsion
from gearbench.lumped.stiffness.potential_energy import pair_stiffness
from gearbench.rig import Gear, Material, Rig, Support, Supports


def make_rig(hub: float) -> Rig:
    one = Gear(teeth=30, module=3e-3, face_width=0.02, hub_radius=hub)
    two = Gear(teeth=50, module=3e-3, face_width=0.025, hub_radius=0.03)
    support = Support(stiffness=1e8)
    return Rig(driver=one, driven=two, support=Supports(driver=support, driven=support))


def test_ring_by_ring() -> None:
    """Unit force at the base circle: shear stress in every ring, its shear turns the outside against the inside."""
    rig = make_rig(0.015)
    tooth = pair(rig).driver
    shear, width, torque = 206e9 / 2.6, 0.02, tooth.base_radius

    def twist(r: float) -> float:
        return torque / (2 * pi * r * r * width) / shear / r

    angle = quad(twist, 0.015, tooth.root_radius)[0]
    assert body_stiffness(rig.driver, tooth, Material()) == pytest.approx(1 / (angle * tooth.base_radius), rel=1e-9)
    strained = Material.model_validate({"state": "plane-strain"})
    assert body_stiffness(rig.driver, tooth, strained) == body_stiffness(rig.driver, tooth, Material())


def test_both_bodies_are_taken_off_in_series() -> None:
    rig = make_rig(0.015)
    meshing = pair(rig)
    teeth = np.array([2e8, 3e8])
    bodies = [
        body_stiffness(g, t, rig.material) for g, t in ((rig.driver, meshing.driver), (rig.driven, meshing.driven))
    ]
    whole = 1 / (1 / teeth + sum(1 / k for k in bodies))
    np.testing.assert_allclose(without_body_torsion(whole, rig, meshing), teeth, rtol=1e-12)
    with pytest.raises(LumpedError, match="must be below"):
        without_body_torsion(min(bodies), rig, meshing)


def test_ring_without_height_is_rigid() -> None:
    rig = make_rig(0.015)
    tooth = pair(rig).driver
    flat = rig.driver.model_copy(update={"hub_radius": tooth.root_radius})
    assert body_stiffness(flat, tooth, rig.material) == inf


def test_sainsot_s_foundation_contains_it() -> None:
    """From large to small hubs the potential energy method's compliance grows by the torsion, to a tenth."""
    support = Support(stiffness=1e8)
    found, torsion = [], []
    for ratio in (1.6, 5.0):
        gear = Gear(teeth=62, module=2e-3, face_width=0.02, hub_radius=59.5e-3 / ratio, tip_edge_radius=0.0)
        rig = Rig(driver=gear, driven=gear, support=Supports(driver=support, driven=support))
        meshing = pair(rig)
        found.append(1 / pair_stiffness(rig, meshing, meshing.rho_pitch[0])[0])
        torsion.append(2 / body_stiffness(gear, meshing.driver, rig.material))
    assert found[-1] - found[0] == pytest.approx(torsion[-1] - torsion[0], rel=0.1)
    assert torsion[-1] > 0.4 * found[-1]

"""Small gears, condensed once a session: z = 20 of 3 mm, meshed coarsely and kept with few modes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from gearbench.fem.contact.law import Law, elastic_pair
from gearbench.fem.contact.store import stored_law
from gearbench.fem.gear.body import CondensedGear
from gearbench.fem.gear.elasticity import PlaneModuli, assemble, plane_moduli
from gearbench.fem.gear.ring import Ring, make_ring
from gearbench.fem.gear.store import stored_gear
from gearbench.geometry.mesh.assembly import full_mesh
from gearbench.geometry.mesh.sector_mesh import sector_mesh
from gearbench.geometry.mesh.values import GearMesh, SectorMesh
from gearbench.geometry.pair.kinematics import Pair
from gearbench.geometry.tooth.profile import Profile, profile
from gearbench.rig import Gear, Material, Rig, Support, Supports

STEEL = Material()


def make_gear(teeth: int = 20, **changes: Any) -> Gear:
    data = {"module": 3e-3, "face_width": 0.02, "hub_radius": 0.35 * 3e-3 * teeth, "thinning": 40e-6}
    return Gear(teeth=teeth, **{**data, **changes})


def make_rig(driver: Gear, driven: Gear, **changes: Any) -> Rig:
    support = Support(stiffness=2e8)
    return Rig(driver=driver, driven=driven, support=Supports(driver=support, driven=support), **changes)


@dataclass(frozen=True)
class Coarse:
    """A coarse ring and the same gear as one mesh, both of unit thickness and unit density."""

    gear: Gear
    shape: Profile
    moduli: PlaneModuli
    sector: SectorMesh
    ring: Ring
    full: GearMesh
    stiffness: csr_matrix
    mass: csr_matrix


@dataclass(frozen=True)
class Elastic:
    """A rig with its condensed gears and contact law."""

    rig: Rig
    pair: Pair
    gears: tuple[CondensedGear, CondensedGear]
    law: Law


SIZE, MODES = 0.5e-3, 4


def solve_elastic(rig: Rig) -> Elastic:
    """From disk where the same sources have made it before."""
    one, two = (stored_gear(gear, rig.material, SIZE, MODES) for gear in (rig.driver, rig.driven))
    return Elastic(rig, elastic_pair(rig), (one, two), stored_law(rig, (one, two), SIZE, MODES))


@pytest.fixture(scope="session")
def gear() -> Callable[..., Gear]:
    return make_gear


@pytest.fixture(scope="session")
def rig() -> Callable[..., Rig]:
    return make_rig


@pytest.fixture(scope="session")
def coarse() -> Coarse:
    gear = make_gear()
    shape = profile(gear)
    moduli = plane_moduli(STEEL)
    sector = sector_mesh(shape, gear, gear.module / 3)
    ring = make_ring(sector, *assemble(sector, moduli))
    full = full_mesh(sector)
    return Coarse(gear, shape, moduli, sector, ring, full, *assemble(full, moduli))


@pytest.fixture(scope="session")
def small() -> CondensedGear:
    """z = 20, plane stress, four modes."""
    return stored_gear(make_gear(), STEEL, SIZE, MODES)


@pytest.fixture(scope="session")
def twins() -> Elastic:
    """Two equal gears of 20 teeth without backlash but for their thinning."""
    return solve_elastic(make_rig(make_gear(), make_gear(), centre_distance=0.06))


@pytest.fixture(scope="session")
def unequal() -> Elastic:
    """20 teeth drive 30."""
    return solve_elastic(make_rig(make_gear(), make_gear(30)))


@pytest.fixture(scope="session")
def rigid_motions() -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Translations in x and y and the rotation about the origin at points (n, 2): (2 n, 3)."""

    def motions(points: NDArray[np.float64]) -> NDArray[np.float64]:
        out = np.zeros((*points.shape, 3))
        out[:, 0, 0] = out[:, 1, 1] = 1.0
        out[:, 0, 2], out[:, 1, 2] = -points[:, 1], points[:, 0]
        return out.reshape(-1, 3)

    return motions

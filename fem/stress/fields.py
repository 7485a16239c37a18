"""Displacement and stress inside a gear under the pressures on its teeth.

As in `body.flank_kernels` the half-plane's field under the true pressure is separated exactly: what is left is regular
and is solved on the sectors' coarse mesh, so that the sum resolves contact stresses far below an element's size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.gear.elasticity import PlaneModuli, assemble, plane_moduli
from gearbench.fem.gear.flank import BoundaryQuadrature, boundary_quadrature
from gearbench.fem.gear.ring import Ring, make_ring, ring_response
from gearbench.fem.limits import rounded
from gearbench.fem.stress.pressure import Strips
from gearbench.fem.stress.recovery import Recovery, make_recovery, ring_stress
from gearbench.geometry.mesh.sector_mesh import sector_mesh
from gearbench.geometry.mesh.values import SectorMesh
from gearbench.geometry.tooth.fillet import rotation
from gearbench.geometry.tooth.profile import Profile, profile
from gearbench.rig import Gear, Material

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ElasticGear:
    """One gear's sector, ready to be loaded and looked into."""

    shape: Profile
    mesh: SectorMesh
    moduli: PlaneModuli
    ring: Ring
    quadrature: BoundaryQuadrature
    recovery: Recovery


@dataclass(frozen=True)
class GearField:
    """Fields of some sectors of a loaded gear.

    sectors: their numbers, counter-clockwise from tooth 0; displacement (k, n, 2) [m] and stress (k, n, 3) [Pa] xx, yy,
    xy: the regular part, in each sector's own frame; strips: the pressures, in the frame of tooth 0, whose half-plane
    field is the other part.
    """

    gear: ElasticGear
    sectors: tuple[int, ...]
    displacement: Array
    stress: Array
    strips: Strips

    def strips_in(self, sector: int) -> Strips:
        """The pressures seen from a sector's frame."""
        return self.strips.turned(rotation(-2 * pi * sector / self.gear.shape.teeth))


def elastic_gear(gear: Gear, material: Material, element_size: float | None = None) -> ElasticGear:
    """Mesh and factorise one sector; arguments as `body.condense`. Raises GeometryError."""
    gear = rounded(gear)
    shape = profile(gear)
    mesh = sector_mesh(shape, gear, element_size)
    moduli = plane_moduli(material)
    ring = make_ring(mesh, *assemble(mesh, moduli))
    quadrature = boundary_quadrature(shape, mesh)
    return ElasticGear(shape, mesh, moduli, ring, quadrature, make_recovery(mesh, moduli))


def regular_loads(gear: ElasticGear, strips: Strips, sector: int) -> tuple[Array, Array]:
    """Nodal forces (unknowns, 1) and hub displacements (hub unknowns, 1) of the regular part in a sector's frame."""
    own = strips.turned(rotation(-2 * pi * sector / gear.shape.teeth))
    traction = -own.traction(gear.quadrature.points, gear.quadrature.normals)
    hub = -own.displacement(gear.mesh.points[gear.mesh.hub], gear.moduli)
    return np.asarray(gear.quadrature.load @ traction.reshape(-1, 1)), hub.reshape(-1, 1)


def loaded_sectors(pressed: Sequence[int], teeth: int, reach: int | None) -> tuple[int, ...]:
    """The pressed sectors and `reach` more on either side, in order around the gear; None: all of them."""
    if reach is None or not pressed:
        return tuple(range(teeth))
    wanted = {(j + step) % teeth for j in pressed for step in range(-reach, reach + 1)}
    return tuple(sorted(wanted))


def gear_field(gear: ElasticGear, strips: Strips, sectors: Sequence[int]) -> GearField:
    """Solve the whole gear under `strips` (frame of tooth 0), hub held, and recover the given sectors."""
    teeth = gear.shape.teeth
    both = [regular_loads(gear, strips, j) for j in range(teeth)]
    forces, hub = (partial(lambda part, j: both[j][part], part) for part in (0, 1))
    wanted = np.asarray(sectors, dtype=np.int64)
    found = ring_response(gear.ring, forces, hub, wanted)[:, :, 0].reshape(len(wanted), -1, 2)
    stress = ring_stress(gear.recovery, gear.mesh, dict(zip(sectors, found, strict=True)))
    return GearField(gear, tuple(sectors), found, np.array([stress[j] for j in sectors]), strips)


def unloaded_field(gear: ElasticGear, sectors: Sequence[int]) -> GearField:
    """The field of sectors of a gear that nothing presses."""
    shape = (len(sectors), len(gear.mesh.points))
    none = Strips(*(np.zeros((0, 2)) for _ in range(3)), *(np.zeros(0) for _ in range(3)))
    return GearField(gear, tuple(sectors), np.zeros((*shape, 2)), np.zeros((*shape, 3)), none)

"""The full gear with a crack in one tooth: its sector has a mesh of its own, the slit open, between sound ones."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.mesh.cracked_sector import CrackedSector, cracked_sector
from gearbench.geometry.mesh.sector_mesh import SectorMesh, full_mesh, sector_mesh
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Nodes of two sectors on their common cut coincide to this part of their radius.
TOLERANCE = 1e-12


@dataclass(frozen=True)
class CrackedGearMesh:
    """A full gear: `points` (n, 2) [m], `triangles` (m, 6) as in SectorMesh, and the `sector` (m,) of each of them,
    counter-clockwise; along the crack the nodes of both its faces stand in the same places."""

    teeth: int
    points: Array
    triangles: Index
    sector: Index

    @property
    def cells(self) -> Index:
        """The elements, whatever their kind."""
        return self.triangles


def cracked_mesh(
    tooth: Profile, gear: Gear, element_size: float | None = None, *, order: int = 1, name: str = "gear"
) -> CrackedGearMesh:
    """Mesh a gear whose crack has a length. order: 1 where the case numbers the teeth counter-clockwise, -1 clockwise;
    `name`: the gear's key; `element_size` [m] as in `sector_mesh`. Raises GeometryError."""
    odd = cracked_sector(tooth, gear, element_size, name=name)
    assert gear.crack is not None
    return with_sector(sector_mesh(tooth, gear, element_size), odd, order * gear.crack.tooth % tooth.teeth)


def with_sector(sound: SectorMesh, odd: CrackedSector, place: int) -> CrackedGearMesh:
    """The gear of sound sectors whose sector number `place` is another one. Raises GeometryError where cuts differ."""
    for one, two in ((sound.cut_low, odd.cut_low), (sound.cut_high, odd.cut_high)):
        here, there = sound.points[one], odd.points[two]
        if here.shape != there.shape or np.abs(here - there).max() > TOLERANCE * np.abs(here).max():
            raise GeometryError("the cracked tooth's sector does not share the nodes of its neighbours' cuts")
    gear = full_mesh(sound)
    number = np.full(len(odd.points), -1, dtype=np.int64)
    number[odd.cut_low] = gear.node_of[place, sound.cut_low]
    number[odd.cut_high] = gear.node_of[place, sound.cut_high]
    new = np.flatnonzero(number < 0)
    number[new] = len(gear.points) + np.arange(len(new))
    angle = 2 * pi * place / sound.teeth
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    points = np.concatenate((gear.points, odd.points[new] @ turn.T))
    parts = [gear.node_of[k][sound.triangles] if k != place else number[odd.triangles] for k in range(sound.teeth)]
    # The sound sector's own nodes are left over.
    used, triangles = np.unique(np.concatenate(parts), return_inverse=True)
    sector = np.repeat(np.arange(sound.teeth), [len(part) for part in parts])
    return CrackedGearMesh(sound.teeth, points[used], triangles.reshape(-1, 6), sector)

"""Whole gears of tooth sectors, each an exact rotation; neighbours share the nodes of their cuts.

The sectors need not be meshed alike: fine where teeth touch, coarse where they are far away, one of them cracked.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.mesh.values import GearMesh, SectorMesh
from gearbench.geometry.tooth.fillet import rotation

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Nodes of two sectors on their common cut coincide to this part of their radius.
TOLERANCE = 1e-12


def full_mesh(sector: SectorMesh) -> GearMesh:
    """The gear all of whose teeth are meshed like this one."""
    return assembled([sector] * sector.teeth)


def assembled(sectors: Sequence[SectorMesh]) -> GearMesh:
    """The gear of one sector per tooth, in the order of their polar angle.

    Raises GeometryError for another number of sectors than of teeth, and where neighbouring cuts do not match.
    """
    teeth = len(sectors)
    node_of: list[Index] = []
    points, total = [], 0
    for k, sector in enumerate(sectors):
        if sector.teeth != teeth:
            raise GeometryError(f"teeth = {teeth} cannot be made of sectors of a gear with {sector.teeth} teeth")
        kept = np.setdiff1d(np.arange(len(sector.points)), sector.cut_high)
        numbers = np.full(len(sector.points), -1, dtype=np.int64)
        numbers[kept] = total + np.arange(len(kept))
        total += len(kept)
        node_of.append(numbers)
        points.append(sector.points[kept] @ rotation(2 * pi * k / teeth).T)
    for k, sector in enumerate(sectors):
        following = sectors[(k + 1) % teeth]
        _check_cut(sector, following, k)
        node_of[k][sector.cut_high] = node_of[(k + 1) % teeth][following.cut_low]
    return _gear(np.concatenate(points), sectors, node_of)


def with_sector(sound: SectorMesh, odd: SectorMesh, place: int) -> GearMesh:
    """The gear of sound sectors whose sector number `place` is another one; its own nodes come last.

    Raises GeometryError where the cuts differ.
    """
    for one, two in ((sound.cut_low, odd.cut_low), (sound.cut_high, odd.cut_high)):
        here, there = sound.points[one], odd.points[two]
        if here.shape != there.shape or np.abs(here - there).max() > TOLERANCE * np.abs(here).max():
            raise GeometryError(f"sector {place} does not share the nodes of its neighbours' cuts")
    gear = full_mesh(sound)
    number = np.full(len(odd.points), -1, dtype=np.int64)
    number[odd.cut_low] = gear.node_of[place][sound.cut_low]
    number[odd.cut_high] = gear.node_of[place][sound.cut_high]
    new = np.flatnonzero(number < 0)
    number[new] = len(gear.points) + np.arange(len(new))
    points = np.concatenate((gear.points, odd.points[new] @ rotation(2 * pi * place / sound.teeth).T))
    sectors = [odd if k == place else sound for k in range(sound.teeth)]
    node_of = [number if k == place else gear.node_of[k] for k in range(sound.teeth)]
    used = np.unique(np.concatenate(node_of))  # the sound sector's own nodes are left over
    return _gear(points[used], sectors, [np.searchsorted(used, numbers) for numbers in node_of])


def outline_sides(gear: GearMesh, number: int) -> Index:
    """Element and its side (e, 2) along the counter-clockwise half of the outline of sector `number`, from the middle
    of the tip to that of the root."""
    own = np.flatnonzero(gear.sector == number)
    place = {int(node): (int(cell), side) for cell in own for side, node in enumerate(gear.middles[cell])}
    edges = gear.outlines[number]
    return np.array([place[int(middle)] for middle in edges[len(edges) // 2 :, 2]], dtype=np.int64)


def _gear(points: Array, sectors: Sequence[SectorMesh], node_of: Sequence[Index]) -> GearMesh:
    """The gear whose sectors' nodes have these numbers among its points."""
    both = list(zip(node_of, sectors, strict=True))
    return GearMesh(
        points=points,
        cells=np.concatenate([numbers[sector.cells] for numbers, sector in both]),
        sector=np.repeat(np.arange(len(sectors)), [len(sector.cells) for sector in sectors]),
        hub=np.unique(np.concatenate([numbers[sector.hub] for numbers, sector in both])),
        outlines=tuple(numbers[sector.boundary_edges] for numbers, sector in both),
        node_of=tuple(node_of),
    )


def _check_cut(sector: SectorMesh, following: SectorMesh, number: int) -> None:
    one, two = (np.hypot(*s.points[cut].T) for s, cut in ((sector, sector.cut_high), (following, following.cut_low)))
    if len(one) != len(two) or np.abs(one - two).max() > TOLERANCE * one.max():
        raise GeometryError(f"sector {number} and the next one do not share the nodes of their cut")

"""Fields of a pair at a chosen mesh phase: displacement and stress of both gears, in the world's frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from math import floor, pi
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import ElasticRig
from gearbench.bench.errors import BenchError
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.stress.fields import ElasticGear, GearField, elastic_gear, gear_field, loaded_sectors, unloaded_field
from gearbench.fem.stress.loaded import PairLoad, Pressed, all_strips, pair_loads, pressed_teeth
from gearbench.fem.stress.pressure import Strips
from gearbench.fem.stress.recovery import principal, rotated, turn_stress, von_mises
from gearbench.fem.stress.zoom import divided
from gearbench.files import write_whole
from gearbench.geometry.mesh.values import PairMesh, joined
from gearbench.geometry.pair.numbering import sector_of
from gearbench.rig import Rig

Array = NDArray[np.float64]

REACH = 2  # sectors shown on either side of the loaded teeth
FINEST = 0.2  # of the half-width of contact: elements there
GROWTH = 0.35  # of element size per distance from there


@dataclass(frozen=True)
class Contact:
    """Middle (2,) [m] of a contact, its half-width [m], and the force (2,) [N] on the driver."""

    middle: Array
    half_width: float
    force: Array = field(default_factory=lambda: np.zeros(2))


@dataclass(frozen=True)
class PairFields:
    """Both gears at a mesh phase, in the frame of the rig: driver's centre at the origin, driven gear's at +x.

    mesh: quadratic triangles of the undeformed gears, the driver turned by its DTE; displacement (n, 2) [m]: elastic,
    relative to the hubs; stress (n, 3) [Pa]: xx, yy, xy; out_of_plane (n,) [Pa]; contacts; phase [cycles], torque [N m]
    and dte [m].
    """

    mesh: PairMesh
    displacement: Array
    stress: Array
    out_of_plane: Array
    contacts: tuple[Contact, ...]
    phase: float
    torque: float
    dte: float

    @property
    def von_mises(self) -> Array:
        """Von Mises stress (n,) [Pa]."""
        return von_mises(self.stress, self.out_of_plane)

    @property
    def principal(self) -> Array:
        """Principal stresses in the plane (n, 2) [Pa], the larger one first."""
        return principal(self.stress)


def refuse_cracks(rig: Rig) -> None:
    """Fields are those of a sound gear's sectors. Raises BenchError."""
    for side in ("driver", "driven"):
        if getattr(rig, side).crack is not None:
            raise BenchError(f"stress fields do not represent rig.{side}.crack: leave it out")


def stress_gears(elastic: ElasticRig, element_size: float | None = None) -> tuple[ElasticGear, ElasticGear]:
    """Both gears of the rig, ready for `pair_fields`."""
    rig = elastic.rig
    driver = elastic_gear(rig.driver, rig.material, element_size)
    return driver, driver if rig.driven == rig.driver else elastic_gear(rig.driven, rig.material, element_size)


def field_dte(elastic: ElasticRig, phase: float, load: float, unit: str) -> float:
    """DTE [m] at a mesh phase under a load, a driver torque [N m] or itself a DTE [m]. Raises ContactError."""
    torque, dte = ([load], None) if unit == "N m" else (None, [load])
    return float(static_cycle(elastic.law, np.array([phase]), torque=torque, dte=dte).transmission_error[0, 0])


def pair_fields(
    elastic: ElasticRig, gears: tuple[ElasticGear, ElasticGear], phase: float, dte: float, reach: int | None = REACH
) -> PairFields:
    """Fields at a mesh phase [cycles] and the DTE [m] of the static solution there.

    reach: sectors on either side of the loaded ones, None: the whole gears. Raises BenchError where nothing touches.
    """
    law = elastic.law
    pairs = pair_loads(law, phase, dte)
    if not pairs:
        raise BenchError(f"no stress at mesh phase {phase:g}: a DTE of {1e6 * dte:.4g} um closes no tooth pair")
    theta = phase * law.driver.pitch + dte / law.driver.rb, phase * law.driven.pitch
    centres = np.array([[0.0, 0.0], [law.centre, 0.0]])
    return fields_at(elastic, gears, Stand(theta, centres, tuple(pairs), phase, dte), reach)


@dataclass(frozen=True)
class Stand:
    """Where a pair stands and what presses: angles [rad] of driver and driven gear, each in its own direction, their
    centres (2, 2) [m], the loaded tooth pairs, mesh phase [cycles] and DTE [m]."""

    theta: tuple[float, float]
    centres: Array
    pairs: tuple[PairLoad, ...]
    phase: float
    dte: float


def fields_at(
    elastic: ElasticRig, gears: tuple[ElasticGear, ElasticGear], stand: Stand, reach: int | None = REACH
) -> PairFields:
    """Fields of both gears in a stand; `reach` as in `pair_fields`. Where nothing is loaded they are zero, on the teeth
    around the pitch point."""
    law, meshing = elastic.law, elastic.pair
    angles = law.driver.zero + stand.theta[0], pi + law.driven.zero - stand.theta[1]
    parts = []
    for number, pressed in enumerate(pressed_teeth(law, (meshing.driver, meshing.driven), stand.pairs)):
        gear, teeth = gears[number], gears[number].shape.teeth
        if pressed:
            sectors = loaded_sectors([p.sector for p in pressed], teeth, reach)
            found = gear_field(gear, all_strips(teeth, pressed), sectors)
        else:
            middle = sector_of(floor(stand.phase + 0.5), number, teeth)
            found = unloaded_field(gear, loaded_sectors([middle], teeth, reach))
        parts.append(_placed(found, pressed, number, angles[number], stand.centres[number]))
    width = elastic.rig.driver.face_width
    contacts = tuple(replace(one, force=width * one.force) for one in parts[0].contacts)
    strain = elastic.rig.material.poisson if elastic.rig.material.state == "plane-strain" else 0.0
    stress = np.concatenate([part.stress for part in parts])
    return PairFields(
        mesh=joined([part.mesh for part in parts]),
        displacement=np.concatenate([part.displacement for part in parts]),
        stress=stress,
        out_of_plane=strain * (stress[:, 0] + stress[:, 1]),
        contacts=contacts,
        phase=stand.phase,
        torque=float(sum((1 - 2 * p.side) * p.force * p.contact.lever1 for p in stand.pairs)),
        dte=stand.dte,
    )


@dataclass(frozen=True)
class _Part:
    """One gear's share of `PairFields`."""

    mesh: PairMesh
    displacement: Array
    stress: Array
    contacts: tuple[Contact, ...]


def _placed(found: GearField, pressed: Sequence[Pressed], number: int, angle: float, centre: Array) -> _Part:
    """Regular and half-plane part together, elements divided near the contacts, turned into the world."""
    teeth, mesh = found.gear.shape.teeth, found.gear.mesh
    points, triangles, tooth, moved, stress, contacts = [], [], [], [], [], []
    count = 0
    for sector, u, regular in zip(found.sectors, found.displacement, found.stress, strict=True):
        own = [_spot(p.strips) for p in pressed if p.sector == sector]
        cells, values = divided(mesh.cells, np.hstack([mesh.points, u, regular]), _size(own))
        strips, turn = found.strips_in(sector), angle + 2 * pi * sector / teeth
        x = values[:, :2]
        points.append(centre + rotated(x, turn))
        moved.append(rotated(values[:, 2:4] + strips.displacement(x, found.gear.moduli), turn))
        stress.append(turn_stress(values[:, 4:] + strips.stress(x), turn))
        triangles.append(count + cells)
        tooth.append(np.full(len(cells), sector_of(sector, number, teeth)))
        contacts += [
            Contact(centre + rotated(one.middle, turn), one.half_width, rotated(one.force, turn)) for one in own
        ]
        count += len(x)
    cells = np.concatenate(triangles)
    return _Part(
        PairMesh(np.concatenate(points), cells, np.full(len(cells), number), np.concatenate(tooth)),
        np.concatenate(moved),
        np.concatenate(stress),
        tuple(contacts),
    )


def _spot(strips: Strips) -> Contact:
    """Middle of the pressure, half of the width of its strips, and their force per unit thickness."""
    force = strips.half * strips.mean
    return Contact(force @ strips.middle / force.sum(), float(strips.half.sum()), strips.force)


def _size(contacts: Sequence[Contact]) -> Callable[[Array], Array]:
    """Largest element at points (n, 2) [m] of a tooth with the given contacts."""

    def size(points: Array) -> Array:
        out = np.full(len(points), np.inf)
        for one in contacts:
            away = np.maximum(np.hypot(*(points - one.middle).T) - one.half_width, 0.0)
            out = np.minimum(out, FINEST * one.half_width + GROWTH * away)
        return out

    return size


def write_fields(path: Path, fields: PairFields) -> Path:
    """Write a .vtu file for ParaView: m and Pa; `stress` in the order xx, yy, zz, xy, yz, xz."""
    import meshio

    mesh = fields.mesh
    zero = np.zeros(len(mesh.points))
    xx, yy, xy = fields.stress.T
    largest, least = fields.principal.T
    content = meshio.Mesh(
        np.column_stack([mesh.points, zero]),
        [(mesh.kind.name, mesh.cells)],
        point_data={
            "displacement": np.column_stack([fields.displacement, zero]).astype(np.float32),
            "stress": np.column_stack([xx, yy, fields.out_of_plane, xy, zero, zero]).astype(np.float32),
            "von_mises": fields.von_mises.astype(np.float32),
            "principal_1": largest.astype(np.float32),
            "principal_2": least.astype(np.float32),
        },
        cell_data={"gear": [mesh.gear.astype(np.int32)], "tooth": [mesh.tooth.astype(np.int32)]},
    )
    return write_whole(path, lambda name: meshio.write(str(name), content, file_format="vtu"))

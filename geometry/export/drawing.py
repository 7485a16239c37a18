"""Outlines of gears as drawings: .dxf (AutoCAD R12, lines, arcs and circles in mm) and .step (solids, in mm)."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from math import ceil, pi
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.files import write_whole
from gearbench.geometry.mesh.filling import gmsh_session
from gearbench.geometry.pair.kinematics import Pair, pair
from gearbench.geometry.tooth.outline import Segment, half_outline
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Rig

Array = NDArray[np.float64]

# Lines replace involutes and fillets to this error [m].
CHORD = 0.2e-6
# Points of a spline in a .step file, per piece.
KNOTS = 33


class Placed(NamedTuple):
    """A gear in the world: profile, angle of tooth 0 [rad], x of the centre, hub and bore radius, width [m]."""

    name: str
    tooth: Profile
    angle: float
    centre: float
    hub: float
    bore: float
    width: float


def placed_gears(rig: Rig, meshing: Pair | None = None) -> tuple[Placed, Placed]:
    """Both gears at mesh phase 0: teeth 0 touch at the pitch point, unloaded."""
    meshing = meshing or pair(rig)
    one, two = rig.driver, rig.driven
    angles = meshing.driver_angle, pi + meshing.driven_angle
    return (
        Placed("DRIVER", meshing.driver, angles[0], 0.0, one.hub_radius, one.bore_radius, one.face_width),
        Placed(
            "DRIVEN",
            meshing.driven,
            angles[1],
            meshing.centre_distance,
            two.hub_radius,
            two.bore_radius,
            two.face_width,
        ),
    )


def _turned(points: Array, gear: Placed, angle: float) -> Array:
    """Points in the gear's frame, turned by a tooth's angle and put into the world."""
    c, s = np.cos(gear.angle + angle), np.sin(gear.angle + angle)
    return points @ np.array([[c, s], [-s, c]]) + np.array([gear.centre, 0.0])


def _fine(piece: Segment) -> Array:
    """Arc lengths on a piece between which chords keep to CHORD: sagitta h^2 curvature/8."""
    t = piece.samples
    step = np.sqrt(8 * CHORD / np.maximum(piece.curvature(t), 1.0))
    count = np.concatenate(([0.0], np.cumsum(np.diff(t) * 0.5 * (1 / step[1:] + 1 / step[:-1]))))
    return np.interp(np.linspace(0.0, count[-1], max(2, ceil(count[-1]) + 1)), count, t)


def tooth_outline(tooth: Profile) -> Array:
    """Outline (n, 2) of one tooth from the middle of one space to that of the next, counter-clockwise, without its
    last point: lines between the points keep to CHORD."""
    half = [piece.points(_fine(piece)) for piece in half_outline(tooth)]
    upper = np.concatenate([half[0], *(points[1:] for points in half[1:])])
    return np.concatenate((upper[::-1] * [1.0, -1.0], upper[1:]))[:-1]


def gear_outline(gear: Placed) -> Array:
    """Closed outline (n, 2) of a placed gear, every tooth the first one turned; the first point is not repeated."""
    single = tooth_outline(gear.tooth)
    angles = gear.tooth.pitch_angle * np.arange(gear.tooth.teeth)
    return np.concatenate([_turned(single, gear, angle) for angle in angles])


def _groups(pairs: Iterable[tuple[int, object]]) -> str:
    return "".join(f"{code}\n{value}\n" for code, value in pairs)


def _number(metres: float) -> str:
    return f"{1e3 * metres:.9f}"


def _dxf_gear(gear: Placed) -> Iterator[str]:
    yield _groups([(0, "POLYLINE"), (8, gear.name), (66, 1), (70, 1), (10, 0), (20, 0), (30, 0)])
    for x, y in gear_outline(gear):
        yield _groups([(0, "VERTEX"), (8, gear.name), (10, _number(x)), (20, _number(y)), (30, 0)])
    yield _groups([(0, "SEQEND"), (8, gear.name)])
    circles = {"HUB": gear.hub, "BORE": gear.bore, "PITCH": gear.tooth.reference_radius, "BASE": gear.tooth.base_radius}
    for name, radius in circles.items():
        if radius > 0.0:
            where = [(8, f"{gear.name}_{name}"), (10, _number(gear.centre)), (20, 0), (30, 0), (40, _number(radius))]
            yield _groups([(0, "CIRCLE"), *where])


def write_dxf(path: Path, gears: Iterable[Placed]) -> Path:
    """Outlines as closed polylines, hub, bore, reference and base circles as circles, on layers of their own; mm."""

    def write(target: Path) -> None:
        with target.open("w", encoding="ascii") as file:
            file.write(_groups([(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"), (0, "ENDSEC")]))
            file.write(_groups([(0, "SECTION"), (2, "ENTITIES")]))
            for gear in gears:
                file.writelines(_dxf_gear(gear))
            file.write(_groups([(0, "ENDSEC"), (0, "EOF")]))

    return write_whole(path, write)


def _step_gear(occ: Any, gear: Placed) -> None:
    """A gear's solid: splines through points of each smooth piece, extruded by the face width about z = 0."""
    pieces = half_outline(gear.tooth)
    chains = [piece.points(np.linspace(0.0, piece.length, KNOTS)) for piece in pieces]
    mirrored = [chain[::-1] * [1.0, -1.0] for chain in chains[::-1]]
    bottom = -0.5e3 * gear.width
    curves, first, last = [], 0, 0
    for k in range(gear.tooth.teeth):
        for chain in (*mirrored, *chains):
            points = 1e3 * _turned(chain, gear, k * gear.tooth.pitch_angle)
            start = last or occ.addPoint(*points[0], bottom)
            first = first or start
            closing = k == gear.tooth.teeth - 1 and chain is chains[-1]
            last = first if closing else occ.addPoint(*points[-1], bottom)
            inner = [occ.addPoint(x, y, bottom) for x, y in points[1:-1]]
            curves.append(occ.addSpline([start, *inner, last]))
    loops = [occ.addCurveLoop(curves)]
    if gear.bore > 0.0:
        loops.append(occ.addCurveLoop([occ.addCircle(1e3 * gear.centre, 0.0, bottom, 1e3 * gear.bore)]))
    occ.extrude([(2, occ.addPlaneSurface(loops))], 0.0, 0.0, 1e3 * gear.width)


@contextmanager
def _silent() -> Iterator[None]:
    """Keep what a library prints past Python (OpenCASCADE's statistics) from the standard output."""
    sys.stdout.flush()
    kept, void = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(void, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(void)


def _write(gmsh: Any, target: Path) -> None:
    """Raises OSError: gmsh tells a full disk, as any failure of writing, by a plain Exception."""
    try:
        gmsh.write(str(target))
    except Exception as error:
        raise OSError("its contents could not be written; is the disk full?") from error


def write_step(path: Path, gears: Iterable[Placed]) -> Path:
    """Both gears as solids, in mm. Raises MeshingUnavailable without gmsh."""

    def write(target: Path) -> None:
        with gmsh_session() as gmsh:
            gmsh.model.add("gearbench drawing")
            try:
                for gear in gears:
                    _step_gear(gmsh.model.occ, gear)
                gmsh.model.occ.synchronize()
                with _silent():
                    _write(gmsh, target)
            finally:
                gmsh.model.remove()

    return write_whole(path, write)

"""What presses on each gear in a static position: the contact lines' pressures as strips on the flanks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.curve import Curves
from gearbench.fem.contact.kinematics import CORNER1, EDGE1, EDGE2, ON_LINE, Contact
from gearbench.fem.contact.law import PAIRS, Law, contact_in
from gearbench.fem.contact.line import gap_to_master, line_contact, touching_point
from gearbench.fem.contact.static import ContactError, position
from gearbench.fem.gear.flank import MIRROR
from gearbench.fem.stress.pressure import Strips
from gearbench.geometry.pair.numbering import sector_of
from gearbench.geometry.tooth.fillet import rotation
from gearbench.geometry.tooth.profile import Profile

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PairLoad:
    """One loaded tooth pair: side (0 working, 1 back flanks), driver tooth, contact and force [N]."""

    side: int
    tooth: int
    contact: Contact
    force: float

    def sector(self, gear: int, teeth: int) -> int:
        """Number of the gear's loaded sector (0: driver, 1: driven), counted counter-clockwise from tooth 0."""
        return sector_of(self.tooth + (self.side if gear else 0), gear, teeth)


@dataclass(frozen=True)
class Pressed:
    """Strips on one tooth, in that tooth's frame, and the sector it is in."""

    sector: int
    strips: Strips


def pair_loads(law: Law, phase: float, dte: float) -> list[PairLoad]:
    """The loaded pairs at a mesh phase [cycles] and DTE [m], hub centres held. Raises ContactError."""
    theta1 = phase * law.driver.pitch + dte / law.driver.rb
    found = position(law, theta1, phase * law.driven.pitch, 0.0, 0.0, 0.0, 0.0, np.zeros(PAIRS))
    if not found.converged:
        raise ContactError(f"no static equilibrium at mesh phase {phase:g} and DTE {dte:g} m")
    return [
        PairLoad(int(pair["side"]), int(pair["tooth"]), contact_in(found.pairs, p), float(force))
        for p, (pair, force) in enumerate(zip(found.pairs, found.force, strict=True))
        if found.active[p] and force > 0.0
    ]


def driver_is_slave(curves: Curves, k: Contact) -> bool:
    """Whether the contact line runs on the driver's flank, as it mostly does in `curve.lone_approach`."""
    corner1, corner2 = curves.driver.corner, curves.driven.corner
    if (corner1 >= 0.0) != (corner2 >= 0.0):
        return corner1 >= 0.0
    if k.slave != ON_LINE:
        return k.slave in (EDGE1, CORNER1)
    if corner1 >= 0.0:
        return k.xi1 - corner1 <= k.xi2 - corner2
    return curves.end1 - k.xi1 <= curves.end2 - k.xi2


def _line(law: Law, k: Contact, force: float) -> tuple[bool, Array, Array, Array]:
    """Whether the driver is the slave; edges of the cells on slave and master flank (n + 1,) [m], forces (n,) [N]."""
    first = driver_is_slave(law.curves, k)
    own, mate = (law.driver, law.driven) if first else (law.driven, law.driver)
    ks, km = (law.k1, law.k2) if first else (law.k2, law.k1)
    xi, curve, other = (k.xi1, law.curves.driver, EDGE2) if first else (k.xi2, law.curves.driven, EDGE1)
    if k.slave == other and curve.corner >= 0.0:
        xi = float(curve.xi[0])
    line = line_contact(own, mate, ks, km, law.half_plane, law.centre, xi, force)
    c = touching_point(own, mate, xi, law.centre).angle
    feet = np.array([gap_to_master(own, mate, c, law.centre, s)[1] for s in line.edges])
    return first, line.edges, np.minimum(feet**2 / (2 * mate.rb), mate.s_tip), line.force


def _strips(shape: Profile, edges: Array, force: Array, side: int, thickness: float) -> Strips:
    """Loaded cells of one flank as strips. Pressure is linear within a cell, its mean from the cell's force."""
    s, width = 0.5 * (edges[1:] + edges[:-1]), np.abs(np.diff(edges))
    mean = force / (width * thickness)
    rise = np.gradient(mean, s)
    steepest = 2 * mean / width
    rise = np.clip(rise, -steepest, steepest)
    mirror = MIRROR if side else np.ones(2)
    loaded = force > 0.0
    space = np.array([np.cos(pi / shape.teeth), np.sin(pi / shape.teeth)])
    # The strip's own coordinate runs inwards on a working flank, outwards on a back flank.
    sign = 1.0 if side else -1.0
    return Strips(
        shape.points(s[loaded]) * mirror,
        -shape.normals(s[loaded]) * mirror,
        np.tile(space * mirror, (int(loaded.sum()), 1)),
        0.5 * width[loaded],
        mean[loaded],
        sign * rise[loaded],
    )


def pressed_teeth(
    law: Law, shapes: tuple[Profile, Profile], pairs: Sequence[PairLoad]
) -> tuple[list[Pressed], list[Pressed]]:
    """Pressures on driver and driven gear, per unit of each gear's own thickness.

    They are normal to the flanks, distributed as the contact line of the pair distributes them and scaled (by less
    than a percent, by nothing on the line of action of ideal flanks) so that their moment about the gear's axis is
    exactly the static solution's.
    """
    out: tuple[list[Pressed], list[Pressed]] = ([], [])
    for one in pairs:
        first, own, mate, q = _line(law, one.contact, one.force)
        lines = (own, mate) if first else (mate, own)
        for gear, (kernel, lever) in enumerate(((law.k1, one.contact.lever1), (law.k2, one.contact.lever2))):
            strips = _strips(shapes[gear], lines[gear], q, one.side, kernel.width)
            wanted = one.force * lever / kernel.width
            factor = wanted / abs(float(strips.moment.sum()))
            strips = strips.scaled(np.full(len(strips.half), factor))
            out[gear].append(Pressed(one.sector(gear, shapes[gear].teeth), strips))
    return out


def all_strips(teeth: int, pressed: Sequence[Pressed]) -> Strips:
    """All strips of a gear in the frame of its tooth 0. At least one tooth must be pressed."""
    parts = [p.strips.turned(rotation(2 * pi * p.sector / teeth)) for p in pressed]
    return Strips(*(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(Strips)))

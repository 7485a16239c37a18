"""The input of CalculiX (`ccx`) for the static contact of two plane gears: hubs rigid, driver turned, driven gear held.

Lengths in mm, forces in N, moments in N mm. Both gears are plane-strain elements of second order (CPE6). Plane stress
is computed as plane strain of a material with E (1 + 2 nu)/(1 + nu)^2 and nu/(1 + nu), which gives the same
displacements and in-plane stresses exactly (Timoshenko and Goodier, Theory of Elasticity, art. 17), where CPS6
elements, which CalculiX makes three-dimensional, would have to be much thinner than the gear.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.files import write_text
from gearbench.geometry.mesh.values import GearMesh
from gearbench.rig import Material

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Pressure per overclosure in units of Young's modulus over element size, one step each. Torque is linear in its
# reciprocal, so both give the limit; above some ten times, the set of contacting points cycles.
PENALTIES = (1.0, 4.0)
# Stiffness of what turns the hubs, relative to the gears'.
STIFF = 1e6
NAMES = ("DRIVER", "DRIVEN")


@dataclass(frozen=True)
class Placement:
    """A gear in the world: mesh, polar angle of its tooth 0 [rad], x of its centre and face width [m]."""

    mesh: GearMesh
    angle: float
    centre: float
    width: float

    def points(self) -> Array:
        """Nodes (n, 2) in the world [mm]."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return 1e3 * (self.mesh.points @ np.array([[c, s], [-s, c]]) + [self.centre, 0.0])


@dataclass(frozen=True)
class Touch:
    """Flanks of a tooth pair that may touch: gear of the slave surface (0 driver, 1 driven), `sides` (e, 2) of slave
    and master (see `outline_sides`), and the size of the elements in contact [m]."""

    slave: int
    slave_sides: Index
    master_sides: Index
    size: float


@dataclass(frozen=True)
class Deck:
    """What is written: both gears, the surfaces that may touch, the driver's rotation [rad], the material, the torques
    of driver and driven gear that are expected [N m], and lines of comment for the head."""

    gears: tuple[Placement, Placement]
    touches: tuple[Touch, ...]
    rotation: float
    material: Material
    torques: tuple[float, float]
    head: tuple[str, ...]


def plane_strain_constants(material: Material) -> tuple[float, float]:
    """Young's modulus [MPa] and Poisson's ratio with which plane-strain elements behave as the material's state."""
    e, nu = 1e-6 * material.youngs_modulus, material.poisson
    if material.state == "plane-strain":
        return e, nu
    return e * (1 + 2 * nu) / (1 + nu) ** 2, nu / (1 + nu)


def deck_text(deck: Deck) -> str:
    """The whole input."""
    parts = [_head(deck), _meshes(deck), _hubs(deck), _material(deck), _contacts(deck)]
    parts += [_step(deck, number) for number in range(len(PENALTIES))]
    return "\n".join(line for part in parts for line in part) + "\n"


def write_deck(path: str | Path, deck: Deck) -> Path:
    """Write the input. Raises FileError."""
    return write_text(path, deck_text(deck))


def _head(deck: Deck) -> Iterator[str]:
    yield from (f"** {line}".rstrip() for line in deck.head)


def _rows(numbers: Iterable[int]) -> Iterator[str]:
    """Numbers, eight a line."""
    values = list(map(str, numbers))
    yield from (", ".join(values[i : i + 8]) + "," for i in range(0, len(values), 8))


def _meshes(deck: Deck) -> Iterator[str]:
    node, element = 1, 1
    for gear, name in zip(deck.gears, NAMES, strict=True):
        yield f"*NODE, NSET=N_{name}"
        # CalculiX reads twenty characters of a number.
        yield from (f"{node + i}, {x:.12g}, {y:.12g}, 0." for i, (x, y) in enumerate(gear.points().tolist()))
        yield f"*ELEMENT, TYPE=CPE6, ELSET=E_{name}"
        rows = (gear.mesh.cells + node).tolist()
        yield from (f"{element + i}, " + ", ".join(map(str, row)) for i, row in enumerate(rows))
        yield f"*NSET, NSET=HUB_{name}"
        yield from _rows((gear.mesh.hub + node).tolist())
        node, element = node + len(gear.mesh.points), element + len(rows)


def _hubs(deck: Deck) -> Iterator[str]:
    """Rigid hubs: in polar coordinates their nodes keep the radius and move along the circle with one angle.

    CalculiX prints no moment of such a body (nor of *RIGID BODY). So the angle is the motion along x of one face of a
    cube, very stiff, whose other face is moved by the angle wanted: the force on that face is the moment.
    """
    element = sum(len(gear.mesh.cells) for gear in deck.gears) + 1
    stiffness = f"{STIFF * 1e3 * deck.torques[0] / abs(deck.rotation):.2e}"
    first = sum(len(gear.mesh.points) for gear in deck.gears)
    for number, (gear, name) in enumerate(zip(deck.gears, NAMES, strict=True)):
        x = 1e3 * gear.centre
        yield f"** {name}: its rigid hub, turned by a stiff cube in its centre"
        for face, left in (("MOMENT", -0.5), ("ANGLE", 0.5)):
            yield f"*NODE, NSET={face}_{name}"
            for y, z in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)):
                first += 1
                yield f"{first}, {x + left:.12g}, {y:g}, {z:g}"
        nodes = range(first - 7, first + 1)
        yield f"*ELEMENT, TYPE=C3D8, ELSET=CUBE_{name}"
        yield f"{element + number}, " + ", ".join(map(str, nodes))
        yield f"*MATERIAL, NAME=CUBE_{name}"
        yield from ("*ELASTIC", f"{stiffness}, 0.", f"*SOLID SECTION, ELSET=CUBE_{name}, MATERIAL=CUBE_{name}")
        yield f"*TRANSFORM, NSET=HUB_{name}, TYPE=C"
        yield f"{x:.12g}, 0., 0., {x:.12g}, 0., 1."
        angle = nodes[4]
        for node in nodes[5:]:
            yield from ("*EQUATION", "2", f"{node}, 1, 1., {angle}, 1, -1.")
        before = sum(len(g.mesh.points) for g in deck.gears[:number]) + 1
        radius = 1e3 * float(np.hypot(*gear.mesh.points[gear.mesh.hub[0]]))
        for node in gear.mesh.hub.tolist():
            yield from ("*EQUATION", "2", f"{before + node}, 2, 1., {angle}, 1, {-radius:.12g}")


def _material(deck: Deck) -> Iterator[str]:
    modulus, poisson = plane_strain_constants(deck.material)
    yield from ("*MATERIAL, NAME=GEARS", "*ELASTIC", f"{modulus:.12g}, {poisson:.12g}")
    for gear, name in zip(deck.gears, NAMES, strict=True):
        yield f"*SOLID SECTION, ELSET=E_{name}, MATERIAL=GEARS"
        yield f"{1e3 * gear.width:.12g}"


def _behaviour(deck: Deck, touch: Touch, penalty: float) -> str:
    modulus, _ = plane_strain_constants(deck.material)
    return f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{penalty * modulus / (1e3 * touch.size):.6g}"


def _contacts(deck: Deck) -> Iterator[str]:
    first = (1, 1 + len(deck.gears[0].mesh.cells))
    for k, touch in enumerate(deck.touches):
        yield f"*SURFACE INTERACTION, NAME=CONTACT{k}"
        yield _behaviour(deck, touch, PENALTIES[0])
        for name, gear, sides in (
            (f"SLAVE{k}", touch.slave, touch.slave_sides),
            (f"MASTER{k}", 1 - touch.slave, touch.master_sides),
        ):
            yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
            yield from (f"{first[gear] + element}, S{side + 1}" for element, side in sides.tolist())
        yield f"*CONTACT PAIR, INTERACTION=CONTACT{k}, TYPE=SURFACE TO SURFACE"
        yield f"SLAVE{k}, MASTER{k}"


def _step(deck: Deck, number: int) -> Iterator[str]:
    yield f"** Step {number + 1}: contact stiffness {PENALTIES[number]:g} x Young's modulus / element size"
    yield from ("*STEP, INC=50, NLGEOM", "*STATIC, DIRECT", "1., 1.")
    # Contact settles slowly where many stiff points share a contact: let it, instead of giving up.
    yield from ("*CONTROLS, PARAMETERS=TIME INCREMENTATION", "4, 8, 9, 150, 10, 4, , 5, , ")
    if number:
        for k, touch in enumerate(deck.touches):
            yield f"*CHANGE SURFACE BEHAVIOR, INTERACTION=CONTACT{k}"
            yield _behaviour(deck, touch, PENALTIES[number])
    yield "*BOUNDARY"
    for name, turn in zip(NAMES, (deck.rotation, 0.0), strict=True):
        yield from (f"HUB_{name}, 1, 1", f"MOMENT_{name}, 2, 3", f"ANGLE_{name}, 2, 3")
        yield f"MOMENT_{name}, 1, 1, {turn:.12g}"
    for name in NAMES:
        yield from (f"*NODE PRINT, NSET=MOMENT_{name}, TOTALS=ONLY", "RF")
    yield from ("*NODE FILE", "U", "*EL FILE", "S", "*CONTACT FILE", "CDIS, CSTR", "*END STEP")

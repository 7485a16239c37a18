"""Where the teeth stand and where they will touch, from the profiles alone."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from deck import Touch
from numpy.typing import NDArray
from planar_mesh import PlanarMesh, Spot, rotation

from gearbench.geometry.pair.kinematics import Pair, pair
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear, Material, Rig, Support, Supports

Array = NDArray[np.float64]

MARGIN = 2e-6  # pairs whose gap exceeds the DTE by more stay open [m]
AT_CORNER = 1e-6  # a contact this close to an undercut corner is on it [m]


@dataclass(frozen=True)
class Setup:
    """A pair in a rigid position: mesh phase [cycles], DTE [m] to be imposed, torque [N m] expected
    roughly."""

    rig: Rig
    pair: Pair
    phase: float
    dte: float
    torque: float

    @property
    def gears(self) -> tuple[Gear, Gear]:
        return self.rig.driver, self.rig.driven

    @property
    def shapes(self) -> tuple[Profile, Profile]:
        return self.pair.driver, self.pair.driven

    @property
    def centres(self) -> Array:
        """Both gear centres, one a row [mm]."""
        return np.array([[0.0, 0.0], [1e3 * self.pair.centre_distance, 0.0]])

    def angle(self, gear: int, tooth: int) -> float:
        """Polar angle of a tooth's axis in the world before the driver is turned by dte / rb."""
        if gear == 0:
            return self.pair.driver_angle + (self.phase - tooth) * 2 * pi / self.pair.driver.teeth
        return pi + self.pair.driven_angle - (self.phase - tooth) * 2 * pi / self.pair.driven.teeth

    def placed(self, gear: int, tooth: int) -> tuple[Array, Array]:
        """Rotation of a tooth's frame and its centre [mm]."""
        return rotation(self.angle(gear, tooth)), self.centres[gear]


@dataclass(frozen=True)
class Meeting:
    """A tooth pair that closes: gap before the driver turns [m], contact points and ends of the involutes (2,
    2) of both gears [mm], estimated half-width [mm], slave gear, how far in radius the contact is beyond the
    involute [mm], starts (2, 2) of the involutes [mm], NaN where there is no undercut, and the gear that
    touches with that corner (-1: none)."""

    tooth: int
    gap: float
    at: Array
    half_width: float
    ends: Array
    slave: int
    beyond: float
    starts: Array
    corner: int


def tip_distance(m: Meeting) -> float:
    """Distance [mm] of the contact from the end of the involute; negative on a tip edge."""
    return -m.beyond


def make_rig(record: dict) -> Rig:
    """The rig of a stored pair: SI values of both gears, material and centre distance."""
    idle = Support(stiffness=1e8)
    return Rig(
        centre_distance=record["centre_distance"],
        driver=Gear(**record["driver"]),
        driven=Gear(**record["driven"]),
        material=Material(**record["material"]),
        support=Supports(driver=idle, driven=idle),
    )


def setup(rig: Rig, phase: float, dte: float, torque: float) -> Setup:
    return Setup(rig, pair(rig), phase, dte, torque)


def closest(position: Setup, tooth: int) -> tuple[float, Array, Array]:
    """Rigid turn of the driver until the pair touches, times its base radius [m]; points (m) in both teeth's
    frames.

    Every point of the driven flank is looked up in the driver's frame, where it is compared with the polar
    angle of the driver's flank at the same radius.
    """
    one, two = position.shapes
    s1 = np.concatenate([np.linspace(one.s_form, one.s_end, 40001), np.linspace(one.s_end, one.s_tip, 4001)[1:]])
    flank = one.points(s1)
    radius, polar = np.hypot(*flank.T), np.arctan2(flank[:, 1], flank[:, 0])
    s2 = np.concatenate([np.linspace(two.s_form, two.s_end, 40001), np.linspace(two.s_end, two.s_tip, 4001)[1:]])
    mate = two.points(s2)
    world = mate @ rotation(position.angle(1, tooth)).T + 1e-3 * position.centres[1]
    seen = world @ rotation(position.angle(0, tooth))
    r, p = np.hypot(*seen.T), np.arctan2(seen[:, 1], seen[:, 0])
    inside = (r > radius[0]) & (r < radius[-1])
    if not inside.any():
        return np.inf, flank[0], mate[0]
    turn = np.where(inside, p - np.interp(r, radius, polar), np.inf)
    k = int(np.argmin(turn))
    i = int(np.argmin(np.abs(radius - r[k])))
    return float(turn[k]) * one.base_radius, flank[i], mate[k]


def meetings(position: Setup) -> list[Meeting]:
    """The pairs that close under the DTE."""
    shapes = position.shapes
    near = [(j, *closest(position, j)) for j in range(-4, 5)]
    near = [n for n in near if n[1] < position.dte + MARGIN]
    overlap = [max(position.dte - n[1], 0.1 * position.dte) for n in near]
    stiffness = plane_modulus(position.rig.material) / 2
    found = []
    for (tooth, gap, *local), depth in zip(near, overlap, strict=True):
        load = position.torque / shapes[0].base_radius / position.pair.face_width * depth / sum(overlap)
        curvature, left, at, ends, starts, corner = 0.0, [], [], [], [], -1
        for g in (0, 1):
            matrix, centre = position.placed(g, tooth)
            end = shapes[g].involute(shapes[g].rho_end)
            left.append(float(np.hypot(*local[g]) - np.hypot(*end)))
            roll = sqrt(max(float(np.hypot(*local[g])) ** 2 - shapes[g].base_radius ** 2, 1e-9))
            curvature += 1 / roll if left[g] <= 0 else 1 / shapes[g].edge_radius
            at.append(centre + 1e3 * matrix @ local[g])
            ends.append(centre + 1e3 * matrix @ end)
            start = shapes[g].involute(shapes[g].rho_form)
            starts.append(centre + 1e3 * matrix @ start if shapes[g].undercut else np.full(2, np.nan))
            if shapes[g].undercut and np.hypot(*(local[g] - start)) < AT_CORNER:
                corner = g
        half_width = 1e3 * sqrt(4 * load / curvature / (pi * stiffness))
        slave = corner if corner >= 0 else int(left[1] > left[0])
        beyond = 1e3 * max(left)
        found.append(
            Meeting(tooth, gap, np.array(at), half_width, np.array(ends), slave, beyond, np.array(starts), corner)
        )
    return found


def plane_modulus(material: Material) -> float:
    """E of plane stress, E / (1 - nu^2) of plane strain [Pa]."""
    nu = material.poisson if material.state == "plane-strain" else 0.0
    return material.youngs_modulus / (1 - nu * nu)


def contact_size(m: Meeting, level: float) -> float:
    """Element size at a contact [mm]: ten over the width of contact at level 1."""
    return m.half_width / 5 * level


def spots(position: Setup, gear: int, met: list[Meeting], level: float) -> list[Spot]:
    """Where the mesh of a gear has to be fine: contacts, ends of involutes near them, fillets of loaded
    teeth."""
    shape = position.shapes[gear]
    module = 1e3 * shape.module
    out = []
    for m in met:
        size = contact_size(m, level)
        # On an undercut corner the load lies to one side.
        out.append(Spot(m.at[gear], size, (1.6 if m.corner < 0 else 3.2) * m.half_width + 0.01))
        for g, ends in ((0, m.ends), (1, m.ends), (0, m.starts), (1, m.starts)):
            distance = float(np.hypot(*(m.at[g] - ends[g])))
            if distance < 4 * m.half_width + 0.05:
                # The curvature jumps here; the mate needs the same size opposite.
                opposite = ends[g] if gear == g else m.at[gear] + (ends[g] - m.at[g])
                out.append(Spot(opposite, min(size, 0.003 * level), 0.01))
        for tooth in (m.tooth - 1, m.tooth, m.tooth + 1):
            matrix, centre = position.placed(gear, tooth)
            fillet = 1e3 * shape.fillet(np.array([0.5 * shape.beta_form]))[0]
            for side in (1.0, -1.0):
                at = centre + matrix @ (fillet * [1.0, side])
                scale = 1.0 if tooth == m.tooth else 1.5
                out.append(Spot(at, 0.1 * module * level * scale, 0.3 * module))
    return out


def touches(met: list[Meeting], meshes: tuple[PlanarMesh, PlanarMesh], level: float) -> list[Touch]:
    """Surfaces of the pairs that close."""
    out = []
    for m in met:
        edges = []
        for g in (0, 1):
            sides = meshes[g].flank[m.tooth]
            cells = meshes[g].triangles
            middle = meshes[g].points[cells[sides[:, 0], 3 + sides[:, 1]]]
            near = np.hypot(*(middle - m.at[g]).T) < max(8 * m.half_width, 0.2) * (1.0 if g == m.slave else 1.3)
            edges.append(sides[near])
        out.append(Touch(m.slave, edges[m.slave], edges[1 - m.slave], contact_size(m, level)))
    return out

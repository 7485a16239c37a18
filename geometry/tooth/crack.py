"""A crack from the fillet of a tooth: where it starts, which way it runs, how long it may be."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, pi, radians

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.tooth.outline import half_outline
from gearbench.geometry.tooth.profile import Profile
from gearbench.geometry.tooth.roots import bracketed_root
from gearbench.rig import Crack, Gear

Array = NDArray[np.float64]

STEEPEST = radians(75)  # of a crack to the normal of the fillet where it starts
CLEAR = 0.1  # modules left between a crack and whatever else bounds its sector
NEAR_START = 0.2  # of a point's distance from the start: there the crack's own fillet may be that close
SHORTEST = 5e-3  # modules
LONGEST = 8.0  # modules: nobody meshes a crack longer than that, whatever room there is
STEPS = 400  # places looked at per module of a crack


@dataclass(frozen=True)
class Slit:
    """A straight crack in the frame of its tooth (axis on +x, working flank at y > 0): start (2,) on the fillet, unit
    `direction` (2,) into the material, `length` [m]; `along` [m]: arc length of the fillet from the involute to the
    start."""

    start: Array
    direction: Array
    length: float
    along: float

    def points(self, t: Array) -> Array:
        """Points (n, 2) at the distances t (n,) from the start."""
        return np.asarray(self.start + t[:, None] * self.direction)

    @property
    def tip(self) -> Array:
        """The crack's tip (2,)."""
        return np.asarray(self.start + self.length * self.direction)


def start_on_fillet(tooth: Profile, angle: float, name: str = "gear") -> float:
    """Parameter of the fillet where its tangent makes `angle` [rad] with the tooth's centre line.

    The tangent turns from nearly radial on the involute to nearly circumferential on the root circle. Raises
    GeometryError for an angle that the fillet does not reach.
    """

    def over(beta: float) -> float:
        normal = tooth.fillet_normals(beta)
        return float(np.arctan2(normal[0], normal[1])) - angle

    top, bottom = over(tooth.beta_form), over(0.0)
    if not top <= 0.0 <= bottom:
        raise GeometryError(
            f"{name}.crack.start_deg = {degrees(angle):g} must lie between {degrees(top + angle):.4g} and"
            f" {degrees(bottom + angle):.4g}, the angles that this tooth's fillet has to its centre line"
        )
    return bracketed_root(over, 0.0, tooth.beta_form, xtol=1e-14, rtol=4 * float(np.finfo(float).eps))


def slit(tooth: Profile, gear: Gear, crack: Crack, name: str = "gear") -> Slit:
    """The crack of a gear's tooth. `name` is the gear's key in the case.

    Raises GeometryError for a start that the fillet does not have, a direction that does not lead into the tooth, and
    a length that comes closer than CLEAR modules to another part of the outline, the sector's cuts or the hub.
    """
    if crack.length is None or crack.direction is None:
        raise GeometryError(f"{name}.crack has no length_mm and direction_deg: it is not one in the mesh")
    beta = start_on_fillet(tooth, crack.start, name)
    start, normal = tooth.fillet(beta), tooth.fillet_normals(beta)
    outward = float(np.arctan2(normal[1], normal[0]))
    if abs(crack.direction - outward) > STEEPEST:
        raise GeometryError(
            f"{name}.crack.direction_deg = {degrees(crack.direction):g} must lie between"
            f" {degrees(outward - STEEPEST):.4g} and {degrees(outward + STEEPEST):.4g} to lead into the tooth from"
            " where the crack starts"
        )
    direction = -np.array([np.cos(crack.direction), np.sin(crack.direction)])
    most, reason = _longest(tooth, gear.hub_radius, start, direction)
    least = SHORTEST * tooth.module
    if not least <= crack.length < most:
        raise GeometryError(
            f"{name}.crack.length_mm = {1e3 * crack.length:g} must be at least {1e3 * least:.3g} and less than"
            f" {1e3 * most:.4g}, {reason}"
        )
    along = float(tooth.fillet_length(tooth.beta_form) - tooth.fillet_length(beta))
    return Slit(start, direction, crack.length, along)


def _longest(tooth: Profile, hub_radius: float, start: Array, direction: Array) -> tuple[float, str]:
    """Length [m] at which a crack comes too close to something, or is LONGEST, and the words for it."""
    clear = CLEAR * tooth.module
    reach = float(np.hypot(*start)) + tooth.tip_radius
    t = np.linspace(0.0, min(reach, LONGEST * tooth.module), int(LONGEST) * STEPS)[1:]
    points = start + t[:, None] * direction
    radius, angle = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    near = np.minimum(clear, NEAR_START * t)
    half = np.concatenate([piece.points(piece.samples) for piece in half_outline(tooth)])
    from scipy.spatial import cKDTree  # on use: few gears have a crack

    distance, which = cKDTree(np.concatenate([half, half * [1.0, -1.0]])).query(points)
    own = which < len(half)
    found = {
        "its own flank or fillet": own & (distance < near),
        "the other flank or fillet": ~own & (distance < near),
        "the next tooth's sector": radius * np.sin(np.maximum(pi / tooth.teeth - np.abs(angle), 0.0)) < near,
        "the hub circle": radius - hub_radius < near,
    }
    firsts = {what: int(np.argmax(hit)) for what, hit in found.items() if hit.any()}
    if not firsts:
        return float(t[-1]), f"the longest crack that is meshed ({LONGEST:g} modules)"
    limit = min(firsts, key=lambda what: firsts[what])
    return float(t[firsts[limit]]), f"where the crack comes within {CLEAR:g} modules of {limit}"

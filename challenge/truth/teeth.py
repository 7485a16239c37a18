"""Stiffness of the truth rig's tooth pairs over the path of contact, and its scale.

The shape of the law is not that of the finite-element tables: a beam on a foundation (potential energy), a parabola
between the ends as in ISO 6336's picture of a single pair, or a raised cosine. Its scale is: the mean tangent
stiffness over a mesh cycle is set to a given one. Beyond the ends of the path of contact the corner of a tip works on;
there the gap between the flanks grows with the square of the distance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.challenge.errors import ChallengeError
from gearbench.geometry import Pair, Profile
from gearbench.lumped.stiffness.potential_energy import hertz_compliance, tooth_compliance
from gearbench.rig import Rig

Array = NDArray[np.float64]
Shape = Literal["energy", "parabola", "cosine"]

NODES = 1025
BEYOND = 0.12  # base pitches that tip corners are followed past both ends of the path of contact, at least
# Compliances of a pair in the parabola's picture: both teeth bend alike, the rest is contact.
BENDING_SHARE = 0.4
CYCLE = 240  # phases at which the mean stiffness is taken


@dataclass(frozen=True)
class PairLaw:
    """Tables (NODES,) over the position v from `first` in steps of `pitch` (base pitches from the pitch point):
    stiffness [N/m], shares of the compliance in each tooth's bending, gap [m] beyond the ends of the path;
    `inside` holds the ends."""

    first: float
    pitch: float
    stiffness: Array
    share_driver: Array
    share_driven: Array
    gap: Array
    inside: tuple[float, float]

    @property
    def place(self) -> Array:
        """Positions of the nodes."""
        return np.asarray(self.first + self.pitch * np.arange(NODES), dtype=np.float64)


def path_ends(meshing: Pair) -> tuple[float, float]:
    """Ends of the path of contact in base pitches from the pitch point."""
    pitch_point = meshing.rho_pitch[0]
    low, high = ((rho - pitch_point) / meshing.base_pitch for rho in meshing.active_driver)
    return low, high


def corner_gap(meshing: Pair) -> tuple[float, float]:
    """Coefficients [1/m] of the gap that grows as the square of the distance beyond start and end of the path."""
    distances = 0.05 * meshing.base_pitch * np.linspace(0.2, 1.0, 9)
    one, two = meshing.driver, meshing.driven
    start = corner_clearance(meshing, one, two, meshing.active_driver[0], distances)
    end = corner_clearance(meshing, two, one, meshing.active_driven[0], distances)
    start_fit, end_fit = (float(np.sum(gap * distances**2) / np.sum(distances**4)) for gap in (start, end))
    return start_fit, end_fit


def corner_clearance(meshing: Pair, one: Profile, two: Profile, rho: float, distance: Array) -> Array:
    """Gaps (n,) [m] between gear `one` and the corner at the end of its mate's involute, for contacts that would lie
    `distance` (n,) [m] beyond the end of the path, where `one` has the roll length `rho`.

    The mate is turned back about its centre; the gap along the normal is the base radius times the angle from the
    flank to the corner.
    """
    alpha = meshing.working_pressure_angle
    start = one.base_radius * np.array([np.cos(alpha), -np.sin(alpha)]) + rho * np.array([np.sin(alpha), np.cos(alpha)])
    x, y = start[0] - meshing.centre_distance, start[1]
    turn = distance / two.base_radius
    at_x = meshing.centre_distance + x * np.cos(turn) - y * np.sin(turn)
    at_y = x * np.sin(turn) + y * np.cos(turn)
    pressure = np.arccos(one.base_radius / np.hypot(at_x, at_y))
    flank = -alpha + (rho - distance) / one.base_radius - (np.tan(pressure) - pressure)
    return np.asarray(one.base_radius * (np.arctan2(at_y, at_x) - flank))


def pair_law(rig: Rig, meshing: Pair, shape: Shape, bow: float, open_at: float = 0.0) -> PairLaw:
    """The pair's tables in their natural scale (multiply the stiffness as wanted).

    `bow` is the relative loss of stiffness at the ends of the path; the energy method needs none. The tables end where
    the gap beyond the path is `open_at` [m] at least: a pair that still carried there would let go at a blow.
    """
    low, high = path_ends(meshing)
    coefficients = corner_gap(meshing)
    reach = max(BEYOND, float(np.sqrt(open_at / min(coefficients))) / meshing.base_pitch)
    first = low - reach
    pitch = (high + reach - first) / (NODES - 1)
    place = first + pitch * np.arange(NODES)
    gap = np.zeros(NODES)
    for beyond, coefficient in zip((low - place, place - high), coefficients, strict=True):
        gap += coefficient * (np.maximum(beyond, 0.0) * meshing.base_pitch) ** 2
    inside = np.clip(place, low, high)
    if shape == "energy":
        stiffness, driver, driven = _energy(rig, meshing, inside)
    else:
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        away = (inside - middle) / half
        stiffness = 1.0 - bow * (away**2 if shape == "parabola" else 0.5 - 0.5 * np.cos(np.pi * away))
        driver = driven = np.full(NODES, BENDING_SHARE)
    return PairLaw(first, pitch, stiffness, driver, driven, gap, (low, high))


def _energy(rig: Rig, meshing: Pair, place: Array) -> tuple[Array, Array, Array]:
    """Stiffness and bending shares of the potential energy method; the body under a tooth counts as bending."""
    rho = meshing.rho_pitch[0] + place * meshing.base_pitch
    width, material = meshing.face_width, rig.material
    one = tooth_compliance(meshing.driver, rig.driver.hub_radius, width, material, rho).total
    two = tooth_compliance(meshing.driven, rig.driven.hub_radius, width, material, meshing.line_of_action - rho).total
    total = one + two + hertz_compliance(material, width)
    return 1.0 / total, one / total, two / total


def mean_tangent(law: PairLaw, exponent: float, reference: float, force: float) -> float:
    """Mean over the mesh cycle of the tangent stiffness [N/m] of sound, error-free pairs under `force` [N]."""
    phase = np.arange(CYCLE)[:, None] / CYCLE
    place = law.place
    last = place[-1]
    v = phase - np.arange(np.floor(-last), np.ceil(1.0 - law.first) + 1.0)
    inside = (v > law.first) & (v < last)
    k = np.where(inside, np.interp(v, place, law.stiffness), 0.0)
    gap = np.interp(v, place, law.gap)

    def forces(dte: Array) -> tuple[Array, Array]:
        delta = np.maximum(dte[:, None] - gap, 0.0)
        tangent = k * (delta / reference) ** exponent * (delta > 0)
        return (tangent * delta).sum(axis=1), (1.0 + exponent) * tangent.sum(axis=1)

    low, high = np.zeros(CYCLE), np.full(CYCLE, 1e-3)
    if not (forces(high)[0] > force).all():
        raise ChallengeError(f"no tooth pair carries {force:.3g} N within 1 mm of deflection")
    for _ in range(60):
        middle = 0.5 * (low + high)
        above = forces(middle)[0] > force
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return float(forces(high)[1].mean())


def scaled(law: PairLaw, exponent: float, reference: float, force: float, wanted: float) -> PairLaw:
    """The law with its stiffness scaled until the mean tangent stiffness under `force` [N] is `wanted` [N/m]."""
    # In steps: with a gap or an exponent the tangent is not quite proportional to the scale.
    scale = wanted / float(law.stiffness.mean())
    for _ in range(20):
        trial = replace(law, stiffness=law.stiffness * scale)
        ratio = wanted / mean_tangent(trial, exponent, reference, force)
        scale *= ratio
        if abs(ratio - 1.0) < 1e-10:
            break
    return replace(law, stiffness=law.stiffness * scale)

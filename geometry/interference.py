"""Whether the tip of one gear cuts into the fillet of its mate while the two roll on each other."""

from __future__ import annotations

from dataclasses import replace
from math import atan2, sqrt, tan

import numpy as np
from scipy.spatial.distance import cdist

from gearbench.geometry.profile import Array, Profile, involute, radial

# Points on the fillet and on the path of the tip: the clearance is then right to better than TOLERANCE [m].
SAMPLES = 400
TOLERANCE = 1e-7


def tip_path(gear: Profile, mate: Profile, distance: float, working_pressure_angle: float) -> Array:
    """Path (n, 2) of the centre of the mate's tip-edge arc in the frame of `gear`, from below the mate's
    contact with the working flank of tooth 0 to as far beyond the line of centres."""
    ratio = gear.teeth / mate.teeth
    at_pitch = involute(working_pressure_angle)
    centre = mate.edge_centre
    radius, ahead = float(np.hypot(*centre)), atan2(centre[1], centre[0]) + at_pitch - mate.psi_b
    # The gear's rotation when the arc begins to touch at the end of the mate's involute, and on the line of
    # centres.
    roll_pitch = gear.base_radius * tan(working_pressure_angle)
    roll_start = roll_pitch + mate.base_radius * tan(working_pressure_angle) - mate.rho_end
    begin, middle = (roll_start - roll_pitch) / gear.base_radius, ahead / ratio
    turned = np.linspace(begin, 2 * middle - begin, SAMPLES)
    own = -(at_pitch - gear.psi_b + turned)  # from the world to the gear's frame
    return distance * radial(own) - radius * radial(own + ahead - ratio * turned)


def _faced(gear: Profile) -> tuple[Array, Array]:
    """Points (n, 2) and normals (n, 2) that the tip arc is held against: the fillet and, where undercut ends it in a
    corner, the involute beyond; the corner then stands at SAMPLES - 1 and at SAMPLES, with either normal."""
    beta = np.linspace(0.0, gear.beta_form, SAMPLES)
    points, normals = gear.fillet(beta), gear.fillet_normals(beta)
    if not gear.undercut:
        return points, normals
    rho = np.linspace(gear.rho_form, gear.rho_end, SAMPLES)
    return np.concatenate((points, gear.involute(rho))), np.concatenate((normals, gear.involute_normals(rho)))


def fillet_clearance(gear: Profile, mate: Profile, distance: float, working_pressure_angle: float) -> float:
    """Smallest gap [m] between the mate's tip-edge arc and the fillet of `gear` (with undercut, its corner and flank
    too); negative: it cuts in.

    Signed along the normals, so that an error of the nearest sample counts only in second order.
    """
    path = tip_path(gear, mate, distance, working_pressure_angle)
    points, normals = _faced(gear)
    nearest = np.argmin(cdist(path, points), axis=1)
    # Beyond the ends the arc faces the involute or the root circle, which have their own checks.
    inside = (nearest > 0) & (nearest < len(points) - 1)
    if not inside.any():
        return float("inf")
    path, nearest = path[inside], nearest[inside]
    away = path - points[nearest]
    gap = np.einsum("ij,ij->i", away, normals[nearest])
    if gear.undercut:
        # An outward corner: before it lies what either normal points to.
        corner = (nearest == SAMPLES - 1) | (nearest == SAMPLES)
        ahead = np.max(away[corner] @ normals[SAMPLES - 1 : SAMPLES + 1].T, axis=1, initial=-np.inf)
        gap[corner] = np.copysign(np.linalg.norm(away[corner], axis=1), ahead)
    return float(np.min(gap)) - mate.edge_radius


def with_tip(gear: Profile, radius: float) -> Profile:
    """The gear turned down (or left longer) to another tip radius [m]."""
    edge = gear.edge_radius
    rho_end = edge + sqrt(max((radius - edge) ** 2 - gear.base_radius**2, 0.0))
    return replace(gear, tip_radius=radius, rho_end=rho_end)


def largest_tip(gear: Profile, mate: Profile, distance: float, working_pressure_angle: float) -> float:
    """Largest tip radius [m] of the mate that clears the fillet of `gear`, by bisection to 1 nm or better."""
    clear, cutting = mate.form_radius, mate.tip_radius
    for _ in range(24):
        middle = 0.5 * (clear + cutting)
        gap = fillet_clearance(gear, with_tip(mate, middle), distance, working_pressure_angle)
        clear, cutting = (middle, cutting) if gap >= -TOLERANCE else (clear, middle)
    return clear

"""Whether the tip of one gear cuts into the fillet of its mate while the two roll on each other."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from math import acos, atan2, sqrt

import numpy as np

from gearbench.geometry.tooth.profile import Array, Profile, involute, radial

# Points on the fillet and on the path of the tip: the clearance is then right to better than TOLERANCE [m].
SAMPLES = 400
TOLERANCE = 1e-7


def tip_path(gear: Profile, mate: Profile, distance: float, working_pressure_angle: float) -> Array:
    """Path (n, 2) of the centre of the mate's tip-edge arc in the frame of `gear`, while the arc may reach inside the
    form circle; empty if it never does.

    The centre's distance from the gear's axis depends on the angle between it and the line of centres alone.
    """
    ratio = gear.teeth / mate.teeth
    at_pitch = involute(working_pressure_angle)
    centre = mate.edge_centre
    radius, ahead = float(np.hypot(*centre)), atan2(centre[1], centre[0]) + at_pitch - mate.psi_b
    reach = gear.form_radius + mate.edge_radius
    cosine = (distance**2 + radius**2 - reach**2) / (2 * distance * radius)
    if cosine >= 1.0:
        return np.empty((0, 2))
    swept = acos(max(cosine, -1.0)) * np.linspace(-1.0, 1.0, SAMPLES)
    turned = (ahead - swept) / ratio  # the gear's rotation
    own = -(at_pitch - gear.psi_b + turned)  # from the world to the gear's frame
    return distance * radial(own) - radius * radial(own + swept)


@lru_cache(maxsize=64)  # a diagnosis makes many rigs of the same gears
def fillet_clearance(gear: Profile, mate: Profile, distance: float, working_pressure_angle: float) -> float:
    """Smallest gap [m] between the mate's tip-edge arc and the fillet of `gear`; negative: it cuts in.

    Signed along the fillet's normals, so that an error of the nearest sample counts only in second order. A tip that
    cuts off the outward corner of an undercut flank enters the fillet too.
    """
    path = tip_path(gear, mate, distance, working_pressure_angle)
    if not len(path):
        return float("inf")
    beta = np.linspace(0.0, gear.beta_form, SAMPLES)
    points, normals = gear.fillet(beta), gear.fillet_normals(beta)
    nearest = np.argmin(np.sum((path[:, None] - points) ** 2, axis=2), axis=1)
    # Beyond the ends the arc faces the involute or the root circle, which have their own checks.
    inside = (nearest > 0) & (nearest < SAMPLES - 1)
    if not inside.any():
        return float("inf")
    path, nearest = path[inside], nearest[inside]
    return float(np.min(np.einsum("ij,ij->i", path - points[nearest], normals[nearest]))) - mate.edge_radius


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

"""Area, mass and polar inertia of the finite-element body (hub circle to profile) and of the hub."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.error import GeometryError
from gearbench.geometry.tooth.profile import Profile, radial
from gearbench.rig import Gear

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Body:
    """Masses [kg] and polar moments of inertia [kg m^2] about the gear's axis. The finite-element body
    reaches from the hub circle to the profile over the gear's own face width; the hub row carries what is
    left of the totals."""

    area: float  # of the finite-element body [m^2]
    mass: float
    inertia: float
    mass_fe: float
    inertia_fe: float
    mass_hub: float
    inertia_hub: float


def outline_quadrature(tooth: Profile) -> tuple[Array, Array, Array]:
    """Quadrature along the counter-clockwise half of a tooth's outline: points (n, 2), normals (n, 2),
    weights (n,) [m]. Gauss-Legendre on each smooth piece in its natural parameter, exact to rounding."""
    x, w = np.polynomial.legendre.leggauss(48)
    x, w = 0.5 * (x + 1), 0.5 * w
    land = tooth.tip_half_angle * x
    turn = tooth.psi_b - tooth.rho_end / tooth.base_radius + pi / 2 - tooth.edge_angle * x
    rho = tooth.rho_form + (tooth.rho_end - tooth.rho_form) * x
    beta = tooth.beta_form * x
    root = pi / tooth.teeth - tooth.root_half_angle * x
    points = (
        tooth.tip_radius * radial(land),
        tooth.edge_centre + tooth.edge_radius * radial(turn),
        tooth.involute(rho),
        tooth.fillet(beta),
        tooth.root_radius * radial(root),
    )
    normals = (
        radial(land),
        radial(turn),
        tooth.involute_normals(rho),
        tooth.fillet_normals(beta),
        radial(root),
    )
    weights = (
        w * tooth.tip_radius * tooth.tip_half_angle,
        w * tooth.edge_radius * tooth.edge_angle,
        w * (tooth.rho_end - tooth.rho_form) * rho / tooth.base_radius,
        w * tooth.beta_form * tooth.fillet_speed(beta),
        w * tooth.root_radius * tooth.root_half_angle,
    )
    return np.concatenate(points), np.concatenate(normals), np.concatenate(weights)


@lru_cache(maxsize=64)  # a diagnosis makes many rigs of the same gears
def gear_area(tooth: Profile) -> tuple[float, float]:
    """Area [m^2] and polar second moment of area [m^4] of the whole gear (no bore), by Gauss' theorem:
    A = 1/2 integral of X.n ds, I = 1/4 integral of |X|^2 X.n ds (both sides of z teeth)."""
    points, normals, weights = outline_quadrature(tooth)
    reach = np.einsum("ij,ij->i", points, normals) * weights
    squares = np.einsum("ij,ij->i", points, points)
    return tooth.teeth * float(reach.sum()), tooth.teeth * float((squares * reach).sum()) / 2


def sector_area(tooth: Profile, hub_radius: float) -> float:
    """Area [m^2] of one tooth sector between hub circle and profile."""
    return gear_area(tooth)[0] / tooth.teeth - pi * hub_radius**2 / tooth.teeth


def body(tooth: Profile, gear: Gear, density: float, name: str = "gear") -> Body:
    """Masses and inertias of a gear of `density` [kg/m^3]; `name` is its key in the case.

    `gear.mass` and `gear.inertia` are totals; where absent they follow from the geometry, bore to profile.
    Raises GeometryError if a total is smaller than the finite-element body alone.
    """
    area, second = gear_area(tooth)
    hub, bore = gear.hub_radius, gear.bore_radius
    per_area = density * gear.face_width
    mass_fe = per_area * (area - pi * hub**2)
    inertia_fe = per_area * (second - pi / 2 * hub**4)
    mass = gear.mass if gear.mass is not None else mass_fe + per_area * pi * (hub**2 - bore**2)
    disc = per_area * pi / 2 * (hub**4 - bore**4)
    inertia = gear.inertia if gear.inertia is not None else inertia_fe + disc
    for key, total, least in (("mass_kg", mass, mass_fe), ("inertia_kg_m2", inertia, inertia_fe)):
        if total < least:
            raise GeometryError(
                f"{name}.{key} = {total:g} is less than the gear outside its hub circle alone: at least"
                f" {least:.6g}"
            )
    return Body(area - pi * hub**2, mass, inertia, mass_fe, inertia_fe, mass - mass_fe, inertia - inertia_fe)

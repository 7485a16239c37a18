"""Torsion of the gear body between the rigid hub circle and the root circle.

Finite elements from hub to hub contain it, and so does the foundation of Sainsot, Velex and Duverger (2004), a ring
held at its inner circle: as the hub shrinks, its compliance grows by the torsion. ISO 6336 and Weber-Banaschek do not:
their foundation is a half-plane. To compare like with like, the torsion is taken off.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry import Pair, Profile
from gearbench.lumped.errors import LumpedError
from gearbench.rig import Gear, Material, Rig

Array = NDArray[np.float64]


def body_stiffness(gear: Gear, tooth: Profile, material: Material) -> float:
    """Torsional stiffness of the ring along the line of action [N/m].

    k = 4 pi G b / (1/r_i^2 - 1/r_o^2) / r_b^2 with r_i = hub radius and r_o = root radius: torque 2 pi r^2 b tau and
    twist integral of tau/(G r) (Timoshenko and Goodier, Theory of Elasticity, art. 47), over the square of the base
    radius. Plane stress and plane strain alike. Infinite for a ring without height.
    """
    shear = material.youngs_modulus / (2 * (1 + material.poisson))
    span = 1 / gear.hub_radius**2 - 1 / tooth.root_radius**2
    if span <= 0.0:
        return float("inf")
    return 4 * pi * shear * gear.face_width / span / tooth.base_radius**2


def without_body_torsion(stiffness: ArrayLike, rig: Rig, meshing: Pair) -> Array:
    """Stiffness [N/m] that is left of a hub-to-hub stiffness when neither gear body twists (any shape).

    Raises LumpedError where the bodies alone are softer than the whole.
    """
    bodies = 1 / body_stiffness(rig.driver, meshing.driver, rig.material)
    bodies += 1 / body_stiffness(rig.driven, meshing.driven, rig.material)
    whole = np.asarray(stiffness, dtype=float)
    rest = 1 / whole - bodies
    if np.any(rest <= 0):
        raise LumpedError(
            f"hub-to-hub stiffness {float(whole.max()):.4g} N/m must be below that of the gear bodies' torsion alone,"
            f" {1 / bodies:.4g} N/m"
        )
    return np.asarray(1 / rest)

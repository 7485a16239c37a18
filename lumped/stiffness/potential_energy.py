"""Mesh stiffness of a tooth pair by the potential energy method.

A tooth is a cantilever of varying thickness on a flexible foundation. The force on a flank point splits
into a lateral part F cos(alpha) and an axial part F sin(alpha); the energies of bending, shear and axial
compression are integrated over the true outline (trochoidal fillet and involute), from the root circle to
the contact point (Yang and Lin 1987; Tian 2004; outline from the root circle as Ma et al. 2014). The gear
body adds the fillet foundation deflection of Sainsot, Velex and Duverger (2004), the contact the linear
Hertz deflection of Yang and Sun (1985). The foundation is a ring held at the hub circle, so torsion of the
gear body is in it: taking the torsion off leaves a compliance that hardly depends on the hub radius.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry import Pair, Profile
from gearbench.rig import Material, Rig

Array = NDArray[np.float64]

# Shear correction of a rectangular section in the energy U = 1.2 V^2 / (2 G A).
SHEAR_FACTOR = 1.2

# Sainsot, Velex and Duverger (2004), table 1: X(h, theta) = A/theta^2 + B h^2 + C h/theta + D/theta + E h
# + F.
FOUNDATION_COEFFICIENTS = {
    "L": (-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045),
    "M": (60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086),
    "P": (-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236),
    "Q": (-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904),
}
# Range of the fit: root radius over hub radius, and half the angle of the tooth at the root circle.
FOUNDATION_RANGE_H = (1.4, 7.0)
FOUNDATION_RANGE_THETA = (0.01, 0.12)

NODES = 40


@dataclass(frozen=True)
class ToothCompliance:
    """Deflection along the line of action per force [m/N], one value a contact point (n,)."""

    bending: Array
    shear: Array
    axial: Array
    foundation: Array

    @property
    def total(self) -> Array:
        """Sum of all parts."""
        return self.bending + self.shear + self.axial + self.foundation


@dataclass(frozen=True)
class Sections:
    """Quadrature over cross-sections of a tooth, from the root circle up to each contact point.

    `x` is the position along the tooth's axis, `half` the half thickness there, `weight` the quadrature
    weight in x; all (contact points, nodes) in m.
    """

    x: Array
    half: Array
    weight: Array


def beam_compliance(
    sections: Sections, contact: Array, alpha: Array, *, youngs: float, shear: float, width: float
) -> tuple[Array, Array, Array]:
    """Bending, shear and axial compliance (n,) [m/N] of cantilevers.

    `contact` (n, 2) holds position along the axis and half thickness of the contact points, `alpha` (n,)
    the angle of the force against the normal of the axis, positive towards the root. `youngs` and `shear`
    are the moduli [Pa], `width` the face width [m].
    """
    lateral, axial = np.cos(alpha)[:, None], np.sin(alpha)[:, None]
    moment = lateral * (contact[:, :1] - sections.x) - axial * contact[:, 1:]
    area = 2 * sections.half * width
    second = (2 * sections.half) ** 3 * width / 12
    bending = (sections.weight * moment**2 / (youngs * second)).sum(axis=1)
    shearing = (sections.weight * SHEAR_FACTOR * lateral**2 / (shear * area)).sum(axis=1)
    pressing = (sections.weight * axial**2 / (youngs * area)).sum(axis=1)
    return bending, shearing, pressing


def tooth_sections(tooth: Profile, rho: Array) -> Sections:
    """Cross-sections of the tooth below the involute points of roll length `rho` (n,): fillet, involute."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    nodes, weights = 0.5 * (nodes + 1), 0.5 * weights
    beta = tooth.beta_form * nodes
    fillet = tooth.fillet(beta)
    # On this side of the tooth the outline runs outwards at right angles (clockwise) to its outward normal.
    climb = tooth.fillet_speed(beta) * tooth.fillet_normals(beta)[:, 1]
    fillet_weight = weights * tooth.beta_form * climb
    span = rho[:, None] - tooth.rho_form
    roll = tooth.rho_form + span * nodes
    involute = tooth.involute(roll)
    phi = tooth.psi_b - roll / tooth.base_radius
    involute_weight = weights * span * roll / tooth.base_radius * np.cos(phi)

    def stack(below: Array, above: Array) -> Array:
        return np.concatenate((np.broadcast_to(below, (rho.size, NODES)), above), axis=1)

    return Sections(
        x=stack(fillet[:, 0], involute[..., 0]),
        half=stack(fillet[:, 1], involute[..., 1]),
        weight=stack(fillet_weight, involute_weight),
    )


def foundation_polynomials(h: float, theta: float) -> tuple[float, float, float, float]:
    """L*, M*, P*, Q* (Sainsot, Velex, Duverger 2004); arguments outside the fit are held at its limits."""
    h = float(np.clip(h, *FOUNDATION_RANGE_H))
    theta = float(np.clip(theta, *FOUNDATION_RANGE_THETA))
    terms = np.array([1 / theta**2, h * h, h / theta, 1 / theta, h, 1.0])
    values = [float(np.dot(FOUNDATION_COEFFICIENTS[name], terms)) for name in "LMPQ"]
    return values[0], values[1], values[2], values[3]


def foundation_compliance(tooth: Profile, hub_radius: float, alpha: Array, *, youngs: float, width: float) -> Array:
    """Compliance (n,) [m/N] of the gear body under the tooth (Sainsot, Velex and Duverger 2004, equation 9).

    The body is a ring between the root circle and the rigid hub circle; `alpha` (n,) as in `beam_compliance`.
    """
    theta = pi / tooth.teeth - tooth.root_half_angle
    base = 2 * tooth.root_radius * theta
    # The line of action is tangent to the base circle and cuts the tooth's axis at base_radius/cos(alpha).
    lever = (tooth.base_radius / np.cos(alpha) - tooth.root_radius) / base
    el, em, pe, qu = foundation_polynomials(tooth.root_radius / hub_radius, theta)
    shape = el * lever**2 + em * lever + pe * (1 + qu * np.tan(alpha) ** 2)
    return np.cos(alpha) ** 2 / (youngs * width) * shape


def tooth_compliance(
    tooth: Profile, hub_radius: float, width: float, material: Material, rho: ArrayLike
) -> ToothCompliance:
    """Compliance of one tooth and its foundation at the involute points of roll length `rho` (n,) [m]."""
    rho = np.atleast_1d(np.asarray(rho, dtype=float))
    youngs, shear = moduli(material)
    contact = tooth.involute(rho)
    alpha = rho / tooth.base_radius - tooth.psi_b
    bending, shearing, pressing = beam_compliance(
        tooth_sections(tooth, rho), contact, alpha, youngs=youngs, shear=shear, width=width
    )
    body = foundation_compliance(tooth, hub_radius, alpha, youngs=youngs, width=width)
    return ToothCompliance(bending, shearing, pressing, body)


def hertz_compliance(material: Material, width: float) -> float:
    """Contact compliance 4 (1 - nu^2)/(pi E b) [m/N], both gears of one material (Yang and Sun 1985)."""
    return 4 * (1 - material.poisson**2) / (pi * material.youngs_modulus * width)


def moduli(material: Material) -> tuple[float, float]:
    """Modulus of bending and compression (E; in plane strain E/(1 - nu^2)) and shear modulus [Pa]."""
    youngs, nu = material.youngs_modulus, material.poisson
    inplane = youngs / (1 - nu**2) if material.state == "plane-strain" else youngs
    return inplane, youngs / (2 * (1 + nu))


def pair_stiffness(rig: Rig, meshing: Pair, rho_driver: ArrayLike) -> Array:
    """Stiffness (n,) [N/m] of one tooth pair that touches at the driver's roll lengths (n,) [m]."""
    rho = np.atleast_1d(np.asarray(rho_driver, dtype=float))
    width = meshing.face_width
    one = tooth_compliance(meshing.driver, rig.driver.hub_radius, width, rig.material, rho)
    two = tooth_compliance(meshing.driven, rig.driven.hub_radius, width, rig.material, meshing.line_of_action - rho)
    return 1 / (one.total + two.total + hertz_compliance(rig.material, width))


def outside_foundation_fit(rig: Rig, meshing: Pair) -> list[str]:
    """One sentence for each gear whose body lies outside the range of the foundation's fit."""
    notes = []
    for name, gear, tooth in (
        ("driver", rig.driver, meshing.driver),
        ("driven", rig.driven, meshing.driven),
    ):
        h, theta = tooth.root_radius / gear.hub_radius, pi / tooth.teeth - tooth.root_half_angle
        for symbol, value, (low, high) in (
            ("root radius / hub radius", h, FOUNDATION_RANGE_H),
            ("half tooth angle at the root", theta, FOUNDATION_RANGE_THETA),
        ):
            if not low <= value <= high:
                notes.append(
                    f"{name}: {symbol} = {value:.3g} is outside {low:g} to {high:g}, the range of the fillet"
                    " foundation's fit; its coefficients are held at the limit"
                )
    return notes

"""Deflection of a spur tooth pair by Weber and Banaschek, from the true profile.

C. Weber and K. Banaschek, Formaenderung und Profilruecknahme bei gerad- und schraegverzahnten Raedern,
Schriftenreihe Antriebstechnik 11, Vieweg 1953; English: C. Weber, The Deformation of Loaded Gears and the
Effect on Their Load-Carrying Capacity, DSIR, London 1949. Per unit of face width, along the line of action:

* tooth: cos^2 a (1 - nu^2)/E [12 int (u - y)^2/(2 x)^3 dy + (2.4/(1 - nu) + tan^2 a) int dy/(2 x)], from the
  root (y = 0) to where the line of action crosses the tooth's axis (y = u): bending, shear, compression;
* foundation, a half-plane under linear stresses across the root chord s_f:
  cos^2 a (1 - nu^2)/E [18/pi (u/s_f)^2 + 2 (1 - 2 nu)/(1 - nu) u/s_f + 4.8/pi (1 + (1 - nu)/2.4 tan^2 a)];
* contact: approach of the point where the line of action crosses the axis, at the depth h below the surface,
  under a Hertz pressure of half-width w: 2 (1 - nu^2)/(pi E) [ln(2 h/w) - nu/(2 (1 - nu))].

With nu = 0.3 these are the familiar 10.92, 3.1 (1 + 0.294 tan^2 a); 5.2, 1, 1.4 (1 + 0.294 tan^2 a); and
0.58 [ln(2 h/w) - 0.214]. All are for plane strain; plane stress follows by exchange of constants. Contact makes
the deflection grow less than in proportion to the load. Torsion of the gear body is not part of the method.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry import Pair, Profile
from gearbench.lumped.errors import LumpedError
from gearbench.rig import Material, Rig

Array = NDArray[np.float64]

NODES = 40
MOST_STEPS = 60
# Contact points that are evaluated one by one; more of them are interpolated from a table.
MOST_POINTS, TABLE = 4096, 2049


@dataclass(frozen=True)
class Constants:
    """Young's modulus [Pa] and Poisson's ratio with which formulas of plane strain are evaluated."""

    youngs: float
    poisson: float

    @property
    def compliance(self) -> float:
        """(1 - nu^2)/E [1/Pa]."""
        return (1 - self.poisson**2) / self.youngs


@dataclass(frozen=True)
class ToothDeflection:
    """Linear parts per force [m/N] and depth of the axis below the contact [m], one value a contact point (n,)."""

    tooth: Array
    foundation: Array
    depth: Array


def constants(material: Material) -> Constants:
    """Those of the material in plane strain; in plane stress E (1 + 2 nu)/(1 + nu)^2 and nu/(1 + nu), with which
    plane strain gives plane stress (Timoshenko and Goodier, Theory of Elasticity, art. 17)."""
    e, nu = material.youngs_modulus, material.poisson
    if material.state == "plane-strain":
        return Constants(e, nu)
    return Constants(e * (1 + 2 * nu) / (1 + nu) ** 2, nu / (1 + nu))


def beam(
    reach: Array, height: Array, half: Array, weight: Array, alpha: Array, *, elastic: Constants, width: float
) -> Array:
    """Tooth part (n,) [m/N]: `reach` (n,) is u, `height`, `half`, `weight` (n, k) the sections 0 <= y <= u."""
    thickness = 2 * half
    second = 12 * (weight * (reach[:, None] - height) ** 2 / thickness**3).sum(axis=1)
    first = (weight / thickness).sum(axis=1)
    shape = second + (2.4 / (1 - elastic.poisson) + np.tan(alpha) ** 2) * first
    return np.cos(alpha) ** 2 * elastic.compliance / width * shape


def foundation(reach: Array, chord: float, alpha: Array, *, elastic: Constants, width: float) -> Array:
    """Foundation part (n,) [m/N] under a tooth whose root chord is `chord` [m]."""
    nu, lever = elastic.poisson, reach / chord
    shape = (
        18 / pi * lever**2 + 2 * (1 - 2 * nu) / (1 - nu) * lever + 4.8 / pi * (1 + (1 - nu) / 2.4 * np.tan(alpha) ** 2)
    )
    return np.cos(alpha) ** 2 * elastic.compliance / width * shape


def flattening(depth: Array, half_width: Array, elastic: Constants, width: float) -> Array:
    """Approach of a point `depth` [m] below a Hertz contact of `half_width` [m], per force (n,) [m/N]."""
    nu = elastic.poisson
    return 2 * elastic.compliance / (pi * width) * (np.log(2 * depth / half_width) - nu / (2 * (1 - nu)))


def tooth_deflection(tooth: Profile, material: Material, width: float, rho: ArrayLike) -> ToothDeflection:
    """Linear deflection of one tooth at the involute points of roll length `rho` (n,) [m]."""
    rho = np.atleast_1d(np.asarray(rho, dtype=float))
    elastic = constants(material)
    alpha = rho / tooth.base_radius - tooth.psi_b
    contact = tooth.involute(rho)
    root = tooth.fillet(np.zeros(1))[0]
    reach = contact[:, 0] - contact[:, 1] * np.tan(alpha) - root[0]
    height, half, weight = _sections(tooth, reach)
    return ToothDeflection(
        tooth=beam(reach, height, half, weight, alpha, elastic=elastic, width=width),
        foundation=foundation(reach, 2 * root[1], alpha, elastic=elastic, width=width),
        depth=contact[:, 1] / np.cos(alpha),
    )


def _sections(tooth: Profile, reach: Array) -> tuple[Array, Array, Array]:
    """Heights above the root, half thicknesses and weights (n, k) up to each `reach` [m]; fillet and involute
    are integrated apart, because the curvature jumps between them."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    nodes, weights = 0.5 * (nodes + 1), 0.5 * weights
    outline = _outline(tooth)
    bottom = outline[0, 0]
    join = tooth.involute(np.array([tooth.rho_form]))[0, 0] - bottom
    lower = np.clip(reach, 0.0, join)
    upper = np.maximum(reach - join, 0.0)
    height = np.concatenate((lower[:, None] * nodes, join + upper[:, None] * nodes), axis=1)
    weight = np.concatenate((lower[:, None] * weights, upper[:, None] * weights), axis=1)
    half = np.interp(height + bottom, outline[:, 0], outline[:, 1])
    return height, half, weight


def _outline(tooth: Profile) -> Array:
    """Points (k, 2) of the outline from the root to the end of the involute, close enough to join by lines."""
    # The fillet leaves the root circle flat: equal steps of beta would leave gaps in x, their squares do not.
    beta = tooth.beta_form * np.linspace(0.0, 1.0, 4001) ** 2
    rho = np.linspace(tooth.rho_form, tooth.rho_end, 4001)
    points = np.concatenate((tooth.fillet(beta), tooth.involute(rho)[1:]))
    rising = np.concatenate(([True], np.diff(np.maximum.accumulate(points[:, 0])) > 0))
    return points[rising]


def pair_deflection(rig: Rig, meshing: Pair, rho_driver: ArrayLike, force: ArrayLike) -> Array:
    """Deflection (n,) [m] of one tooth pair under `force` [N] along the line of action.

    `rho_driver` [m] are the driver's roll lengths of the contact; both broadcast. No force, no deflection.
    """
    rho, load = np.broadcast_arrays(np.atleast_1d(np.asarray(rho_driver, dtype=float)), np.asarray(force, dtype=float))
    if np.any(load < 0) or not np.all(np.isfinite(load)):
        raise LumpedError(f"force of a tooth pair = {float(np.min(load)):g} N must be finite and at least 0 N")
    linear, depths = _linear(rig, meshing, rho)
    return load * linear + _contact(rig, meshing, rho, depths, load)


def _linear(rig: Rig, meshing: Pair, rho: Array) -> tuple[Array, list[Array]]:
    """Compliance (n,) [m/N] of both teeth and foundations, and both depths [m]; many points are interpolated."""
    if rho.size > MOST_POINTS:
        table = np.linspace(float(rho.min()), float(rho.max()), TABLE)
        linear, depths = _linear(rig, meshing, table)
        return np.interp(rho, table, linear), [np.interp(rho, table, depth) for depth in depths]
    width, mate = meshing.face_width, meshing.line_of_action - rho
    one = tooth_deflection(meshing.driver, rig.material, width, rho)
    two = tooth_deflection(meshing.driven, rig.material, width, mate)
    return one.tooth + one.foundation + two.tooth + two.foundation, [one.depth, two.depth]


def _contact(rig: Rig, meshing: Pair, rho: Array, depths: list[Array], load: Array) -> Array:
    """Approach (n,) [m] of both teeth by Hertz contact."""
    elastic, width = constants(rig.material), meshing.face_width
    radius = rho * (meshing.line_of_action - rho) / meshing.line_of_action
    loaded = np.where(load > 0, load, 1.0)  # any: no load makes no approach
    half_width = np.sqrt(8 * loaded * radius * elastic.compliance / (pi * width))
    return load * sum(flattening(depth, half_width, elastic, width) for depth in depths)


def pair_stiffness(rig: Rig, meshing: Pair, rho_driver: ArrayLike, force: ArrayLike) -> Array:
    """Secant stiffness (n,) [N/m] of one tooth pair under `force` > 0 [N]."""
    load = np.asarray(force, dtype=float)
    if np.any(load <= 0):
        raise LumpedError(f"force of a tooth pair = {float(load.min()):g} N must be greater than 0 N for a stiffness")
    return load / pair_deflection(rig, meshing, rho_driver, load)


def mesh_deflection(rig: Rig, meshing: Pair, phase: ArrayLike, force: float) -> Array:
    """Deflection (n,) [m] of the pairs on the path of contact at the mesh `phase` (n,) [cycles], all of which
    deflect alike and share `force` [N] along the line of action (bodies couple the pairs in no way)."""
    if not (np.isfinite(force) and force > 0):
        raise LumpedError(f"force of the mesh = {force:g} N must be greater than 0 N")
    phase = np.atleast_1d(np.asarray(phase, dtype=float))
    first, last = meshing.active_driver
    cycle = phase - np.floor(phase)
    count = int(np.ceil((last - first) / meshing.base_pitch)) + 1
    start = np.ceil((first - meshing.rho_pitch[0]) / meshing.base_pitch - cycle)
    own = cycle + start + np.arange(count)[:, None]
    rho = meshing.rho_pitch[0] + own * meshing.base_pitch
    inside = rho <= last
    rho = np.where(inside, rho, first)
    linear, depths = _linear(rig, meshing, rho.ravel())
    linear, depths = linear.reshape(rho.shape), [depth.reshape(rho.shape) for depth in depths]
    share = inside / inside.sum(axis=0)
    for _ in range(MOST_STEPS):
        # Secant compliances change slowly with load, so the shares settle in a few steps.
        load = force * share
        secant = linear + _contact(rig, meshing, rho, depths, np.maximum(load, 1e-9 * force)) / np.maximum(
            load, 1e-9 * force
        )
        stiff = inside / secant
        new = stiff / stiff.sum(axis=0)
        if np.abs(new - share).max() < 1e-13:
            break
        share = new
    return np.asarray(force / stiff.sum(axis=0))

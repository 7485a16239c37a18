"""Departures of a rig from the nominal one: every number that the force residuals take besides the nominal model.

Each field is a slot. Unknowns move slots, each its own part, and linearly: that is all that an effect has to say of the
model, and all that the Jacobian has to know of an effect.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.basis import KNOTS, SHAPE_ORDERS
from gearbench.diagnosis.forces.equations import DELAYED, Equation

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Departures:
    """Departures from the nominal rig in one condition of N samples and K bins, SI; all zero: the nominal rig.

    Arrays over gears are driver, driven. Supports: logarithms `stiffness`, `damping` of the factors on both, `mass`
    (relative), `exponent` of the spring's hardening; `radial` (4,) logarithms of the factors on the radial
    supports' stiffnesses and dampings. Rotation: `inertia` (3,) relative, of driver, driven gear and rotor;
    `coupling` [rad/(N m)] compliance added at the drive; `torque` (K,) spectrum [N m] of what acts there besides
    the recorded torque. Mesh: `scale`, `mesh_ratio` logarithms of the factors on stiffness and damping ratio;
    `shape` (2 orders,) relative stiffness and `profile` (2 orders,) [m] excess material by mesh orders, cosine and
    sine in turn; `offset` [m] excess material; `excess` (N,) [m] excess material that all pairs share and `pitch`
    (z1 + z2,) [m] that of each tooth, all on the working flanks; `closed` (N,) [m] by how much the gears are closer to
    each other there, and farther on the back flanks; `turned` (N,) [cycles] how far the mesh is turned on; `levers`
    (3, N) by what part the mesh force's levers about the driver's axis, along the supports and about the driven gear's
    axis are longer; `loss` (z1 + z2,) part of each tooth's bending stiffness that is lost; `curvature` exponent of the
    mesh force over its level; `dissipation` [N s^2/m^2]; `friction` coefficient; `backlash` [m]; `yielding` (2 knots,)
    compliance of webs and shafts over that of the mesh, real then imaginary part. `delay` (4,) [s] of the sensors
    of `equations.DELAYED`; `filters` (4, 2 knots) parts of the mesh force, by frequency, that each equation misses.
    """

    stiffness: Array
    damping: Array
    mass: Array
    exponent: Array
    radial: Array
    inertia: Array
    coupling: float
    torque: Complex
    scale: float
    mesh_ratio: float
    shape: Array
    profile: Array
    offset: float
    excess: Array
    closed: Array
    turned: Array
    levers: Array
    pitch: Array
    loss: Array
    curvature: float
    dissipation: float
    friction: float
    backlash: float
    yielding: Array
    delay: Array
    filters: Array


# Shapes of the slots; (): a number. Slots that are given in their own place, and not by a few numbers, have none.
_KNOTS = len(KNOTS)
SHAPES: dict[str, tuple[int, ...]] = {
    "stiffness": (2,),
    "damping": (2,),
    "mass": (2,),
    "exponent": (2,),
    "radial": (4,),
    "inertia": (3,),
    "coupling": (),
    "scale": (),
    "mesh_ratio": (),
    "shape": (2 * SHAPE_ORDERS,),
    "profile": (2 * SHAPE_ORDERS,),
    "offset": (),
    "curvature": (),
    "dissipation": (),
    "friction": (),
    "backlash": (),
    "yielding": (2 * _KNOTS,),
    "delay": (len(DELAYED),),
    "filters": (len(Equation), 2 * _KNOTS),
}
TOOTH_SLOTS = ("pitch", "loss")  # (z1 + z2,)

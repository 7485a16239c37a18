"""Orders of the driver's rotation at which the load bears a torque that the drive's record does not hold.

Where inertias carry little, both gears' balances tell it without a law of the mesh:

    dT = [(1 + JR s^2 H) rb1 F - T1 + (JR + (1 + JR s^2 H) J1) s^2 theta1] / T,   F from the load's balance,

JR being the rotor behind the coupling's compliance H, over the mean torque T.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

KNOWN = 0.03  # how well gains of torque sensors and inertias are known, at most
CERTAIN = 5.0  # times what these explain, by which an order must stand out


def missing_orders(model: NominalModel, conditions: Sequence[Condition], least: float) -> Array:
    """Torque over the mean torque (orders,) that the drive lacks at orders 1, 2, .. of the driver below the mesh, the
    least of all conditions; zero where that is below `least` or what nominal numbers may err by, and nothing for
    records without the load's torque."""
    if not conditions or any("torque_driven" not in one.spectra for one in conditions):
        return np.zeros(0)
    # Beyond the mesh's frequency the drive's own resonances are as little known as its torque.
    order = np.arange(1, min(model.teeth[0], *((one.bins - 1) * one.teeth[0] // one.cycles + 1 for one in conditions)))
    if not order.size:
        return np.zeros(0)
    found = np.min([_missing(model, one, order) for one in conditions], axis=0)
    return np.where(found >= least, found, 0.0)


def _missing(model: NominalModel, condition: Condition, order: Integers) -> Array:
    """The same (orders,) in one condition; zero where it is uncertain, or no more than what other lines lack."""
    own = order * condition.cycles // condition.teeth[0]
    line = np.arange(1, own[-1] + 1)
    s, (rb1, rb2) = 1j * condition.omega[line], model.base_radius
    drive = 1 + model.rotor * s**2 * model.coupling_compliance(condition.omega[line])
    torque, force = condition.spectra["torque_driver"][line], rb1 * condition.force_full[line]
    turning = (model.rotor + drive * model.inertia[0]) * s**2 * condition.spectra["angle_driver"][line] / rb1
    taken = model.inertia[1] * s**2 * condition.spectra["angle_driven"][line] * rb1 / rb2**2
    missing = np.abs(drive * force - torque + turning)
    noise = condition.noise["torque_driver"] + condition.noise["torque_driven"] * (rb1 / rb2) ** 2
    force, torque, turning, taken = (np.abs(part) for part in (force, torque, turning, taken))
    doubt = np.sqrt(KNOWN**2 * (force**2 + torque**2 + turning**2 + taken**2) + noise) + np.median(missing)
    # Where inertias carry most of it, so do errors of whatever moves them; and what is excited is no ripple.
    still = (np.maximum(turning, taken) < force) & (torque < missing)
    lacking = 2 * np.where((missing > CERTAIN * doubt) & still, missing, 0.0) / abs(condition.torque_mean)
    return np.asarray(lacking[own - 1])

"""The background of a fit as a rig: the nominal case recalibrated, without any effect."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import SIDES, Fitted, with_rig
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.rig import Case, Rig

Array = NDArray[np.float64]

MOST_RATIO = 0.49  # damping ratio that the mesh of a rig may have


def recalibrated(nominal: Case, fitted: Fitted) -> Case:
    """The nominal case with supports, masses, inertias and mesh as the fit has them, and no effect."""
    rig, model = nominal.rig, fitted.model
    supports = {}
    gears = {}
    for i, side in enumerate(SIDES):
        support, gear = getattr(rig.support, side), getattr(rig, side)
        stiffness = model.stiffness[i] * np.exp(fitted.of("stiffness")[i])
        damping = model.damping[i] * np.exp(fitted.of("damping")[i])
        supports[side] = support.model_copy(update={"stiffness": float(stiffness), "damping": float(damping)})
        mass = model.mass[i] * (1 + fitted.of("mass")[i])
        inertia = model.inertia[i] * (1 + fitted.of("inertia")[i])
        gears[side] = gear.model_copy(update={"mass": float(mass), "inertia": float(inertia)})
    update: dict[str, object] = {"support": rig.support.model_copy(update=supports), **gears}
    if rig.drive.coupling is not None:
        rotor = model.rotor * (1 + fitted.of("inertia")[2])
        coupling = rig.drive.coupling.model_copy(update={"inertia": float(rotor)})
        update["drive"] = rig.drive.model_copy(update={"coupling": coupling})
    ratio = model.mesh_ratio * np.exp(fitted.of("mesh-ratio")[0])
    update["damping"] = rig.damping.model_copy(update={"mesh_ratio": float(min(ratio, MOST_RATIO))})
    update["mesh"] = rig.mesh.model_copy(update=_mesh(rig, model, fitted))
    return with_rig(nominal, rig.model_copy(update=update))


def added(old: tuple[float, ...], new: Array) -> tuple[float, ...]:
    """Amplitudes at the orders 1, 2, .. with others (n,) added, as a field of a rig holds them."""
    total = np.zeros(max(len(old), len(new)))
    total[: len(old)] += old
    total[: len(new)] += new
    return tuple(float(value) for value in total)


def _mesh(rig: Rig, model: NominalModel, fitted: Fitted) -> dict[str, object]:
    """Fields of the mesh correction: nominal plus what the fit adds."""
    shape, profile = fitted.of("shape"), fitted.of("profile")
    offset = fitted.of("offset")[0] if "offset" in fitted.unknowns.slices else 0.0
    return {
        "stiffness_scale": float(model.scale * np.exp(fitted.of("scale")[0])),
        "stiffness_cos": added(rig.mesh.stiffness_cos, shape[0::2]),
        "stiffness_sin": added(rig.mesh.stiffness_sin, shape[1::2]),
        "error_mean": float(rig.mesh.error_mean + offset),
        "error_cos": added(rig.mesh.error_cos, profile[0::2]),
        "error_sin": added(rig.mesh.error_sin, profile[1::2]),
    }

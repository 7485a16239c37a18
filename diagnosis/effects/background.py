"""The background of every rig: what the nominal case leaves open, with how well it is known.

Its priors are the uncertainties that the case states, else the documented defaults of `forces.nominal`; those that no
case can state are numbers of this file, set on the development family (benchmarks/diagnosis_log.md).
"""

from __future__ import annotations

import numpy as np

from gearbench.diagnosis.effects.effect import SIDES
from gearbench.diagnosis.forces.basis import KNOTS, SHAPE_ORDERS
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, group

OFFSET = 0.8  # excess material of all pairs over the deflection of the mesh: the zero of the angles is not known better
SHAPE = 0.04  # of the stiffness, at each mesh order: tables of finite elements against a meshed rig
# Compliance of webs and shafts over that of the mesh: little at low frequencies, where it cannot be told from the
# mesh's own stiffness.
YIELDING = 0.01 + 0.07 * np.minimum(1.0, (np.array(KNOTS) / 0.4) ** 2)
RADIAL = 0.6  # logarithm, of stiffness and damping of radial supports: nothing is stated about them
# Bounds, of logarithms and exponents: beyond them no rig is like the nominal one.
RATIO_BOUND, SCALE_BOUND, RADIAL_BOUND = 3.0, 0.5, 2.5


def background(model: NominalModel) -> tuple[Group, ...]:
    """Supports, masses, inertias and mesh of the nominal model, each as uncertain as it is stated."""
    complex_knots = [f"{part}@{knot:g}" for part in ("re", "im") for knot in KNOTS]
    inertia = np.array((*model.sd_inertia, model.sd_rotor))
    return (
        group("stiffness", "1", SIDES, np.array(model.sd_stiffness), slot="stiffness"),
        _bounded("damping", SIDES, np.array(model.sd_damping), RATIO_BOUND),
        group("mass", "1", SIDES, np.array(model.sd_mass), slot="mass"),
        group("inertia", "1", (*SIDES, "rotor"), inertia, slot="inertia"),
        _bounded("scale", ("mesh",), model.sd_scale, SCALE_BOUND),
        _bounded("mesh-ratio", ("mesh",), model.sd_mesh_ratio, RATIO_BOUND),
        group("offset", "m", ("excess",), OFFSET * model.deflection, slot="offset"),
        group("shape", "1", 2 * SHAPE_ORDERS, SHAPE, slot="shape"),
        group("compliance", "1", complex_knots, np.tile(YIELDING, 2), slot="yielding"),
        _bounded("radial", ("k1", "k2", "c1", "c2"), RADIAL, RADIAL_BOUND),
    )


def _bounded(key: str, names: tuple[str, ...], sd: float | np.ndarray, bound: float) -> Group:
    return group(key, "1", names, sd, slot=key.replace("-", "_"), low=-bound, high=bound)

"""The layout of all unknowns for a rig and its conditions, with the priors of background and of effects.

The widths of the effects are those of rigs worth diagnosing; the widths of the background are a tenth of them, what
good rigs have of everything. Both are documented numbers, not fitted ones.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.basis import KNOTS, SHAPE_ORDERS
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import Machine
from gearbench.diagnosis.forces.parameters import NUISANCE, Layout, block, layout

Array = NDArray[np.float64]

RIPPLE_ORDERS = (6, 12, 18, 24)  # per driver revolution: what commutation and slots of usual motors leave
ROWS = ("drive", "driver-support", "load", "driven-support")
# Of both gears: row, channel, sign of the support's force in it, and the unknown of its exponent.
SUPPORTS = ((1, "y_driver", -1.0, "bearing-driver"), (3, "y_driven", 1.0, "bearing-driven"))
DELAYED = ("angle_driver", "angle_driven", "y_driver", "y_driven")


def unknowns(machine: Machine, conditions: Sequence[Condition]) -> Layout:
    """All unknowns of the force residuals of these conditions."""
    z1, z2 = machine.teeth
    complex_knots = [f"{part}@{knot:g}" for part in ("re", "im") for knot in KNOTS]
    ripple = [
        f"{condition.name}:{order}:{part}"
        for condition in conditions
        for order in RIPPLE_ORDERS
        for part in ("cos", "sin")
    ]
    torque = float(np.mean([condition.torque_mean for condition in conditions]))
    gear = 1.0 / (1.0 / max(machine.rotor, 1e-12) + 1.0 / machine.inertia[0])
    quadratic = _quadratic(machine, conditions)
    # Little at low frequencies, where it cannot be told from the mesh's own stiffness.
    yielding = 0.01 + 0.07 * np.minimum(1.0, (np.array(KNOTS) / 0.4) ** 2)

    def softness(frequency: float) -> float:
        return 1.0 / (gear * (2 * np.pi * frequency) ** 2)

    inertia = np.array((*machine.sd_inertia, machine.sd_rotor))
    blocks = [
        block("stiffness", NUISANCE, "1", ("driver", "driven"), np.array(machine.sd_stiffness)),
        block("damping", NUISANCE, "1", ("driver", "driven"), np.array(machine.sd_damping), low=-3.0, high=3.0),
        block("mass", NUISANCE, "1", ("driver", "driven"), np.array(machine.sd_mass)),
        block("inertia", NUISANCE, "1", ("driver", "driven", "rotor"), inertia),
        block("scale", NUISANCE, "1", ("mesh",), machine.sd_scale, low=-0.5, high=0.5),
        block("mesh-ratio", NUISANCE, "1", ("mesh",), machine.sd_mesh_ratio, low=-3.0, high=3.0),
        block("offset", NUISANCE, "m", ("excess",), 5e-6),
        block("curvature", NUISANCE, "1", ("mesh",), 0.05, low=-0.3, high=0.3),
        block("shape", NUISANCE, "1", 2 * SHAPE_ORDERS, 0.04),
        block("profile", NUISANCE, "m", 2 * SHAPE_ORDERS, 0.5e-6),
        block("compliance", NUISANCE, "1", complex_knots, np.tile(yielding, 2)),
        block("radial", NUISANCE, "1", ("k1", "k2", "c1", "c2"), 0.6, low=-2.5, high=2.5),
        *(block(f"filter-{row}", f"free-{row}", "1", complex_knots, 0.03, 1.0) for row in ROWS),
        block("dissipation", "free-dissipation", "N s2/m2", ("quadratic",), quadratic, 20 * quadratic),
        block("friction", "friction", "1", ("coefficient",), 0.004, 0.06),
        block("eccentricity-driver", "eccentricity-driver", "m", ("cos", "sin"), 0.3e-6, 3e-6),
        block("eccentricity-driven", "eccentricity-driven", "m", ("cos", "sin"), 0.3e-6, 3e-6),
        block("pitch-driver", "pitch-driver", "m", z1, 0.25e-6, 2.5e-6),
        block("pitch-driven", "pitch-driven", "m", z2, 0.25e-6, 2.5e-6),
        block("crack", "tooth-contrast", "1", z1 + z2, 0.02, 0.35, low=-2.0, high=0.9),
        block("coupling", "coupling", "rad/(N m)", ("compliance",), softness(6e3), softness(1.3e3), low=0.0),
        block("bearing-driver", "bearing-driver", "1", ("exponent",), 0.03, 0.35, low=-0.8, high=2.0),
        block("bearing-driven", "bearing-driven", "1", ("exponent",), 0.03, 0.35, low=-0.8, high=2.0),
        *(block(f"delay-{c}", f"delay-{c}", "s", ("delay",), 4e-6, 60e-6) for c in DELAYED),
        block("ripple", "torque-ripple", "N m", ripple, 0.0006 * torque, 0.006 * torque),
        block("backlash", "backlash", "m", ("more",), 8e-6, 80e-6),
    ]
    return layout(blocks)


def _quadratic(machine: Machine, conditions: Sequence[Condition]) -> float:
    """Force [N s2/m2] of rate times its size that equals a tenth of the mesh's linear damping at 30 mm/s."""
    level = float(np.mean([condition.stiffness_level for condition in conditions]))
    return 0.1 * 2 * machine.mesh_ratio * float(np.sqrt(level * machine.mesh_mass)) / 0.03

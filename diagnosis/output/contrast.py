"""How far the stiffness of the mesh changes over its phase, as an unknown: by more or less than the nominal tables say.

Pairs in contact at once share the compliance of bodies, rims and webs. The more of all compliance that is, the less a
second pair stiffens the mesh; the less, the more the stiffness of a mesh changes over its phase.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import changed
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, Unknowns, group
from gearbench.rig import Rig

Array = NDArray[np.float64]

# Over the nominal change: none at -1; discs with webs and rims against solid ones differ by some tenths.
CONTRAST, CONTRAST_SD, CONTRAST_LEAST, CONTRAST_LARGEST = "contrast", 0.12, -0.5, 0.6
CONTRAST_NAME = "change of the mesh stiffness over its phase, beyond the nominal one over it"
ORDERS = 16  # of the mesh: a pair comes and goes within a sixteenth of its cycle


def contrast_groups() -> list[Group]:
    """The one mesh."""
    return [group(CONTRAST, "1", ("mesh",), CONTRAST_SD, slot="contrast", low=CONTRAST_LEAST, high=CONTRAST_LARGEST)]


def modulation_of(model: NominalModel) -> Array:
    """Cosine and sine amplitudes (2, ORDERS) of the nominal mesh's stiffness over its mean, at the mean torque."""
    law = model.hardened
    phases = np.arange(law.phases) / law.phases
    force = abs(model.torque_mean) / model.base_radius[0] / model.scale
    depth = law.approach[1:, None]
    forces, tangents = law.evaluate(depth, phases)
    stiffness = np.array([np.interp(force, forces[:, i], tangents[:, i]) for i in range(law.phases)])
    lines = 2.0 * np.fft.rfft(stiffness / stiffness.mean())[1 : ORDERS + 1] / law.phases
    return np.stack([lines.real, -lines.imag])


def modulated(modulation: Array, phase: Array) -> Array:
    """That change over the mean stiffness at mesh phases (n,) [cycles], (n,)."""
    angle = 2 * np.pi * np.arange(1, modulation.shape[1] + 1)[:, None] * phase
    return np.asarray(modulation[0] @ np.cos(angle) + modulation[1] @ np.sin(angle))


def contrasted(rig: Rig, modulation: Array, unknowns: Unknowns, p: Array) -> Rig:
    """The rig with the change of its mesh stiffness enlarged."""
    more = float(p[unknowns[CONTRAST]][0])
    if not more:
        return rig
    series = {}
    for name, part in zip(("stiffness_cos", "stiffness_sin"), modulation, strict=True):
        before = getattr(rig.mesh, name)
        total = np.zeros(max(len(before), len(part)))
        total[: len(before)] += before
        total[: len(part)] += more * part
        series[name] = tuple(float(value) for value in total)
    return changed(rig, "mesh", **series)

"""How far the stiffness of the mesh changes over its phase, as an unknown: by more or less than the nominal tables say.

Pairs in contact at once share the compliance of bodies, rims and webs. The more of all compliance that is, the less a
second pair stiffens the mesh; the less, the more the stiffness of a mesh changes over its phase.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.diagnosis.effects.effect import changed
from gearbench.diagnosis.effects.recalibrated import added
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, Unknowns, group
from gearbench.rig import Rig

Array = NDArray[np.float64]

# Over the nominal change: none at -1; discs with webs and rims against solid ones differ by some tenths.
CONTRAST, CONTRAST_SD, CONTRAST_LEAST, CONTRAST_LARGEST = "contrast", 0.12, -0.5, 0.6
CONTRAST_NAME = "change of the mesh stiffness over its phase, beyond the nominal one over it"
BEYOND = 2.0  # standard deviations, from which other flanks are tried
ORDERS = 16  # of the mesh: a pair comes and goes within a sixteenth of its cycle


def contrast_groups() -> list[Group]:
    """The one mesh."""
    return [group(CONTRAST, "1", ("mesh",), CONTRAST_SD, slot="contrast", low=CONTRAST_LEAST, high=CONTRAST_LARGEST)]


def is_strange(unknowns: Unknowns, p: Array) -> bool:
    """Whether the mesh stiffness of unknowns (size,) changes as that of no body, rim or web does, so that the flanks
    may be others."""
    return bool(abs(p[unknowns[CONTRAST]][0]) > BEYOND * CONTRAST_SD) if CONTRAST in unknowns.slices else False


def other_flanks(unknowns: Unknowns, p: Array) -> tuple[str, ...]:
    """A sentence where the change of the mesh stiffness ends at its bound: no body, rim or web does that."""
    more = float(p[unknowns[CONTRAST]][0])
    if CONTRAST_LEAST < more < CONTRAST_LARGEST:
        return ()
    return (
        f"The stiffness of the mesh would have to change over its phase by {'less' if more < 0.0 else 'more'} than"
        f" {1.0 + more:g} of what the nominal teeth make: check whether reliefs and profiles are those of the rig",
    )


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


def series_at(cosine: ArrayLike, sine: ArrayLike, phase: Array) -> tuple[Array, Array]:
    """A series in the mesh phase, of amplitudes (orders,), at phases (n,) [cycles], and its growth a cycle (n,)."""
    a, b = np.asarray(cosine, dtype=float), np.asarray(sine, dtype=float)
    orders = 2 * np.pi * np.arange(1, len(a) + 1)
    c, s = np.cos(orders[:, None] * phase), np.sin(orders[:, None] * phase)
    return np.asarray(a @ c + b @ s), np.asarray((orders * b) @ c - (orders * a) @ s)


def contrasted(rig: Rig, modulation: Array, unknowns: Unknowns, p: Array) -> Rig:
    """The rig with the change of its mesh stiffness enlarged."""
    more = float(p[unknowns[CONTRAST]][0])
    if not more:
        return rig
    cosine, sine = (added(old, more * part) for old, part in
                    zip((rig.mesh.stiffness_cos, rig.mesh.stiffness_sin), modulation, strict=True))  # fmt: skip
    return changed(rig, "mesh", stiffness_cos=cosine, stiffness_sin=sine)

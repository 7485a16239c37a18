"""An elastic coupling between the drive's rotor and the driver, which the nominal rig takes for rigid, or for another
than it is."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, hypot, pi, sqrt

import numpy as np

from gearbench.diagnosis.effects.effect import BEYOND, Added, Effect, Estimate, Fitted, Hypothesis, Wide, changed
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.residuals import LOSS_FACTOR
from gearbench.diagnosis.forces.unknowns import Group, Unknowns, group
from gearbench.rig import Rig
from gearbench.rig.drive import Coupling

KEY = "coupling"
# Logarithm of its loss factor over that of the case, or the one that the residuals assume, where unknowns have it:
# rubber and steel differ.
LOSS = "coupling-loss"
# Resonance of the rotor against the driver over that of the mesh: a stiff one lies far above, one worth a diagnosis
# near or below it (truth rigs: 3.9 to 5.8, and 0.5 to 1.6).
RIGID, ELASTIC = 3.1, 0.67
# Part of a stated compliance that another coupling may lack: two and a half times as stiff.
STIFFER = 0.6
# Compliances to begin from, as squares of a stiff one's resonance over the coupling's: a half of it to a seventh.
RATIOS = (2.0, 2.7, 3.6, 4.8, 6.5)


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """Compliance beyond the nominal one, which a sound rig has as far as that is uncertain; of one that is stated some
    may be missing."""
    reduced = _reduced(model.rotor, model.inertia[0])

    def compliance(resonance: float) -> float:
        return 1.0 / (reduced * (2 * np.pi * resonance * model.resonance) ** 2)

    sd = hypot(compliance(RIGID), model.compliance * model.sd_compliance)
    wide = max(compliance(ELASTIC), BEYOND * sd)
    return (group(KEY, "rad/(N m)", ("compliance",), sd, wide, slot="coupling", low=-STIFFER * model.compliance),)


def is_stated(unknowns: Unknowns) -> bool:
    """Whether the nominal rig has an elastic coupling, so that there is one whatever its unknown is."""
    return KEY in unknowns.slices and unknowns.group(KEY).low < 0.0


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """The drive has one coupling, if there is a rotor to swing on it."""
    return (Hypothesis("coupling", "drive", (Wide(KEY),)),) if model.rotor > 0.0 else ()


def starts(group: Group) -> tuple[float, ...]:
    """Compliances that move the resonance through the band."""
    stiff = min(group.sd[0], group.wide[0] * (ELASTIC / RIGID) ** 2)
    return tuple(stiff * ratio**2 for ratio in RATIOS)


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Gives the drive a coupling of the whole compliance, with the loss factor of the case, or the one that the
    residuals assume, or its own."""
    model = fitted.model
    total = model.compliance + float(fitted.of(KEY)[0])
    std = float(fitted.std_of(KEY)[0])
    rotor = model.rotor * (1 + fitted.of("inertia")[2])
    reduced = _reduced(rotor, model.inertia[0] * (1 + fitted.of("inertia")[0]))
    stiffness = 1 / total
    resonance = np.sqrt(stiffness / reduced) / (2 * pi)
    loss = _loss_factor(model) * (exp(float(fitted.of(LOSS)[0])) if LOSS in fitted.unknowns.slices else 1.0)
    damping = loss * stiffness / (2 * pi * resonance)
    coupling = Coupling(inertia=float(rotor), stiffness=float(stiffness), damping=float(damping))
    return changed(rig, "drive", coupling=coupling), (
        Estimate("stiffness", stiffness, stiffness * std / total, "N m/rad"),
        Estimate("resonance", float(resonance), float(0.5 * resonance * std / total), "Hz"),
    )


def _reduced(rotor: float, driver: float) -> float:
    """Inertia [kg m2] by which the two swing against each other."""
    return 1.0 / (1.0 / max(rotor, 1e-12) + 1.0 / driver)


def _loss_factor(model: NominalModel) -> float:
    """That of the case's coupling at its resonance; the residuals' where it states no damping."""
    reduced = _reduced(model.rotor, model.inertia[0])
    return model.coupling_damping * sqrt(model.compliance / reduced) or LOSS_FACTOR


COUPLING = Effect(
    name="coupling",
    noun="another stiffness of the coupling",
    meaning="The motor's rotor swings against the driver: the torque measured at the motor is not the one at the gear."
    " Check the coupling's stiffness.",
    parameters={"stiffness": "torsional stiffness", "resonance": "resonance of rotor against driver"},
    fields=("rig.drive.coupling.stiffness", "rig.drive.coupling.damping"),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
    starts=starts,
)

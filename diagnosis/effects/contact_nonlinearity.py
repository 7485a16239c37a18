"""Teeth that stiffen or soften with their load otherwise than the nominal mesh does."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from gearbench.diagnosis.effects.effect import Added, Effect, Estimate, Fitted, Hypothesis, Wide, changed
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, group
from gearbench.rig import Rig

KEY = "curvature"
# Exponent of the mesh force over its own: teeth stiffen a little as their contacts widen, and far more where flanks
# bear on a part of their width: a point contact has one half.
SD, WIDE, LEAST, LARGEST = 0.08, 0.25, -0.4, 0.8
# The same where it is simulated: force residuals have other errors in its place. Of 53 drawn rigs without the effect,
# whose pairs have an exponent of another law than the nominal teeth's, 50 have 0.068 at most, 0.03 rms.
SD_SIMULATED = 0.04


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """The exponent, over the force under the nominal mean torque."""
    return (group(KEY, "1", ("mesh",), SD, WIDE, slot="curvature", low=LEAST, high=LARGEST),)


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """The one mesh."""
    return (Hypothesis("contact-nonlinearity", "mesh", (Wide(KEY),)),)


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Gives the mesh the exponent that was fitted."""
    exponent = fitted.model.hardening + float(fitted.of(KEY)[0])
    rig = changed(rig, "mesh", exponent=exponent, reference_force=fitted.model.reference_force)
    # What sound rigs seem to have is no part of the effect: eight of drawn rigs are off by 0.053 rms.
    return rig, (Estimate("exponent", exponent, hypot(float(fitted.std_of(KEY)[0]), SD_SIMULATED), "1", signed=True),)


CONTACT_NONLINEARITY = Effect(
    name="contact-nonlinearity",
    noun="a contact that stiffens with its load",
    meaning="The mesh grows stiffer (with an exponent below zero: softer) with its load than its teeth do: check how"
    " far the flanks bear over the face width, crowning and alignment, and what else yields in the line of the force.",
    parameters={"exponent": "exponent of the mesh force over that of the nominal teeth"},
    fields=("rig.mesh.exponent", "rig.mesh.reference_force"),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
)

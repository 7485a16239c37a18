"""Friction between the flanks beyond that of the nominal rig: Coulomb's, turning round at the pitch point."""

from __future__ import annotations

from collections.abc import Sequence

from gearbench.diagnosis.effects.effect import Added, Effect, Estimate, Fitted, Hypothesis, Wide, changed
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, group
from gearbench.rig import Rig

KEY = "friction"
# Coefficient: 0.06 is a usual value of lubricated steel flanks, and severity 1 of the truth rigs of `challenge`. Their
# sound rigs have 5 to 12 % of it, those of another author up to 23 % (benchmarks/diagnosis_log.md).
SD, WIDE = 0.005, 0.06


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """The coefficient beyond the nominal one; bounds: none, as a slightly negative one stands for its error."""
    return (group(KEY, "1", ("coefficient",), SD, WIDE, slot="friction"),)


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """One coefficient for all teeth."""
    return (Hypothesis("friction", "mesh", (Wide(KEY),)),)


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Moves the rig's coefficient, within what a rig may have."""
    mu = rig.friction.coefficient + float(fitted.of(KEY)[0])
    rig = changed(rig, "friction", coefficient=min(max(mu, 0.0), 1.0))
    return rig, (Estimate("coefficient", mu, float(fitted.std_of(KEY)[0]), "1"),)


FRICTION = Effect(
    name="friction",
    noun="friction between the flanks",
    meaning="Sliding teeth push the gears along the flanks, one way before the pitch point and the other way after it:"
    " check oil, temperature and the roughness of the flanks.",
    parameters={"coefficient": "coefficient of friction"},
    fields=("rig.friction.coefficient",),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
    always=True,  # it trades with the shape of the mesh stiffness, so that the background's quadratic misses it
    model_error=0.17,  # rms on the calibration family (benchmarks/diagnosis_log.md)
)

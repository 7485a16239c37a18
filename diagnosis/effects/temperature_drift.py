"""A stiffness that drifts while a record is taken, as it does where a rig warms up.

No repetition is like another then. What differs is what the rig's derivative by that stiffness says
(`diagnosis.remainder.drift`), so that it is read off between repetitions and not searched for among forces.
"""

from __future__ import annotations

from gearbench.diagnosis.effects.effect import Added, Effect, Fitted, Hypothesis
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.rig import Rig


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """None that forces could weigh."""
    return ()


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """The rig as it is on the mean of a record, which the other effects were found on; that of a mesh that drifts is
    simulated with rig.mesh.stiffness_drift."""
    return rig, ()


TEMPERATURE_DRIFT = Effect(
    name="temperature-drift",
    noun="a stiffness that drifts",
    meaning="The rig grows softer or stiffer while it is measured: wait until it is warm, log its temperature beside"
    " the record, or measure shorter records with more repetitions.",
    parameters={"stiffness_drift": "change of the stiffness from the first sample to the last, over itself"},
    fields=(),
    hypotheses_of=hypotheses,
    add=add,
    model_error=0.06,  # of -0.070 on a rig of the calibration family; benchmarks/diagnosis_log.md
)

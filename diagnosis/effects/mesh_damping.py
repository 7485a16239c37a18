"""Damping in the mesh far from the nominal one: by more than the nominal uncertainty makes likely."""

from __future__ import annotations

from math import exp, log

from gearbench.diagnosis.effects.effect import BEYOND, Added, Effect, Estimate, Fitted, Hypothesis, Wide, changed
from gearbench.diagnosis.effects.recalibrated import MOST_RATIO
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.rig import Rig

KEY = "mesh-ratio"  # of the background: logarithm of the factor on the damping ratio
# Logarithm: measured ratios lie between 0.03 and 0.17 (as collected by Lin, Huston and Coy 1988), a factor of two or so
# about the usual 0.07; at least five standard deviations of the nominal one, or the prior would not be a wider
# one.
WIDE, WIDER = log(2.0), 5.0


def deviation(model: NominalModel) -> float:
    """Standard deviation of the logarithm where it is simulated. What is known so badly has no three deviations of the
    logarithm where it has three of its own."""
    return log(1.0 + BEYOND * model.sd_mesh_ratio) / BEYOND


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """The one mesh."""
    return (Hypothesis("mesh-damping", "mesh", (Wide(KEY, 0, max(WIDE, WIDER * model.sd_mesh_ratio)),)),)


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Gives the mesh the damping ratio that was fitted."""
    ratio = min(fitted.model.mesh_ratio * exp(fitted.of(KEY)[0]), MOST_RATIO)
    std = ratio * float(fitted.std_of(KEY)[0])
    return changed(rig, "damping", mesh_ratio=ratio), (Estimate("ratio", ratio, std, "1"),)


MESH_DAMPING = Effect(
    name="mesh-damping",
    noun="another damping of the mesh",
    meaning="Vibration of the teeth dies out far faster or slower than in the nominal rig: check oil, its temperature"
    " and level, and the nominal value itself.",
    parameters={"ratio": "damping ratio of the mesh"},
    fields=("rig.damping.mesh_ratio",),
    hypotheses_of=hypotheses,
    add=add,
    least_size=BEYOND,
    model_error=0.12,  # four drawn rigs: how it goes with the load is another law (benchmarks/diagnosis_log.md)
)

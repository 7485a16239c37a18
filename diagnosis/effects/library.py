"""The library: every effect that the diagnosis searches for, and all unknowns together."""

from __future__ import annotations

from collections.abc import Sequence

from gearbench.diagnosis.effects.background import background
from gearbench.diagnosis.effects.backlash import BACKLASH
from gearbench.diagnosis.effects.bearing_nonlinearity import BEARING_NONLINEARITY
from gearbench.diagnosis.effects.contact_nonlinearity import CONTACT_NONLINEARITY
from gearbench.diagnosis.effects.coupling import COUPLING
from gearbench.diagnosis.effects.eccentricity import ECCENTRICITY
from gearbench.diagnosis.effects.effect import Effect, Hypothesis
from gearbench.diagnosis.effects.encoder_runout import ENCODER_RUNOUT
from gearbench.diagnosis.effects.free_forms import unknowns as free_unknowns
from gearbench.diagnosis.effects.friction import FRICTION
from gearbench.diagnosis.effects.mesh_damping import MESH_DAMPING
from gearbench.diagnosis.effects.pitch_error import PITCH_ERROR
from gearbench.diagnosis.effects.profile_error import PROFILE_ERROR
from gearbench.diagnosis.effects.sensor_delay import SENSOR_DELAY
from gearbench.diagnosis.effects.support_stiffness import SUPPORT_STIFFNESS
from gearbench.diagnosis.effects.temperature_drift import TEMPERATURE_DRIFT
from gearbench.diagnosis.effects.tooth_crack import TOOTH_CRACK
from gearbench.diagnosis.effects.torque_ripple import TORQUE_RIPPLE
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Unknowns, unknowns_of

# In the order of their unknowns.
LIBRARY: tuple[Effect, ...] = (
    FRICTION,
    ECCENTRICITY,
    PITCH_ERROR,
    TOOTH_CRACK,
    COUPLING,
    BEARING_NONLINEARITY,
    SENSOR_DELAY,
    TORQUE_RIPPLE,
    BACKLASH,
    SUPPORT_STIFFNESS,
    MESH_DAMPING,
    CONTACT_NONLINEARITY,
    PROFILE_ERROR,
    ENCODER_RUNOUT,
)
# What is read off between repetitions.
CHANGING: tuple[Effect, ...] = (TEMPERATURE_DRIFT,)


def hypotheses(model: NominalModel, without: Sequence[str] = ()) -> tuple[Hypothesis, ...]:
    """Every single effect, but for those named in `without`, in every place where it may be."""
    return tuple(one for effect in LIBRARY if effect.name not in without for one in effect.hypotheses(model))


def all_unknowns(model: NominalModel, conditions: Sequence[Condition]) -> Unknowns:
    """All unknowns of these conditions: background, free forms and effects."""
    groups = [*background(model), *free_unknowns(model, conditions)]
    for effect in LIBRARY:
        groups += effect.unknowns(model, conditions)
    return unknowns_of(groups, sum(model.teeth))

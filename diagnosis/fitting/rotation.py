"""What moves the lines of the rotation alone: a search for structure, which answers the excitation, leaves it aside."""

from __future__ import annotations

from gearbench.diagnosis.effects.eccentricity import KEYS as RUNOUTS
from gearbench.diagnosis.effects.encoder_runout import KEYS as ENCODERS
from gearbench.diagnosis.effects.pitch_error import KEYS as PITCHES
from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.effects.torque_ripple import KEY as RIPPLE

ROTATION = (*RUNOUTS.values(), *PITCHES.values(), CRACK, RIPPLE, *ENCODERS.values())

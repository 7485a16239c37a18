"""The plant as flat arrays: what compiled code reads fastest. Each constant is the place of a field's first number."""

from __future__ import annotations

from itertools import accumulate

import numpy as np

from gearbench.challenge.truth.plant import Array, Plant

# Names and sizes of the numbers, in their order.
_SIZES = {
    "base_driver": 1,
    "base_driven": 1,
    "base_pitch": 1,
    "roll_pitch": 1,
    "line_of_action": 1,
    "sine": 1,
    "cosine": 1,
    "speed_driver": 1,
    "speed_driven": 1,
    "inertia": 4,
    "mass": 2,
    "support": 4,
    "support_damping": 4,
    "support_exponent": 4,
    "support_reference": 4,
    "mode_mass": 2,
    "mode_stiffness": 2,
    "mode_damping": 2,
    "mode_shape": 8,
    "sensor_on_housing": 1,
    "coupling": 4,
    "shaft": 2,
    "governor": 2,
    "load_torque": 1,
    "eccentricity": 2,
    "eccentricity_angle": 2,
    "ripple": 8,
    "ripple_order": 1,
    "tone": 3,
    "drift": 4,
}
_OF_TEETH = (
    "first",
    "pitch",
    "exponent",
    "reference",
    "backlash",
    "damping",
    "damping_load",
    "damping_onset",
    "damping_quadratic",
    "friction",
    "friction_speed",
    "friction_shape",
)
_ENDS = list(accumulate(_SIZES.values()))
_AT = dict(zip(_SIZES, [0, *_ENDS], strict=False))

BASE_DRIVER = _AT["base_driver"]
BASE_DRIVEN = _AT["base_driven"]
BASE_PITCH = _AT["base_pitch"]
ROLL_PITCH = _AT["roll_pitch"]
LINE_OF_ACTION = _AT["line_of_action"]
SINE = _AT["sine"]
COSINE = _AT["cosine"]
SPEED_DRIVER = _AT["speed_driver"]
SPEED_DRIVEN = _AT["speed_driven"]
INERTIA = _AT["inertia"]
MASS = _AT["mass"]
SUPPORT = _AT["support"]
SUPPORT_DAMPING = _AT["support_damping"]
SUPPORT_EXPONENT = _AT["support_exponent"]
SUPPORT_REFERENCE = _AT["support_reference"]
MODE_MASS = _AT["mode_mass"]
MODE_STIFFNESS = _AT["mode_stiffness"]
MODE_DAMPING = _AT["mode_damping"]
MODE_SHAPE = _AT["mode_shape"]
SENSOR_ON_HOUSING = _AT["sensor_on_housing"]
COUPLING = _AT["coupling"]
SHAFT = _AT["shaft"]
GOVERNOR = _AT["governor"]
LOAD_TORQUE = _AT["load_torque"]
ECCENTRICITY = _AT["eccentricity"]
ECCENTRICITY_ANGLE = _AT["eccentricity_angle"]
RIPPLE = _AT["ripple"]
RIPPLES = _SIZES["ripple"] // 2
RIPPLE_ORDER = _AT["ripple_order"]
TONE = _AT["tone"]
DRIFT = _AT["drift"]
(
    TABLE_FIRST,
    TABLE_PITCH,
    PAIR_EXPONENT,
    PAIR_REFERENCE,
    BACKLASH,
    PAIR_DAMPING,
    PAIR_DAMPING_LOAD,
    PAIR_DAMPING_ONSET,
    PAIR_DAMPING_QUADRATIC,
    FRICTION,
    FRICTION_SPEED,
    FRICTION_SHAPE,
) = range(_ENDS[-1], _ENDS[-1] + len(_OF_TEETH))

# Columns of the table over the position of a pair.
STIFFNESS, SHARE_DRIVER, SHARE_DRIVEN, EXCESS = range(4)

# That table; excess and loss/(1 - loss) of each tooth of the driver, and of the driven gear (z, 2).
Mesh = tuple[Array, Array, Array]


def pack(plant: Plant) -> tuple[Array, Mesh]:
    """Numbers of the plant in one array, and those of its teeth."""
    parts = []
    for name, size in _SIZES.items():
        part = np.ravel(np.asarray(getattr(plant, name), dtype=float))
        if part.size != size:
            raise ValueError(f"{name} of the plant has {part.size} numbers, not {size}")
        parts.append(part)
    teeth = plant.teeth
    parts.append(np.array([float(getattr(teeth, name)) for name in _OF_TEETH]))
    table = np.stack([teeth.stiffness, teeth.share_driver, teeth.share_driven, teeth.excess], axis=1)
    one = np.stack([teeth.error_driver, teeth.crack_driver], axis=1)
    two = np.stack([teeth.error_driven, teeth.crack_driven], axis=1)
    return np.concatenate(parts), (np.ascontiguousarray(table), np.ascontiguousarray(one), np.ascontiguousarray(two))

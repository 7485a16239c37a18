"""The truth rig as numbers: ten coordinates, individual tooth pairs, everything that its equations read.

It shares no equation of motion with the model that diagnosis searches with: the mesh is a set of tooth pairs with
a gap and a law each, both gears move in x and y, the rotor sits behind a coupling, the load behind a shaft, and
the supports stand on a housing with modes of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Coordinates: angles are departures [rad] from steady rotation; modal amplitudes of the housing [m].
COORDINATES = ("rotor", "driver", "driven", "load", "x_driver", "y_driver", "x_driven", "y_driven", "mode_1", "mode_2")
DEGREES = len(COORDINATES)
# The state: coordinates, their rates, and the elastic twist of the coupling [rad].
STATES = 2 * DEGREES + 1
# Places of the coordinates; those of their rates are DEGREES further on.
ROTOR, DRIVER, DRIVEN, LOAD, X_DRIVER, Y_DRIVER, X_DRIVEN, Y_DRIVEN, MODE_1, MODE_2 = range(DEGREES)
TWIST = 2 * DEGREES


class Seen(NamedTuple):
    """What the integrator hands out."""

    angle_driver: float  # departure [rad]
    angle_driven: float
    y_driver: float  # as the displacement sensors see it [m]
    y_driven: float
    torque_driven: float  # in the load shaft [N m]
    force: float  # normal force of the working flanks [N]
    dte: float  # transmission error [m]


OUTPUTS = Seen._fields


class Teeth(NamedTuple):
    """The tooth pairs. Position v of a pair is its distance from the pitch point in base pitches.

    Tables (n,) over v from `first` in steps of `pitch`: stiffness [N/m] at `reference` deflection, shares of that
    pair's compliance in the bending of the driver's and the driven tooth, and excess material [m] (profile error; ends
    of the path of contact as a growing gap). `error_*` (z,) excess [m] and `crack_*` (z,) loss/(1 - loss) of each
    tooth. The elastic force is stiffness x deflection x (deflection/reference)^exponent.
    """

    first: float
    pitch: float
    stiffness: Array
    share_driver: Array
    share_driven: Array
    excess: Array
    error_driver: Array
    error_driven: Array
    crack_driver: Array
    crack_driven: Array
    exponent: float
    reference: float
    backlash: float  # along the line of action [m]
    damping: float  # force per rate and tangent stiffness [s]
    damping_load: float  # part of it that grows with the deflection, 0..1
    damping_onset: float  # deflection [m] up to which it rises from zero; 0: at once
    damping_quadratic: float  # [s^2/m]: damping x |rate| besides
    friction: float
    friction_speed: float  # [m/s]
    friction_shape: int  # 0: tanh; 1: v/sqrt(v^2 + v0^2)


class Inertias(NamedTuple):
    """Of what turns [kg m^2]."""

    rotor: float
    driver: float
    driven: float
    load: float


class Gears(NamedTuple):
    """A number of each gear."""

    driver: float
    driven: float


class Coupling(NamedTuple):
    """Between rotor and driver."""

    stiffness: float  # [N m/rad]
    damping: float  # [N m s/rad]
    limit: float  # torque [N m] beyond which it slips; 0: never
    slip: float  # damping of the slip [N m s/rad]


class Spring(NamedTuple):
    """A torsional spring with its damper."""

    stiffness: float  # [N m/rad]
    damping: float  # [N m s/rad]


class Tone(NamedTuple):
    """A torque on the rotor beside the excitation."""

    amplitude: float  # [N m]
    frequency: float  # [rad/s]
    phase: float


class Drift(NamedTuple):
    """Relative change of stiffnesses over the record, and its duration [s]."""

    mesh: float
    driver: float  # of the driver's supports
    driven: float
    duration: float


class Plant(NamedTuple):
    """All numbers of the equations of motion, SI. Arrays of four are x_driver, y_driver, x_driven, y_driven."""

    teeth: Teeth
    base_driver: float
    base_driven: float
    base_pitch: float
    roll_pitch: float  # roll length of the driver at the pitch point
    line_of_action: float  # sum of both roll lengths
    sine: float  # of the working pressure angle
    cosine: float
    speed_driver: float  # steady, [rad/s]
    speed_driven: float
    inertia: Inertias
    mass: Gears  # [kg]
    support: Array  # (4,) [N/m]
    support_damping: Array  # (4,)
    support_exponent: Array  # (4,)
    support_reference: Array  # (4,) [m]
    mode_mass: Array  # (2,)
    mode_stiffness: Array  # (2,)
    mode_damping: Array  # (2,)
    mode_shape: Array  # (2, 4) motion of the four supports
    sensor_on_housing: float  # 1: y channels are relative to the housing; 0: to the ground
    coupling: Coupling
    shaft: Spring  # between driven gear and load
    governor: Spring  # what holds the load's speed
    load_torque: float
    eccentricity: Gears  # [m]
    eccentricity_angle: Gears  # polar angle of the geometric centre at rotation 0
    ripple: Array  # (orders, 2) cosine and sine amplitudes [N m] at ripple_order, 2 ripple_order, ... of the rotor
    ripple_order: float
    tone: Tone
    drift: Drift

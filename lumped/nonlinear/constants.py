"""Numbers of the non-linear lumped model's equations of motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Constants(NamedTuple):
    """Numbers that the integrator needs. Inverse masses [1/kg] are 0 for coordinates that do not move."""

    inverse_u1: float
    inverse_u2: float
    inverse_w: float
    inverse_y1: float
    inverse_y2: float
    rigid: float  # 1: torque acts on the gear, 0: on the rotor
    shaft_stiffness: float  # S [N/m]
    shaft_damping: float  # D [N s/m]
    factor: float  # g
    slide: float  # sin(a), a being the angle from the supports' direction to the line of action
    stiffness1: float  # [N/m]
    stiffness2: float
    damping1: float  # [N s/m]
    damping2: float
    exponent1: float
    exponent2: float
    reference1: float  # [m]
    reference2: float
    damping_factor: float  # 2 zeta sqrt(m_e) [kg^1/2]
    damping_exponent: float  # of the elastic force
    damping_pliancy: float  # over its reference [1/N]
    backlash: float  # [m]
    root: float  # grid steps per root of deflection [m^-1/2]
    mirror: float  # phase at which back flanks pass the pitch point, in rows of the force table
    nudge: float  # d [N s/m] of the force d (v - u1') on the driver, v being a motion that is given
    leaning: float  # rows of the force table by which the mesh turns back where the centres' motion closes it by 1 m


class Rubbing(NamedTuple):
    """Friction, as the integrator needs it. A pair `away` cycles behind the pitch point has the roll lengths rb_i
    (centre_i +- away pitch_i) and in the steady rotation the sliding velocity away drift."""

    coefficient: float
    steepness: float  # 1 / v0 [s/m]
    drift: float  # [m/s] per cycle
    centre1: float
    centre2: float
    pitch1: float
    pitch2: float
    slide: float  # sin(a_w), or 0 along the line of action
    offset: float  # of the first column of `carried`
    carried: Array  # (phases + 1, n_o), parts of the force in the mesh

"""What holds the gears of a real rig, as the integrator needs it: a shaft behind the driven gear, a housing behind the
supports, supports across, and other boundaries than those of the plain model.

    M_l o''  = S_l (u2 - o) + D_l (u2' - o') - T2/rb2       the driven gear then feels S_l (o - u2) + D_l (o' - u2')
    m_h h''  = b_i P_i + e_i Q_i - c_h h' - k_h h, over both i                               and r with d_i, f_i
    m_i x_i'' = -+ (sin(a) f - mu f s cos(a)) - Q_i                                          - driver, + driven gear
    P_i      = c_i z_i' + k_i z_i |z_i/y_ref|^e + k_ci w_i,   z_i = y_i - b_i h - d_i r      what the supports pull with
    Q_i      = c_xi w_i' + k_xi w_i + k_ci z_i,               w_i = x_i - e_i h - f_i r      across

h and r are the housing's motions, b_i and d_i the shares of them that a support makes, e_i and f_i across. a is the
angle from the supports' direction to the line of action: the working pressure angle where they are tangential, else 0.
To the deflection of the mesh x adds sin(a) (x1 - x2), and to the sliding velocity -cos(a) (x1' - x2').
"""

from __future__ import annotations

from typing import NamedTuple

from gearbench.rig import Housing, Rig, Rocking


class Moves(NamedTuple):
    """A motion of the housing: stiffness [N/m], damping [N s/m], inverse mass [1/kg], 0 where there is none, and the
    shares of it that the supports of driver and driven gear make, along their direction and across."""

    stiffness: float
    damping: float
    inverse: float
    share1: float
    share2: float
    across1: float
    across2: float


STANDS = Moves(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Structure(NamedTuple):
    """Numbers that the integrator needs beyond `Constants`. Inverse masses [1/kg] are 0 for what does not move."""

    load_stiffness: float  # S_l [N/m]
    load_damping: float  # D_l [N s/m]
    inverse_load: float
    rigid_load: float  # 1: the load acts on the gear, 0: behind the shaft
    held: float  # 1: the load's speed is prescribed and its torque a reaction
    follow: float  # part of the driver's torque that the load balances at any time
    constant: float  # part of the mean torque that it balances
    balance: float  # part of the friction that it makes up for
    housing: Moves
    rocking: Moves
    inverse_x1: float
    inverse_x2: float
    stiffness1: float  # k_x [N/m]
    stiffness2: float
    damping1: float  # c_x [N s/m]
    damping2: float
    coupling1: float  # k_c [N/m]
    coupling2: float


def driven_turns(rig: Rig) -> bool:
    """Whether the driven gear is free to depart from its steady rotation."""
    return rig.load.boundary != "speed" or rig.load.twists


def has_structure(rig: Rig) -> bool:
    """Whether a rig needs the further coordinates or boundaries."""
    other = rig.load.boundary == "inertia" or rig.drive.boundary == "speed"
    return rig.support.move_across or rig.housing is not None or rig.load.twists or other


def structure_of(rig: Rig, masses: tuple[float, float], outer: float, base_radius: float) -> Structure | None:
    """The structure of a rig, None where it has none. masses (m_1, m_2) of the gears and `outer` M_l [kg]; base_radius
    of the driven gear [m]."""
    if not has_structure(rig):
        return None
    shaft, housing, square = rig.load.coupling, rig.housing, base_radius**2
    elastic = rig.load.twists
    one, two = rig.support.driver.across, rig.support.driven.across
    return Structure(
        load_stiffness=shaft.stiffness / square if shaft is not None and shaft.stiffness is not None else 0.0,
        load_damping=shaft.damping / square if shaft is not None else 0.0,
        inverse_load=1.0 / outer if elastic and rig.load.boundary != "speed" else 0.0,
        rigid_load=0.0 if elastic else 1.0,
        held=1.0 if rig.load.boundary == "speed" else 0.0,
        follow=1.0 if rig.load.boundary == "torque" and rig.turns_freely else 0.0,
        constant=1.0 if rig.load.boundary == "inertia" or rig.drive.boundary == "speed" else 0.0,
        balance=1.0 if rig.turns_freely else 0.0,
        housing=_moves(housing),
        rocking=_moves(housing.rocking if housing is not None else None),
        inverse_x1=1.0 / masses[0] if one is not None else 0.0,
        inverse_x2=1.0 / masses[1] if two is not None else 0.0,
        stiffness1=one.stiffness if one is not None else 0.0,
        stiffness2=two.stiffness if two is not None else 0.0,
        damping1=one.damping if one is not None else 0.0,
        damping2=two.damping if two is not None else 0.0,
        coupling1=one.coupling if one is not None else 0.0,
        coupling2=two.coupling if two is not None else 0.0,
    )


def _moves(one: Housing | Rocking | None) -> Moves:
    if one is None:
        return STANDS
    return Moves(
        one.stiffness,
        one.damping,
        1.0 / one.mass,
        one.driver_share,
        one.driven_share,
        one.driver_share_across,
        one.driven_share_across,
    )

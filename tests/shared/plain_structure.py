"""Equations of motion of a rig with all its structure, written in vectors and radians from what the parts are, and
nothing else: bodies, shafts, springs, and forces on flanks where the pairs touch."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin, tanh

import numpy as np
from numpy.typing import NDArray
from shared.effect_rig import GEARS, MASSES, ZETA
from shared.hat_mesh import ALPHA, BASE_PITCH, BEND, PITCH_ROLL, RADII, TOP, hat, stiffness

from gearbench.rig import Coupling, Housing, Rig, Rocking, Support

Array = NDArray[np.float64]

NORMAL, FLANK = np.array([sin(ALPHA), cos(ALPHA)]), np.array([-cos(ALPHA), sin(ALPHA)])
# From the gears' centres to where the line of action touches their base circles.
FOOT1, FOOT2 = RADII[0] * np.array([cos(ALPHA), -sin(ALPHA)]), RADII[1] * np.array([-cos(ALPHA), sin(ALPHA)])
# Rotor, driver, driven gear, load [rad]; housing, then driver and driven gear along and across their supports, and the
# housing as it rocks [m].
UNKNOWNS = ("rotor", "driver", "driven", "load", "housing", "y1", "x1", "y2", "x2", "rocking")


def turned(point: Array) -> Array:
    """Velocity of a point under an anti-clockwise rotation of 1 rad/s about the origin."""
    return np.array([-point[1], point[0]])


def moment(point: Array, force: Array) -> float:
    """Anti-clockwise moment of a force about the origin."""
    return float(point[0] * force[1] - point[1] * force[0])


def twist(shaft: Coupling | None, angle: float, rate: float) -> float:
    """Moment that an elastic shaft passes on."""
    return 0.0 if shaft is None or shaft.stiffness is None else shaft.stiffness * angle + shaft.damping * rate


def pull(support: Support, y: float, vy: float, x: float, vx: float) -> tuple[float, float]:
    """Forces of a support along and across, against deflections and rates."""
    along = support.stiffness * y * (abs(y) / support.reference_deflection) ** support.exponent + support.damping * vy
    a = support.across
    return (along, 0.0) if a is None else (along + a.coupling * x, a.stiffness * x + a.damping * vx + a.coupling * y)


def shares(part: Housing | Rocking) -> Array:
    """Shares (2, 2) of a motion of the housing: of both supports, along and across."""
    return np.array([[part.driver_share, part.driver_share_across], [part.driven_share, part.driven_share_across]])


def lift(rig: Rig, d: Array) -> Array:
    """How far (2, 2) the housing carries both supports along and across."""
    out = np.zeros((2, 2))
    if rig.housing is not None:
        for k, part in ((4, rig.housing), (9, rig.housing.rocking)):
            if part is not None:
                out = out + d[k] * shares(part)
    return out


def plain_rates(rig: Rig, frequency: float, torque: Callable[[float], float], mean: float) -> Callable[..., Array]:
    """Right-hand side for UNKNOWNS and their rates, all departures from the steady rotation, at a mesh frequency [Hz]
    and a driver torque [N m] of that mean."""
    (r1, r2), speeds = RADII, (2 * pi * frequency / 20, 2 * pi * frequency / 30)
    tangential = rig.support.direction == "tangential"
    along, aside = np.array([[0.0, 1.0], [1.0, 0.0]]) if tangential else np.array([NORMAL, -FLANK])
    rotor, brake = rig.drive.coupling, rig.load.coupling
    inertias = GEARS[0] + (rotor.inertia if rotor else 0.0), GEARS[1] + (brake.inertia if brake else 0.0)
    loose = rotor is not None and rotor.stiffness is not None, brake is not None and brake.stiffness is not None
    own = GEARS[0] if loose[0] else inertias[0], GEARS[1] if loose[1] else inertias[1]
    masses = {
        ("speed", "torque"): inertias[1] / r2**2,
        ("torque", "speed"): inertias[0] / r1**2,
    }
    shared = 1 / (r1**2 / inertias[0] + r2**2 / inertias[1])
    m_e = masses.get((rig.drive.boundary, rig.load.boundary), shared)

    def flanks(t: float, d: Array, v: Array) -> tuple[Array, float, float, float, float]:
        """Force on the driven gear, moments with the rotations of driver and driven gear, and losses of those."""
        centre1, centre2 = d[5] * along + d[6] * aside, d[7] * along + d[8] * aside
        speed1, speed2 = v[5] * along + v[6] * aside, v[7] * along + v[8] * aside
        delta = r1 * d[1] - r2 * d[2] + float((centre1 - centre2) @ NORMAL)
        closing = r1 * v[1] - r2 * v[2] + float((speed1 - speed2) @ NORMAL)
        if delta <= 0:
            return np.zeros(2), 0.0, 0.0, 0.0, 0.0
        # Seen from the line of centres, which their motion turns, the driven gear turns back.
        tilt = (d[5] - d[7]) * cos(ALPHA) / sum(RADII) if tangential else 0.0
        phase = frequency * t - r2 * tilt / BASE_PITCH
        k = float(stiffness(phase)) * rig.mesh.stiffness_scale
        tangent = k * (1 + 1.5 * BEND * (delta / TOP) ** 0.5)
        press = max(k * delta * (1 + BEND * (delta / TOP) ** 0.5) + 2 * ZETA * (tangent * m_e) ** 0.5 * closing, 0.0)
        total, with1, with2, lost1, lost2 = press * NORMAL, -press * r1, press * r2, 0.0, 0.0
        for n in range(int(np.floor(phase)) - 1, int(np.floor(phase)) + 3):
            path = (phase - n) * BASE_PITCH
            at1, at2 = FOOT1 + (PITCH_ROLL[0] + path) * NORMAL, FOOT2 - (PITCH_ROLL[1] - path) * NORMAL
            point1 = speed1 + (speeds[0] + v[1]) * turned(at1)
            point2 = speed2 - (speeds[1] + v[2]) * turned(at2)
            slides = tanh(float((point1 - point2) @ FLANK) / rig.friction.transition_speed)
            rub = rig.friction.coefficient * press * float(hat(phase - n)) * slides * FLANK  # on the driven gear
            total = total + rub
            lost1 += moment(at1, rub)
            lost2 -= moment(at2, rub)
        return total, with1 - lost1, with2 + lost2, lost1, lost2

    def rates(t: float, q: Array) -> Array:
        d, v = q[:10], q[10:]
        force, with1, with2, lost1, lost2 = flanks(t, d, v)
        first, second = twist(rotor, d[0] - d[1], v[0] - v[1]), twist(brake, d[2] - d[3], v[2] - v[3])
        (y, x), (vy, vx) = (d[[5, 7]], d[[6, 8]]) - lift(rig, d).T, (v[[5, 7]], v[[6, 8]]) - lift(rig, v).T
        one = pull(rig.support.driver, y[0], vy[0], x[0], vx[0])
        two = pull(rig.support.driven, y[1], vy[1], x[1], vx[1])
        driving = torque(t)
        # What both ends leave free is held in the mean by the load, which makes up for the losses.
        load = r2 / r1 * (driving if rig.load.boundary == "torque" else mean)
        if rig.drive.boundary == "speed":
            load = r2 / r1 * mean
        else:
            load += lost2 - r2 / r1 * lost1
        a = np.zeros(10)
        if rig.drive.boundary != "speed":
            a[0] = (driving - first) / rotor.inertia if loose[0] and rotor else 0.0
        if loose[0] or rig.drive.boundary != "speed":
            a[1] = ((first if loose[0] else driving) + with1) / own[0]
        if loose[1] or rig.load.boundary != "speed":
            a[2] = (with2 - (second if loose[1] else load)) / own[1]
        if loose[1] and rig.load.boundary != "speed" and brake:
            a[3] = (second - load) / brake.inertia
        if rig.housing is not None:
            for k, part in ((4, rig.housing), (9, rig.housing.rocking)):
                if part is not None:
                    push = float((shares(part) * [one, two]).sum())
                    a[k] = (push - part.stiffness * d[k] - part.damping * v[k]) / part.mass
        for k, support, sign, mass, held in (
            (5, rig.support.driver, -1, MASSES[0], one),
            (7, rig.support.driven, 1, MASSES[1], two),
        ):
            a[k] = (sign * float(force @ along) - held[0]) / mass
            if support.across is not None:
                a[k + 1] = (sign * float(force @ aside) - held[1]) / mass
        return np.concatenate([v, a])

    return rates

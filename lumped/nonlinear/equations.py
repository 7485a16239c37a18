"""The equations of motion at an instant, compiled; `lumped.nonlinear.model` and `structure` have them in words.

Further coordinates e, their rates r and the structure are empty tuples for a rig without structure, so are the pairs of
teeth that are alike, and friction is None for a rig without: the compiler knows, so that the plain model costs nothing
for what it does not have. They are
typed Any where mypy cannot follow the lengths of tuples.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import INLINED, ROUNDING, compiled
from gearbench.lumped.nonlinear.constants import Constants, Rubbing
from gearbench.lumped.nonlinear.coordinates import Coordinates, Further
from gearbench.lumped.nonlinear.forces import Apart, Entry, Rubbed, friction, mesh, spring, turned_on
from gearbench.lumped.nonlinear.structure import Structure

Array = NDArray[np.float64]


class Equations(NamedTuple):
    """All that the equations of motion hold beside table and torque. free: 1 where nothing holds the rotation of both
    gears together; mean: that of the driver's torque over its base radius [N]."""

    secant: Array
    apart: Apart | tuple[()]
    constants: Constants
    rubbing: Rubbing | None
    structure: Structure | tuple[()]
    free: float
    mean: float
    drive_end: float = 0.0
    load_end: float = 0.0


class Answer(NamedTuple):
    """What the equations of motion give: accelerations [m/s^2] and forces on the base circles [N]."""

    acceleration: Coordinates
    further: Further | tuple[()]
    mesh_force: float
    load_force: float
    drive_force: float


class Felt(NamedTuple):
    """Forces [N] of the mesh, on both base circles, along and across the supports; of the driver's coupling and of the
    torque on the driver; what nudges the driver; and friction as in `Rubbed` but as a force."""

    mesh: float
    driver: float
    driven: float
    along: float
    across: float
    shaft: float
    drive: float
    nudge: float
    rubbed: Rubbed


@compiled(fastmath=ROUNDING, **INLINED)
def _travel(q: Coordinates, e: Any, at: Entry, p: Constants) -> float:
    """What the coordinates q and e, or their rates, close the mesh by."""
    turned = (1.0 + at.lever1) * q.u1 - (1.0 + at.lever2) * q.u2
    travel = turned + (p.factor + at.tilt * p.slide) * (q.y1 - q.y2)
    if len(e) == 0:
        return travel
    return travel + (p.slide - at.tilt * p.factor) * (e.x1 - e.x2)


@compiled(fastmath=ROUNDING, **INLINED)
def _felt(f: float, shaft: float, drive: float, nudge: float, rubbed: Rubbed, at: Entry, p: Constants) -> Felt:
    """The forces of a mesh pressed by f; what run-out turns is known of the working flanks."""
    part = 1.0 if f > 0.0 else 0.0
    return Felt(
        mesh=f,
        driver=f * (1.0 + part * at.lever1),
        driven=f * (1.0 + part * at.lever2),
        along=f * (p.factor + part * at.tilt * p.slide),
        across=f * (p.slide - part * at.tilt * p.factor),
        shaft=shaft,
        drive=drive,
        nudge=nudge,
        rubbed=rubbed,
    )


@compiled(fastmath=ROUNDING, **INLINED)
def _plain(q: Coordinates, v: Coordinates, felt: Felt, force: float, p: Constants, free: float) -> Answer:
    """The answer of a rig without more structure."""
    push, pull, pull2 = felt.driver, felt.rubbed.driver, felt.rubbed.driven
    load = free * (force - pull - push) + felt.driven + pull2
    across = felt.along + felt.rubbed.along
    acceleration = Coordinates(
        u1=p.inverse_u1 * (p.rigid * felt.drive + felt.shaft + felt.nudge - push - pull),
        y1=p.inverse_y1 * (-across - p.damping1 * v.y1 - spring(q.y1, p.stiffness1, p.exponent1, p.reference1)),
        y2=p.inverse_y2 * (across - p.damping2 * v.y2 - spring(q.y2, p.stiffness2, p.exponent2, p.reference2)),
        u2=p.inverse_u2 * (felt.driven + pull2 - load),
        w=p.inverse_w * (felt.drive - felt.shaft),
    )
    return Answer(acceleration, (), felt.mesh, load, felt.drive)


@compiled(fastmath=ROUNDING, **INLINED)
def _structured(
    q: Coordinates, v: Coordinates, e: Further, r: Further, felt: Felt, force: float, mean: float, p: Constants,
    s: Structure,
) -> Answer:  # fmt: skip
    """The answer of a rig with structure; e, r: its further coordinates and their rates."""
    taken, given = felt.driver + felt.rubbed.driver, felt.driven + felt.rubbed.driven
    twist = s.load_stiffness * (q.u2 - e.load) + s.load_damping * (v.u2 - r.load)
    reaction = twist + s.rigid_load * given
    load = s.held * reaction + s.follow * force + s.constant * mean + s.balance * (given - taken)
    along, across = felt.along + felt.rubbed.along, felt.across - felt.rubbed.across
    h, k = s.housing, s.rocking
    y1 = q.y1 - h.share1 * e.housing - k.share1 * e.rocking
    y2 = q.y2 - h.share2 * e.housing - k.share2 * e.rocking
    u1 = v.y1 - h.share1 * r.housing - k.share1 * r.rocking
    u2 = v.y2 - h.share2 * r.housing - k.share2 * r.rocking
    x1 = e.x1 - h.across1 * e.housing - k.across1 * e.rocking
    x2 = e.x2 - h.across2 * e.housing - k.across2 * e.rocking
    w1 = r.x1 - h.across1 * r.housing - k.across1 * r.rocking
    w2 = r.x2 - h.across2 * r.housing - k.across2 * r.rocking
    one = p.damping1 * u1 + spring(y1, p.stiffness1, p.exponent1, p.reference1) + s.coupling1 * x1
    two = p.damping2 * u2 + spring(y2, p.stiffness2, p.exponent2, p.reference2) + s.coupling2 * x2
    side1 = s.damping1 * w1 + s.stiffness1 * x1 + s.coupling1 * y1
    side2 = s.damping2 * w2 + s.stiffness2 * x2 + s.coupling2 * y2
    onto_h = h.share1 * one + h.share2 * two + h.across1 * side1 + h.across2 * side2
    onto_k = k.share1 * one + k.share2 * two + k.across1 * side1 + k.across2 * side2
    acceleration = Coordinates(
        u1=p.inverse_u1 * (p.rigid * felt.drive + felt.shaft + felt.nudge - taken),
        y1=p.inverse_y1 * (-along - one),
        y2=p.inverse_y2 * (along - two),
        u2=p.inverse_u2 * (given - twist - s.rigid_load * load),
        w=p.inverse_w * (felt.drive - felt.shaft),
    )
    further = Further(
        load=s.inverse_load * (twist - load),
        housing=h.inverse * (onto_h - h.damping * r.housing - h.stiffness * e.housing),
        rocking=k.inverse * (onto_k - k.damping * r.rocking - k.stiffness * e.rocking),
        x1=s.inverse_x1 * (-across - side1),
        x2=s.inverse_x2 * (across - side2),
    )
    return Answer(acceleration, further, felt.mesh, load, felt.shaft + p.rigid * taken)


@compiled(fastmath=ROUNDING, **INLINED)
def _answered(
    q: Coordinates, v: Coordinates, e: Any, r: Any, felt: Felt, force: float, mean: float, p: Constants, s: Any,
    free: float,
) -> Answer:  # fmt: skip
    """The answer to forces that are known."""
    if len(e) == 0:
        return _plain(q, v, felt, force, p, free)
    return _structured(q, v, e, r, felt, force, mean, p, s)


@compiled(fastmath=ROUNDING, **INLINED)
def _rubbed(f: float, v: Coordinates, r: Any, at: Entry, p: Constants, rubbing: Rubbing | None) -> Rubbed:
    """Friction [N] under the normal force f."""
    if rubbing is not None and f > 0.0:  # without friction rubbing is None, known to the compiler
        per = friction(v, r, at, rubbing, p.factor)
        return Rubbed(f * per.driver, f * per.along, f * per.across, f * per.driven)
    return Rubbed(0.0, 0.0, 0.0, 0.0)


@compiled(fastmath=ROUNDING, **INLINED)
def _rigid_load(s: Any) -> float:
    """1 where the load acts on the driven gear itself."""
    return 1.0 if len(s) == 0 else s.rigid_load


@compiled(fastmath=ROUNDING, **INLINED)
def _behind(further: Any, pull: float, pushed: float, s: Any) -> Any:
    """Accelerations of further coordinates, the load's end lagging behind the rotation but for a force on it [N]."""
    if len(further) == 0:
        return ()
    lag = pull if s.inverse_load > 0.0 else 0.0
    load = further.load - lag + s.inverse_load * pushed
    return Further(load, further.housing, further.rocking, further.x1, further.x2)


@compiled(fastmath=ROUNDING, **INLINED)
def _accelerated(found: Answer, pull: float, of: Equations) -> Answer:
    """The answer in departures from a rotation that gains speed by pull [m/s^2] along the line of action: what turns
    lags behind it, what is held at its speed takes a force, and a load that balances both gears pushes."""
    p, a, pushed = of.constants, found.acceleration, of.free * of.load_end * pull
    acceleration = Coordinates(
        u1=a.u1 - pull if p.inverse_u1 > 0.0 else a.u1,
        y1=a.y1,
        y2=a.y2,
        u2=a.u2 - pull + p.inverse_u2 * _rigid_load(of.structure) * pushed if p.inverse_u2 > 0.0 else a.u2,
        w=a.w - pull if p.inverse_w > 0.0 else a.w,
    )
    load, drive = found.load_force - of.load_end * pull, found.drive_force + of.drive_end * pull
    return Answer(acceleration, _behind(found.further, pull, pushed, of.structure), found.mesh_force, load, drive)


@compiled(fastmath=ROUNDING, **INLINED)
def answer(q: Coordinates, v: Coordinates, e: Any, r: Any, at: Entry, force: float, of: Equations) -> Answer:
    """Accelerations and forces at the coordinates q and e and their rates v and r, under T1/rb1 = force [N]."""
    p, s = of.constants, of.structure
    at = turned_on(at, -p.leaning * p.factor * (q.y1 - q.y2), of.secant.shape[0] - 1, of.apart)
    f = mesh(_travel(q, e, at, p), _travel(v, r, at, p), at, of.secant, of.apart, p)
    shaft = p.shaft_stiffness * (q.w - q.u1) + p.shaft_damping * (v.w - v.u1)
    nudge = p.nudge * (at.led - v.u1)
    felt = _felt(f, shaft, force + at.ripple, nudge, _rubbed(f, v, r, at, p, of.rubbing), at, p)
    found = _answered(q, v, e, r, felt, force, of.mean, p, s, of.free)
    return found if at.pull == 0.0 else _accelerated(found, at.pull, of)

"""Where contact begins and ends on gears that run out.

A geometric centre that stands off its axis turns the line of action. With e_i the eccentricities, tau_i the rotations
of the gears beyond the phases of their run-out, a_w the working pressure angle and L = (rb1 + rb2) tan(a_w) the length
of that line between the base circles, the tangent to both displaced circles has turned, to first order, by

    phi = (e2 sin(tau2) - e1 sin(tau1)) / L

against the driven gear, whose tip, where contact begins, is early by rb2 phi on the line of action. At its end the
driver's tip stands e = e1 cos(tau1) + e2 cos(tau2) behind its place, by what the flanks stand proud, and rb1 phi behind
by what the line has turned: so far the mesh is turned back there. Between both ends it is turned linearly, and so it is
where pairs beside the one that ends have begun.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gearbench.lumped.nonlinear.model import NonLinear

Array = NDArray[np.float64]

LEAST_SPAN = 1e-3  # of the cycle, between the end of one pair and the beginning of another


class Ends(NamedTuple):
    """Where in the cycle a pair begins and, so many cycles after that, one ends; how far the mesh is turned on [cycles]
    per e [m], at the end, and per L phi [m] at the beginning and at the end."""

    begin: float
    span: float
    proud: float
    leant_begin: float
    leant_end: float


def ends_of(model: NonLinear) -> Ends:
    """Those of a model."""
    return ends_between(model.path, model.base_radii, model.law.base_pitch, model.length_of_action)


def ends_between(path: tuple[float, float], base_radii: tuple[float, float], pitch: float, line: float) -> Ends:
    """Those of a path of contact, in base pitches from the pitch point; base radii, base pitch and length of the line
    of action in m."""
    begin, end = (place % 1.0 for place in path)
    span = min(max((end - begin) % 1.0, LEAST_SPAN), 1.0 - LEAST_SPAN)
    return Ends(begin, span, -1.0 / pitch, base_radii[1] / (line * pitch), -base_radii[0] / (line * pitch))


def turnings(phases: Array, ends: Ends) -> Array:
    """How far [cycles] the mesh is turned on at phases (n,) [cycles], per e and per L phi [m] (n, 2)."""
    near = np.interp(phases, (ends.begin, ends.begin + ends.span), (0.0, 1.0), period=1.0)
    return np.stack([near * ends.proud, ends.leant_begin + near * (ends.leant_end - ends.leant_begin)], axis=1)


def aside_of(turn: Array, side: int) -> Array:
    """How far (2, n) the centre of a gear (0: driver) stands aside of the normal through its axis, against the driver's
    rotation, at its rotations (n,) [rad], per unit of the cosine and the sine of its run-out: what it adds to L phi."""
    return (1, -1)[side] * np.stack([-np.sin(turn), np.cos(turn)])


def turned_by(phases: Array, turn: Array, side: int, ends: Ends) -> Array:
    """How far a gear's run-out turns the mesh on (2, n) [cycles/m] at phases (n,) [cycles], per unit of both."""
    proud, leant = turnings(phases, ends).T
    return np.asarray(proud * np.stack([np.cos(turn), np.sin(turn)]) + leant * aside_of(turn, side))

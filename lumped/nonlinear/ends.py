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

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import compiled
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
    begin, end = (place % 1.0 for place in model.path)
    rb1, rb2 = model.base_radii
    pitch = model.law.base_pitch
    line = model.length_of_action
    span = min(max((end - begin) % 1.0, LEAST_SPAN), 1.0 - LEAST_SPAN)
    return Ends(begin, span, -1.0 / pitch, rb2 / (line * pitch), -rb1 / (line * pitch))


@compiled(inline="always")
def towards_end(cycle: float, ends: Ends) -> float:
    """How near [0 to 1] the phase in the cycle is to the end of contact, 0 being its beginning."""
    since = cycle - ends.begin
    if since < 0.0:
        since += 1.0
    return since / ends.span if since < ends.span else (1.0 - since) / (1.0 - ends.span)


@compiled
def turnings(phases: Array, ends: Ends) -> Array:
    """How far [cycles] the mesh is turned on at phases (n,) [cycles], per e and per L phi [m] (n, 2)."""
    out = np.empty((len(phases), 2))
    for n in range(len(phases)):
        near = towards_end(phases[n] - np.floor(phases[n]), ends)
        out[n, 0] = near * ends.proud
        out[n, 1] = ends.leant_begin + near * (ends.leant_end - ends.leant_begin)
    return out

"""Coordinates of the non-linear lumped model, and its states as arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Coordinates(NamedTuple):
    """The coordinates [m] that every rig has, or their rates or accelerations: rotations on the base circles of driver
    u1, driven gear u2 and rotor w, and supports."""

    u1: float
    y1: float
    y2: float
    u2: float
    w: float


class Further(NamedTuple):
    """Those of rigs with more structure: outer end of the load's shaft on the driven base circle, both motions of the
    housing, and centres across their supports."""

    load: float
    housing: float
    rocking: float
    x1: float
    x2: float


COORDINATES = len(Coordinates._fields)
FURTHER = len(Further._fields)
NAMES = (*Coordinates._fields, *Further._fields)
U1, Y1, Y2, U2, W, LOAD, HOUSING, ROCKING, X1, X2 = range(len(NAMES))  # their numbers
IN_MESH = -1  # instead of the number of a coordinate that a force acts on


class Acting(NamedTuple):
    """Forces (entries, forces) [N], each `on` (forces,) one coordinate, its number, or `IN_MESH`, and part of the
    departure `of` (forces,); departures are numbered from 0 on."""

    values: NDArray[np.floating[Any]]
    on: Integers
    of: Integers


def leaning_of(base_radii: tuple[float, float], tangential: bool) -> float:
    """How far [m] on the line of action the mesh turns back where a motion of the centres along their supports, which
    lie across the line between them (`tangential`) or along the line of action, closes it by 1 m.

    Centres that move across the line between them turn that line by gamma = (y1 - y2) / a: seen from it, the driver
    has turned on by gamma and the driven gear back, rb2 gamma on the line of action. What moves a centre along the
    line of action leaves that line where it is.
    """
    return base_radii[1] / sum(base_radii) if tangential else 0.0


def parted(values: Array) -> tuple[Coordinates, Further | tuple[()]]:
    """Coordinates of one half of a state (5,) or (10,); the further ones are empty in the shorter."""
    return Coordinates(*values[:COORDINATES]), Further(*values[COORDINATES:]) if len(values) > COORDINATES else ()

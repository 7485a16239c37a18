"""The equations of motion that records can be held against, and the channels and places that belong to them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from gearbench.rig.contract import Place


class Equation(IntEnum):
    """The equations of motion, in the order in which arrays over them are kept."""

    DRIVE = 0
    DRIVER_SUPPORT = 1
    LOAD = 2
    DRIVEN_SUPPORT = 3

    @property
    def place(self) -> Place:
        """The place at which a force missing from this equation acts, as verdicts name it."""
        return _PLACES[self]


_PLACES: dict[Equation, Place] = {
    Equation.DRIVE: "drive",
    Equation.DRIVER_SUPPORT: "driver-support",
    Equation.LOAD: "load",
    Equation.DRIVEN_SUPPORT: "driven-support",
}
# Places of arrays over the equations with the mesh, whose force enters all of them, as their last entry.
MESH = len(Equation)
PLACES: tuple[Place, ...] = (*(equation.place for equation in Equation), "mesh")


@dataclass(frozen=True)
class SupportEquation:
    """The support of gear `side` (0 driver, 1 driven): its equation, displacement channel, and the sign of its force
    there."""

    side: int
    equation: Equation
    channel: str
    sign: float


SUPPORTS = (
    SupportEquation(0, Equation.DRIVER_SUPPORT, "y_driver", -1.0),
    SupportEquation(1, Equation.DRIVEN_SUPPORT, "y_driven", 1.0),
)
# Channels whose sensors may lag, in the order of `Departures.delay`.
DELAYED = ("angle_driver", "angle_driven", "y_driver", "y_driven")

"""What stands before the driver: its boundary, a rotor behind a coupling, torque ripple."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from gearbench.rig.checks import equally_long, items_within
from gearbench.rig.value import Value, quantity

_HIGHEST_ORDER = 10_000
_LARGEST_RIPPLE = 1e6  # N m


class Coupling(Value):
    """A rotor beyond a coupling on the driver's shaft; the driver torque acts on the rotor."""

    inertia: float = quantity(unit="kg_m2", gt=0.0, le=1e6, doc="inertia of the rotor beyond the coupling")
    stiffness: float | None = quantity(
        None, "nm_per_rad", gt=0.0, doc="torsional stiffness; absent: rigid, the rotor turns with the gear"
    )
    damping: float = quantity(0.0, "nm_s_per_rad", ge=0.0, doc="torsional damping; needs a stiffness")

    @model_validator(mode="after")
    def _damps_a_spring(self) -> Coupling:
        if self.stiffness is None and self.damping:
            raise ValueError(
                f"damping_nm_s_per_rad = {self.damping:g} must be 0 while stiffness_nm_per_rad is absent:"
                " a rigid coupling damps nothing"
            )
        return self


class Ripple(Value):
    """Torque beside the commanded one: sum A_i cos(order_i theta + phase_i), theta the driver's rotation.

    It acts on the outermost inertia of the driver's shaft and is not part of the measured driver torque.
    """

    orders: tuple[int, ...] = quantity(doc="cycles of the ripple per driver revolution")
    amplitude: tuple[float, ...] = quantity(unit="nm", doc="amplitude of each order")
    phase: tuple[float, ...] = quantity(unit="deg", doc="phase of each order at rotation 0 of the driver")

    @model_validator(mode="after")
    def _one_of_each(self) -> Ripple:
        equally_long(self, ("orders", "amplitude", "phase"))
        items_within(self, "orders", 1, _HIGHEST_ORDER)
        items_within(self, "amplitude", 0.0, _LARGEST_RIPPLE)
        if len(set(self.orders)) < len(self.orders):
            raise ValueError(f"orders = {list(self.orders)} must name each order once")
        return self


class Drive(Value):
    """Boundary of the driver: the torque of the experiment, and what passes it on."""

    boundary: Literal["torque"] = quantity("torque", doc="what is imposed on the driver")
    coupling: Coupling | None = quantity(None, doc="absent: the torque acts on the gear itself")
    ripple: Ripple | None = quantity(None, doc="absent: no torque but the commanded one")

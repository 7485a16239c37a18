"""What stands before the driver and behind the driven gear: boundaries, inertias behind couplings, torque ripple."""

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


class OutputShaft(Coupling):
    """An inertia beyond a shaft on the driven gear, such as a brake's; the boundary of the load acts on the inertia."""

    inertia: float = quantity(
        0.0, "kg_m2", ge=0.0, le=1e6, doc="inertia beyond the shaft; of no effect where its speed is prescribed"
    )


# torque: what the experiment imposes; speed: constant; inertia: constant torque on a free end.
Boundary = Literal["torque", "speed", "inertia"]


class Drive(Value):
    """Boundary of the driver, at the outer end of its shaft, and what lies between.

    "torque": the experiment's torque; "inertia": its mean alone, so that there is no multisine; "speed": constant
    speed, and the mean torque acts on the load.
    """

    boundary: Boundary = quantity("torque", doc="what is imposed on the driver's shaft")
    coupling: Coupling | None = quantity(None, doc="absent: the torque acts on the gear itself")
    ripple: Ripple | None = quantity(None, doc="absent: no torque but the commanded one")

    @property
    def twists(self) -> bool:
        """Whether an elastic shaft lies between the boundary and the gear."""
        return self.coupling is not None and self.coupling.stiffness is not None


class Load(Value):
    """Boundary of the driven gear, at the outer end of its shaft, and what lies between.

    "speed": constant speed; "torque": the torque that balances the driver's at any time; "inertia": the one that
    balances the driver's mean. Where both ends turn freely it also makes up for the losses of friction.
    """

    boundary: Boundary = quantity("speed", doc="what is imposed on the driven gear's shaft")
    coupling: OutputShaft | None = quantity(None, doc="absent: the load acts on the gear itself")

    @property
    def twists(self) -> bool:
        """Whether an elastic shaft lies between the gear and the boundary."""
        return self.coupling is not None and self.coupling.stiffness is not None

    @model_validator(mode="after")
    def _end_has_inertia(self) -> Load:
        shaft = self.coupling
        if self.boundary != "speed" and shaft is not None and self.twists and not shaft.inertia:
            raise ValueError(
                f'coupling.inertia_kg_m2 = 0 must be greater than 0 while boundary = "{self.boundary}" lets the end of'
                " the elastic shaft turn freely"
            )
        return self

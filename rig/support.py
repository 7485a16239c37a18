"""What holds the gears' centres: supports along one direction and across it, and a housing behind both."""

from __future__ import annotations

from math import pi
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from gearbench.rig.value import Value, format_number, quantity

Array = NDArray[np.float64]


class Across(Value):
    """Spring and damper of one gear's centre to the ground, square to the direction of its support.

    `coupling` k_c is the stiffness between both directions, as bearings and asymmetric pedestals have it: x adds k_c x
    to the force of the support, and its deflection y adds k_c y to the force across.
    """

    stiffness: float = quantity(unit="n_per_m", gt=0.0, doc="stiffness square to the support's direction")
    damping: float = quantity(0.0, "n_s_per_m", ge=0.0, doc="damping square to the support's direction")
    coupling: float = quantity(0.0, "n_per_m", doc="stiffness that couples both directions; 0: none")


# A rigid support is a centre this many times as heavy as its gear, on a spring that gives this frequency [Hz], damped
# so much that it does not oscillate: it is no mode of the rig. A gear of 1 kg moves by less than 1e-12 m under 10 kN.
HELD_MASS = 1e10
HELD_FREQUENCY = 200.0
HELD_DAMPING_RATIO = 1.25


class Holding(NamedTuple):
    """How a centre is held: mass that moves with it [kg], stiffness [N/m] and damping [N s/m]."""

    mass: float
    stiffness: float
    damping: float


class Support(Value):
    """Spring and damper between one gear's centre and the ground, or the housing, in y or along the line of action.

    Force: stiffness y (|y| / reference_deflection)^exponent + damping y'. Without a stiffness the support is rigid.
    """

    stiffness: float | None = quantity(None, "n_per_m", gt=0.0, doc="support stiffness; absent: rigid")
    damping: float = quantity(0.0, "n_s_per_m", ge=0.0, doc="support damping")
    exponent: float = quantity(
        0.0, gt=-0.9, le=3.0, doc="e of the force k y (|y| / reference_deflection)^e; 0: linear"
    )
    reference_deflection: float = quantity(
        10e-6, "um", gt=0.0, le=1e-2, doc="deflection at which the secant stiffness is `stiffness`"
    )
    across: Across | None = quantity(None, doc="absent: the centre does not move across the support's direction")

    @model_validator(mode="after")
    def _stable(self) -> Support:
        if self.stiffness is None:
            for name in ("damping", "exponent", "across"):
                if getattr(self, name):
                    raise ValueError(f"stiffness_n_per_m is missing: a support without it is rigid, and has no {name}")
            return self
        if self.across is None:
            return self
        coupling, product = self.across.coupling, self.stiffness * self.across.stiffness
        if not coupling**2 < product:
            raise ValueError(
                f"across.coupling_n_per_m = {format_number(coupling)} must lie between plus and minus"
                f" {product**0.5:.6g}, the root of both directions' stiffnesses, or the support pushes its gear away"
            )
        return self


    def holding(self, mass: float) -> Holding:
        """How the support holds a gear of that mass [kg]."""
        if self.stiffness is not None:
            return Holding(mass, self.stiffness, self.damping)
        held, rate = HELD_MASS * mass, 2 * pi * HELD_FREQUENCY
        return Holding(held, held * rate**2, 2 * HELD_DAMPING_RATIO * held * rate)


class Supports(Value):
    """The supports of both gears; `direction` is the axis along which they act."""

    common: ClassVar[type[Value] | None] = Support
    driver: Support = quantity(Support(), doc="support of the driver")
    driven: Support = quantity(Support(), doc="support of the driven gear")
    direction: Literal["tangential", "line-of-action"] = quantity("tangential", doc="axis of support motion")

    @property
    def move_across(self) -> bool:
        """Whether a centre moves across its support as well."""
        return self.driver.across is not None or self.driven.across is not None


def _across(whose: str) -> Any:
    return quantity(0.0, ge=-100.0, le=100.0, doc=f"part of it that the {whose} support moves by across its direction")


class Rocking(Value):
    """A second motion of the housing: with its own shares 1 and -1 it rocks about the middle between both gears.

    `mass`, `stiffness` and `damping` belong to the motion of a support with share 1.
    """

    mass: float = quantity(unit="kg", gt=0.0, le=1e7, doc="mass that rocks, seen where the share is 1")
    stiffness: float = quantity(unit="n_per_m", gt=0.0, doc="stiffness against it, seen where the share is 1")
    damping: float = quantity(0.0, "n_s_per_m", ge=0.0, doc="damping of it, seen where the share is 1")
    driver_share: float = quantity(1.0, ge=-100.0, le=100.0, doc="part of it that the driver's support moves by")
    driven_share: float = quantity(-1.0, ge=-100.0, le=100.0, doc="part of it that the driven gear's support moves by")
    driver_share_across: float = _across("driver's")
    driven_share_across: float = _across("driven gear's")


class Housing(Value):
    """One body between both supports and the ground, which moves along the supports' direction, and may rock.

    It takes each support along by a share of its own motion h: shares 1 and 1 are a body that moves along, 1 and 0.3
    one that stands softer at the driver. `mass`, `stiffness` and `damping` belong to h. The mesh pushes both supports
    apart: a body that moves along hardly feels it, one that rocks feels all of it. With `driver_share_across` and
    `driven_share_across` it moves obliquely. Displacement sensors that stand on it show what is left of the gears'
    motion (`sensor_share`).
    """

    mass: float = quantity(unit="kg", gt=0.0, le=1e7, doc="mass of the housing")
    stiffness: float = quantity(unit="n_per_m", gt=0.0, doc="stiffness of the housing to the ground")
    damping: float = quantity(0.0, "n_s_per_m", ge=0.0, doc="damping of the housing to the ground")
    driver_share: float = quantity(1.0, ge=-100.0, le=100.0, doc="part of its motion that the driver's support makes")
    driven_share: float = quantity(1.0, ge=-100.0, le=100.0, doc="part of it that the driven gear's support makes")
    driver_share_across: float = _across("driver's")
    driven_share_across: float = _across("driven gear's")
    sensor_share: float = quantity(
        0.0, ge=0.0, le=1.0, doc="part of the supports' motion with it that the displacement sensors make: 0 on the"
        " ground, 1 on the housing"
    )
    rocking: Rocking | None = quantity(None, doc="absent: it does not rock")

    def feet(self, moved: Array, rocked: Array) -> tuple[Array, Array]:
        """Motions (n,) [m] of the supports of driver and driven gear with both motions (n,) [m] of the housing."""
        return self._feet(moved, rocked, "share")

    def feet_across(self, moved: Array, rocked: Array) -> tuple[Array, Array]:
        """The same across the supports' direction."""
        return self._feet(moved, rocked, "share_across")

    def _feet(self, moved: Array, rocked: Array, share: str) -> tuple[Array, Array]:
        one, two = (getattr(self, f"{side}_{share}") * moved for side in ("driver", "driven"))
        if self.rocking is None:
            return one, two
        more = [getattr(self.rocking, f"{side}_{share}") * rocked for side in ("driver", "driven")]
        return one + more[0], two + more[1]

    def goes_across(self, side: str) -> bool:
        """Whether the support of a `side`, driver or driven, moves across its direction with the housing."""
        moves = (self, self.rocking) if self.rocking is not None else (self,)
        return any(getattr(one, f"{side}_share_across") for one in moves)

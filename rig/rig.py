"""The rig: a gear pair, its material, supports, drives and damping."""

from __future__ import annotations

from math import pi
from typing import ClassVar, Literal

from gearbench.rig.drive import Drive
from gearbench.rig.gear import Gear
from gearbench.rig.mesh import Friction, MeshCorrection
from gearbench.rig.sensors import Sensors
from gearbench.rig.value import Value, quantity


class Material(Value):
    """Linear isotropic material of both gears."""

    youngs_modulus: float = quantity(206e9, "gpa", gt=0.0, le=2e12, doc="Young's modulus")
    poisson: float = quantity(0.3, ge=0.0, lt=0.5, doc="Poisson's ratio")
    density: float = quantity(7810.0, "kg_m3", gt=0.0, le=3e4, doc="density")
    state: Literal["plane-stress", "plane-strain"] = quantity("plane-stress", doc="stress state of the 2-D model")


class Support(Value):
    """Spring and damper between one gear's centre and the ground, in y or along the line of action.

    Force: stiffness y (|y| / reference_deflection)^exponent + damping y'.
    """

    stiffness: float = quantity(unit="n_per_m", gt=0.0, doc="support stiffness")
    damping: float = quantity(0.0, "n_s_per_m", ge=0.0, doc="support damping")
    exponent: float = quantity(
        0.0, gt=-0.9, le=3.0, doc="e of the force k y (|y| / reference_deflection)^e; 0: linear"
    )
    reference_deflection: float = quantity(
        10e-6, "um", gt=0.0, le=1e-2, doc="deflection at which the secant stiffness is `stiffness`"
    )


class Supports(Value):
    """The supports of both gears; `direction` is the axis along which the centres move."""

    common: ClassVar[type[Value] | None] = Support
    driver: Support = quantity(doc="support of the driver")
    driven: Support = quantity(doc="support of the driven gear")
    direction: Literal["tangential", "line-of-action"] = quantity("tangential", doc="axis of support motion")


class Load(Value):
    """Boundary of the driven gear: constant speed, or the torque that balances the driver's at any time."""

    boundary: Literal["speed", "torque"] = quantity("speed", doc="what is imposed on the driven gear")


class Damping(Value):
    """Damping of the elastic gears (stiffness-proportional) and of the lumped mesh."""

    material_ratio: float = quantity(
        0.05,
        ge=0.0,
        lt=0.5,
        doc="damping ratio of the elastic gears at `material_frequency` (stiffness-proportional)",
    )
    material_frequency: float = quantity(1250.0, "hz", gt=0.0, doc="frequency at which `material_ratio` holds")
    mesh_ratio: float = quantity(0.05, ge=0.0, lt=0.5, doc="lumped model: zeta in c(t) = 2 zeta sqrt(k(t) m_e)")

    @property
    def beta(self) -> float:
        """Stiffness-proportional damping coefficient beta = zeta / (pi f) [s]."""
        return self.material_ratio / (pi * self.material_frequency)


class Rig(Value):
    """The complete description of one rig. Lengths in m, angles in rad, everything else in SI."""

    centre_distance: float | None = quantity(
        None,
        "mm",
        gt=0.0,
        doc="centre distance; absent: zero backlash of the unthinned gears at the given shifts",
    )
    driver: Gear = quantity(doc="driving gear, or the file that holds it")
    driven: Gear = quantity(doc="driven gear, or the file that holds it")
    material: Material = quantity(Material(), doc="material of both gears")
    support: Supports = quantity(doc="supports of both gears")
    drive: Drive = quantity(Drive(), doc="boundary of the driver")
    load: Load = quantity(Load(), doc="boundary of the driven gear")
    damping: Damping = quantity(Damping(), doc="damping of gears and mesh")
    friction: Friction = quantity(Friction(), doc="friction between the flanks")
    mesh: MeshCorrection = quantity(MeshCorrection(), doc="corrections of the mesh force and of the pairs' errors")
    sensors: Sensors = quantity(Sensors(), doc="delays and noise of the channels")

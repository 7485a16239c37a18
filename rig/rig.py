"""The rig: a gear pair, its material, damping, and what its other files describe."""

from __future__ import annotations

from math import pi
from typing import Literal

from pydantic import model_validator

from gearbench.rig.drive import Drive, Load
from gearbench.rig.gear import Gear
from gearbench.rig.mesh import Friction, MeshCorrection
from gearbench.rig.sensors import Sensors
from gearbench.rig.support import Housing, Supports
from gearbench.rig.value import Value, quantity


class Material(Value):
    """Linear isotropic material of both gears."""

    youngs_modulus: float = quantity(206e9, "gpa", gt=0.0, le=2e12, doc="Young's modulus")
    poisson: float = quantity(0.3, ge=0.0, lt=0.5, doc="Poisson's ratio")
    density: float = quantity(7810.0, "kg_m3", gt=0.0, le=3e4, doc="density")
    state: Literal["plane-stress", "plane-strain"] = quantity("plane-stress", doc="stress state of the 2-D model")


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
    mesh_exponent: float = quantity(
        0.0, ge=0.0, le=2.0, doc="lumped model: n of c(t) (F / mesh_reference_force)^n, F the elastic force; 0: c(t)"
    )
    mesh_reference_force: float = quantity(
        1000.0, "n", gt=0.0, le=1e9, doc="normal force at which the exponent leaves the damping of the mesh as it is"
    )

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
    support: Supports = quantity(Supports(), doc="supports of both gears; absent: rigid")
    housing: Housing | None = quantity(None, doc="absent: the supports stand on the ground")
    drive: Drive = quantity(Drive(), doc="boundary of the driver")
    load: Load = quantity(Load(), doc="boundary of the driven gear")
    damping: Damping = quantity(Damping(), doc="damping of gears and mesh")
    friction: Friction = quantity(Friction(), doc="friction between the flanks")
    mesh: MeshCorrection = quantity(MeshCorrection(), doc="corrections of the mesh force and of the pairs' errors")
    sensors: Sensors = quantity(Sensors(), doc="what the measuring chain does to the channels")

    @property
    def turns_freely(self) -> bool:
        """Whether no prescribed speed holds the common rotation of both gears."""
        return "speed" not in (self.drive.boundary, self.load.boundary)

    @model_validator(mode="after")
    def _driven_and_loaded(self) -> Rig:
        drive, load = self.drive, self.load
        if drive.boundary == load.boundary == "speed":
            raise ValueError(
                'drive.boundary = "speed" and load.boundary = "speed" leave no torque to press the flanks together: one'
                ' of them must be "torque" or "inertia"'
            )
        if drive.boundary == "speed" and drive.ripple is not None and any(drive.ripple.amplitude):
            raise ValueError(
                'drive.ripple acts on nothing while drive.boundary = "speed" holds the speed of what it would act on'
            )
        for side in ("driver", "driven"):
            if self.housing is not None and getattr(self.support, side).stiffness is None:
                raise ValueError(
                    f"support.{side}.stiffness_n_per_m is missing: behind rigid supports there is no housing"
                )
            across = getattr(self.support, side).across
            if self.housing is not None and self.housing.goes_across(side) and across is None:
                raise ValueError(
                    f"housing.{side}_share_across moves a support across its direction, where it holds its gear only"
                    f" with support.{side}.across"
                )
        return self

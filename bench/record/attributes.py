"""What a record says of its rig and its experiment: attributes."""

from __future__ import annotations

from typing import Any

from gearbench.bench.plan.schedule import Schedule
from gearbench.geometry import Body, Pair, body
from gearbench.rig import Coupling, Rig


def bodies_of(rig: Rig, meshing: Pair) -> tuple[Body, Body]:
    """Masses and inertias of driver and driven gear. Raises GeometryError."""
    density = rig.material.density
    return (
        body(meshing.driver, rig.driver, density, "rig.driver"),
        body(meshing.driven, rig.driven, density, "rig.driven"),
    )


def turning_inertias(rig: Rig, meshing: Pair) -> tuple[float, float]:
    """Inertias [kg m^2] of driver and driven gear and of what turns with them, but for what is held at its speed."""
    one, two = bodies_of(rig, meshing)
    return (
        one.inertia + _rigidly(rig.drive.coupling, rig.drive.boundary),
        two.inertia + _rigidly(rig.load.coupling, rig.load.boundary),
    )


def _rigidly(coupling: Coupling | None, boundary: str) -> float:
    return coupling.inertia if coupling is not None and coupling.stiffness is None and boundary != "speed" else 0.0


def rig_attributes(rig: Rig, meshing: Pair) -> dict[str, Any]:
    """Record attributes of teeth, base radii [m], inertias of the gears [kg m^2], pressure angle [rad], boundaries."""
    one, two = bodies_of(rig, meshing)
    return {
        "teeth_driver": rig.driver.teeth,
        "teeth_driven": rig.driven.teeth,
        "base_radius_driver": meshing.driver.base_radius,
        "base_radius_driven": meshing.driven.base_radius,
        "inertia_driver": one.inertia,
        "inertia_driven": two.inertia,
        "working_pressure_angle": meshing.working_pressure_angle,
        "support_direction": rig.support.direction,
        "driven_boundary": rig.load.boundary,
    }


def shown_mean(rig: Rig, torque_mean: float) -> float:
    """Mean torque [N m] that the record states: what its sensor shows."""
    return torque_mean * rig.sensors.gain_torque_driver


def experiment_attributes(plan: Schedule, periods: int, torque_mean: float) -> dict[str, Any]:
    """Record attributes of sampling and mesh period [s], None where speed changes, of a record that holds that many
    excitation periods."""
    return {
        "sampling_rate": plan.sampling_rate,
        "samples_per_period": plan.samples_per_period,
        "periods": periods,
        "mesh_period": None if plan.rotation else plan.mesh_period,
        "mesh_phase_origin": "geometry",
        "torque_mean": torque_mean,
    }

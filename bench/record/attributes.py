"""What a record says about its rig and its experiment: attributes, and warnings of what it does not hold."""

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


def divided_steps(divided: int, total: int) -> str | None:
    """A sentence for a record with steps that had to be divided, else None."""
    if not divided:
        return None
    return f"{divided} of {total} integration steps were divided, because contact changes too fast for whole ones there"


def beyond_model(strayed: int, total: int, first: float) -> str | None:
    """A sentence for a motion that goes where the flanks are not modelled, `first` at that time [s]; else None."""
    if not strayed:
        return None
    return (
        f"in {strayed} of {total} samples, first at t = {first:.6g} s, teeth overlap beyond the modelled flanks or"
        " press harder than modelled: what happens there and afterwards is beyond the model's validity; lower"
        " experiment.torque_mean_nm or the multisine"
    )


def lost_contact(lost: int, total: int) -> str | None:
    """Warning where the teeth separate: the response then is not that of a linear system."""
    if not lost:
        return None
    return (
        f"the teeth are out of contact in {lost} of {total} samples, so the rig is not linear and its identified"
        " response depends on the excitation"
    )


def unlike_periods(plan: Schedule) -> str | None:
    """Warning where the mesh period is not the period of what happens."""
    if plan.repeat_cycles == 1 or plan.rotation is not None:
        return None
    after = (
        f"mesh periods differ from one another, so the rig repeats after {plan.repeat_cycles} mesh periods"
        f" ({plan.repeat_cycles * plan.mesh_period:.4g} s)"
    )
    return after if plan.wraps else f"{after}, longer than the record: none of its excitation periods is like another"


def unsettled(residual: float, tolerance: float, undamped: str = "") -> str | None:
    """A sentence for a motion that still changes from period to period when free vibrations have died out, or never do;
    undamped: keys that damp some of them, and are 0."""
    if residual <= tolerance:
        return None
    return (
        f"the motion does not repeat: in the end the DTE still changes by {residual:.2g} of its standard deviation"
        f" (settling_tolerance: {tolerance:g}), as where teeth part and strike"
        + (f", or where vibrations are not damped ({undamped})" if undamped else "")
    )


def joined(*warnings: str | None) -> str | None:
    """The sentences as an attribute, a line each; None without any."""
    return "\n".join(filter(None, warnings)) or None

"""From the motion of a rig to the channels of its record: steady rotation, sensors, mesh phase, DTE and force."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.record.attributes import turning_inertias
from gearbench.bench.record.sensors import Noise, Signal, encoder_error, measured
from gearbench.geometry import Pair
from gearbench.rig import Rig

Array = NDArray[np.float64]

# Tooth pairs of a record: the one nearest the pitch point, the one that has passed it and the one that comes next.
PAIRS = ("leaving", "middle", "entering")


def support_factor(rig: Rig, meshing: Pair) -> float:
    """What a support's motion [m] contributes to the DTE [m]."""
    return 1.0 if rig.support.direction == "line-of-action" else cos(meshing.working_pressure_angle)


def across_factor(rig: Rig, meshing: Pair) -> float:
    """What a centre's motion across its support [m] contributes to the DTE [m]."""
    return 0.0 if rig.support.direction == "line-of-action" else sin(meshing.working_pressure_angle)


def dte_of(
    turned: Array,
    y_driver: Array,
    y_driven: Array,
    factor: float,
    x_driver: Array | None = None,
    x_driven: Array | None = None,
    across: float = 0.0,
) -> Array:
    """DTE [m] from what both rotations contribute, rb1 theta1 - rb2 theta2 [m], and the centres' motions [m] along the
    supports and, where there are any, across them."""
    along = np.asarray(turned + factor * (y_driver - y_driven))
    return along if x_driver is None or x_driven is None else along + across * (x_driver - x_driven)


class Displacements(NamedTuple):
    """Motions (n,) [m] of both centres along their supports and across them."""

    y_driver: Array
    y_driven: Array
    x_driver: Array
    x_driven: Array


def displacements(rig: Rig, centres: Displacements, moved: Array, rocked: Array) -> Displacements:
    """What displacement sensors show of the `centres` beside both motions of the housing (n,) [m]: those that stand on
    it go along."""
    if rig.housing is None or not rig.housing.sensor_share:
        return centres
    feet = (*rig.housing.feet(moved, rocked), *rig.housing.feet_across(moved, rocked))
    return Displacements(*(one - rig.housing.sensor_share * foot for one, foot in zip(centres, feet, strict=True)))


def turned_by(meshing: Pair, angle_driver: Array, angle_driven: Array) -> Array:
    """What both rotations contribute to the DTE [m]."""
    return np.asarray(meshing.driver.base_radius * angle_driver - meshing.driven.base_radius * angle_driven)


def force_of(torque_driver: Array, meshing: Pair) -> Array:
    """Generalised force [N] of a driver torque [N m], also where both gears turn freely: the driven torque then
    balances the driver's."""
    return np.asarray(torque_driver / meshing.driver.base_radius)


def generalised_force(rig: Rig, meshing: Pair, driver: Array, driven: Array) -> Array:
    """Generalised force [N] of both torques [N m]: the driver's alone where the load's balances it or is its reaction,
    else of both on all that turns with the gears."""
    if rig.drive.boundary != "speed" and rig.load.boundary != "inertia":
        return force_of(driver, meshing)
    (r1, r2), (j1, j2) = (meshing.driver.base_radius, meshing.driven.base_radius), turning_inertias(rig, meshing)
    mass = j1 * j2 / (j1 * r2**2 + j2 * r1**2)
    return np.asarray(mass * (r1 * driver / j1 + r2 * driven / j2))


def tooth_channels(forces: Mapping[str, Array]) -> dict[str, Array]:
    """Channels of tooth forces (n,) [N] by `PAIRS` and "back", and the working pairs' shares of the load; a share is 0
    while no working flanks touch."""
    total = np.sum([forces[name] for name in PAIRS], axis=0)
    carried = np.where(total > 0.0, total, 1.0)
    shares = {f"load_share_{name}": forces[name] / carried for name in PAIRS}
    return {**{f"tooth_force_{name}": force for name, force in forces.items()}, **shares}


class Stretch(NamedTuple):
    """Where in a record channels lie: from its sample `at` on, which is sample `within` of what repeats; the noise of
    its sensors, where it goes on from the stretch before."""

    at: int = 0
    within: int = 0
    noise: Noise | None = None


WHOLE = Stretch()


def sensed(
    swings: dict[str, Array],
    rig: Rig,
    meshing: Pair,
    plan: Schedule,
    *,
    samples: int,
    seed: int,
    first: float = 0.0,
    stretch: Stretch = WHOLE,
) -> dict[str, Array]:
    """Motions (realisations, n) that repeat, as the rig's sensors show them over `samples` samples of a record that
    begins at the mesh phase `first` [cycles]; DTE and force are those of the measured channels. Angles are without the
    steady rotation, but with one whose speed changes."""
    speeds = {"angle_driver": plan.speed_driver, "angle_driven": plan.speed_driven} if plan.rotation is None else {}
    signals = {name: Signal(swing, speeds.get(name, 0.0)) for name, swing in swings.items()}
    for gear, teeth in (("driver", rig.driver.teeth), ("driven", rig.driven.teeth)):
        if rig.sensors.mesh_phase_zero:
            swing, ramp = signals[f"angle_{gear}"].swing, signals[f"angle_{gear}"].ramp
            signals[f"angle_{gear}"] = Signal(swing + 2 * pi / teeth * rig.sensors.mesh_phase_zero, ramp)
        if getattr(rig.sensors, f"encoder_runout_{gear}"):
            swing, ramp = signals[f"angle_{gear}"].swing, signals[f"angle_{gear}"].ramp
            rotation = 2 * pi / teeth * mesh_phases(plan, swing.shape[-1], first, stretch.within)
            signals[f"angle_{gear}"] = Signal(swing + encoder_error(rig.sensors, gear, rotation), ramp)
    found = measured(
        signals,
        rig,
        plan.sampling_rate,
        seed=seed,
        samples=samples,
        samples_per_period=plan.samples_per_period,
        block=plan.block_samples if plan.wraps else 0,
        start=first / plan.cycles_per_sample / plan.sampling_rate,
        at=stretch.at,
        noise=stretch.noise,
    )
    out = {name: signal.swing for name, signal in found.items()}
    turned = turned_by(meshing, out["angle_driver"], out["angle_driven"])
    across = out.get("x_driver"), out.get("x_driven"), across_factor(rig, meshing)
    out["dte"] = dte_of(turned, out["y_driver"], out["y_driven"], support_factor(rig, meshing), *across)
    out["force"] = generalised_force(rig, meshing, out["torque_driver"], out["torque_driven"])
    return out


def mesh_phases(plan: Schedule, samples: int, first: float = 0.0, at: int = 0) -> Array:
    """Mesh phase (samples,) [cycles] from sample `at` on, of a record that begins at `first`."""
    number = np.arange(at, at + samples)
    if plan.rotation is not None:
        return first + plan.rotation.cycles(number / plan.sampling_rate)
    return np.asarray(first + number * plan.cycles_per_sample)


def with_rotation(
    swings: dict[str, Array], plan: Schedule, first: float = 0.0, times: float = 1.0, at: int = 0
) -> dict[str, Array]:
    """The channels with the nominal rotation of both gears, which turn by `first` [cycles] of the mesh before the first
    sample of the record, of which the channels begin at sample `at`; `times` -1 takes it off."""
    count = swings["angle_driver"].shape[-1]
    if plan.rotation is not None:
        cycles = mesh_phases(plan, count, first, at)
        turned = {"angle_driver": plan.rotation.teeth, "angle_driven": plan.teeth_driven}
        return {**swings, **{name: swings[name] + times * 2 * pi / z * cycles for name, z in turned.items()}}
    time = (np.arange(at, at + count) + first / plan.cycles_per_sample) / plan.sampling_rate
    speeds = {"angle_driver": plan.speed_driver, "angle_driven": plan.speed_driven}
    return {**swings, **{name: swings[name] + times * speed * time for name, speed in speeds.items()}}

"""From the motion of a rig to the channels of its record: steady rotation, sensors, mesh phase, DTE and force."""

from __future__ import annotations

from math import cos

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.record.sensors import Signal, measured
from gearbench.geometry import Pair
from gearbench.rig import Rig

Array = NDArray[np.float64]


def support_factor(rig: Rig, meshing: Pair) -> float:
    """What a support's motion [m] contributes to the DTE [m]."""
    return 1.0 if rig.support.direction == "line-of-action" else cos(meshing.working_pressure_angle)


def dte_of(turned: Array, y_driver: Array, y_driven: Array, factor: float) -> Array:
    """DTE [m] from what both rotations contribute, rb1 theta1 - rb2 theta2 [m], and the supports' motions [m]."""
    return np.asarray(turned + factor * (y_driver - y_driven))


def turned_by(meshing: Pair, angle_driver: Array, angle_driven: Array) -> Array:
    """What both rotations contribute to the DTE [m]."""
    return np.asarray(meshing.driver.base_radius * angle_driver - meshing.driven.base_radius * angle_driven)


def force_of(torque_driver: Array, meshing: Pair) -> Array:
    """Generalised force [N] of a driver torque [N m], also where both gears turn freely: the driven torque then
    balances the driver's."""
    return np.asarray(torque_driver / meshing.driver.base_radius)


def has_sensors(rig: Rig) -> bool:
    """Whether sensors delay or disturb anything."""
    return any(getattr(rig.sensors, name) for name in type(rig.sensors).model_fields)


def sensed(
    swings: dict[str, Array], rig: Rig, meshing: Pair, plan: Schedule, *, samples: int, seed: int
) -> dict[str, Array]:
    """Motions (realisations, n) that repeat, as the rig's sensors show them over `samples` samples; DTE and force are
    those of the measured channels. Angles are without the steady rotation."""
    speeds = {"angle_driver": plan.speed_driver, "angle_driven": plan.speed_driven}
    signals = {name: Signal(swing, speeds.get(name, 0.0)) for name, swing in swings.items()}
    found = measured(
        signals, rig, plan.sampling_rate, seed=seed, samples=samples, samples_per_period=plan.samples_per_period
    )
    out = {name: signal.swing for name, signal in found.items()}
    turned = turned_by(meshing, out["angle_driver"], out["angle_driven"])
    out["dte"] = dte_of(turned, out["y_driver"], out["y_driven"], support_factor(rig, meshing))
    out["force"] = force_of(out["torque_driver"], meshing)
    return out


def mesh_phases(plan: Schedule, samples: int, first: float = 0.0) -> Array:
    """Mesh phase (samples,) [cycles] from `first` on."""
    return np.asarray(first + np.arange(samples) * plan.cycles_per_sample)


def with_rotation(swings: dict[str, Array], plan: Schedule, first: float = 0.0) -> dict[str, Array]:
    """The channels with the steady rotation of both gears, which turn by `first` [cycles] of the mesh before the first
    sample."""
    count = swings["angle_driver"].shape[-1]
    time = (np.arange(count) + first / plan.cycles_per_sample) / plan.sampling_rate
    speeds = {"angle_driver": plan.speed_driver, "angle_driven": plan.speed_driven}
    return {**swings, **{name: swings[name] + speed * time for name, speed in speeds.items()}}

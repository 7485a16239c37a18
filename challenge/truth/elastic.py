"""Truth rigs whose records come from finite elements: the nominal rig within its uncertainty, with a little of all
that the reduced model represents, and one effect more or none.

Teeth, bodies and contact are another model than the diagnosis's there, and the structure is the nominal one.
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench import simulate
from gearbench.bench.plan.schedule import schedule
from gearbench.challenge.truth.levels import DELAYED, RIPPLE_ORDERS, Levels
from gearbench.challenge.truth.measure import attributes_of, noisy
from gearbench.challenge.truth.rigs import Bench
from gearbench.geometry import pair
from gearbench.records import make_record
from gearbench.rig import Case, Condition, Rig
from gearbench.rig.drive import Ripple

Array = NDArray[np.float64]

# Those of EFFECTS that the reduced model has in motion; a crack is a shape there and not a loss of stiffness.
REPRESENTED = (
    *("backlash", "friction", "eccentricity", "pitch-error", "coupling", "bearing-nonlinearity"),
    *("sensor-delay", "torque-ripple", "encoder-runout"),
)
COUPLING_DAMPING = 0.03  # ratio
SIDES = ("driver", "driven")
CHANNELS = ("torque_driver", "torque_driven", *DELAYED)


def within_uncertainty(nominal: Case, rng: np.random.Generator) -> Case:
    """The case with every uncertain number drawn within two standard deviations."""
    tree = nominal.rig.model_copy(deep=True)
    for path, deviation in sorted(nominal.uncertainty.items()):
        change = deviation * float(np.clip(rng.standard_normal(), -2.0, 2.0))
        _, *keys = path.split(".")
        tree = _moved(tree, keys, change)
    return nominal.model_copy(update={"rig": tree})


def _moved(part: Rig, keys: list[str], change: float) -> Rig:
    """A value with the number at the end of `keys` changed."""
    first, *rest = keys
    held = getattr(part, first)
    # Damping known to a third or worse keeps a fifth of itself.
    new = _moved(held, rest, change) if rest else max(held + change, 0.2 * held)
    return part.model_copy(update={first: new})


def elastic_rig(nominal: Case, rig: Case, levels: Levels, condition: Condition, soft: bool) -> Case:
    """The case of one condition: `rig` is the nominal one within its uncertainty; `soft`: the coupling yields."""
    case, meshing = rig.under(condition), pair(nominal.rig)
    first = nominal.conditions[0].experiment if nominal.conditions else nominal.experiment
    force = first.torque_mean / meshing.driver.base_radius * np.cos(meshing.working_pressure_angle)
    update: dict[str, object] = {}
    supports = {}
    for number, side in enumerate(SIDES):
        gear, support = getattr(case.rig, side), getattr(case.rig.support, side)
        update[side] = gear.model_copy(
            update={
                "runout": levels.runout[number],
                "runout_phase": levels.runout_phase[number],
                "pitch_error": tuple(levels.pitch[number].tolist()),
                "thinning": max(gear.thinning + 0.5 * levels.backlash_more, 0.0),
            }
        )
        bent = {"exponent": levels.exponent[number], "reference_deflection": float(force / support.stiffness)}
        supports[side] = support.model_copy(update=bent)
    update["support"] = case.rig.support.model_copy(update=supports)
    update["friction"] = case.rig.friction.model_copy(update={"coefficient": levels.friction})
    update["drive"] = _drive(case.rig, levels, condition.experiment.torque_mean, soft)
    delays = {f"delay_{name}": late for name, late in zip(DELAYED, levels.delay, strict=True)}
    silent = {f"noise_{kind}": 0.0 for kind in ("angle", "displacement", "torque")}
    radii = (meshing.driver.base_radius, meshing.driven.base_radius)
    ahead: dict[str, float] = {}
    for side, radius, size, phase in zip(SIDES, radii, levels.encoder, levels.encoder_phase, strict=True):
        ahead |= {f"encoder_runout_{side}": size / radius, f"encoder_runout_{side}_phase": phase}
    update["sensors"] = case.rig.sensors.model_copy(update={**delays, **silent, **ahead})
    return case.model_copy(update={"rig": case.rig.model_copy(update=update), "uncertainty": {}})


def _drive(rig: Rig, levels: Levels, torque: float, soft: bool) -> object:
    """The drive with its ripple and, where it is soft, the coupling's spring."""
    ripple = Ripple(
        orders=RIPPLE_ORDERS,
        amplitude=tuple((levels.ripple * torque).tolist()),
        phase=tuple(levels.ripple_phase.tolist()),
    )
    coupling = rig.drive.coupling
    assert coupling is not None and rig.driver.inertia is not None
    if soft:
        reduced = coupling.inertia * rig.driver.inertia / (coupling.inertia + rig.driver.inertia)
        spring = (2 * pi * levels.coupling_frequency) ** 2 * reduced
        damping = 2 * COUPLING_DAMPING * sqrt(spring * reduced)
        coupling = coupling.model_copy(update={"stiffness": spring, "damping": damping})
    return rig.drive.model_copy(update={"ripple": ripple, "coupling": coupling})


def measure_elastic(
    bench: Bench, rig: Case, levels: Levels, condition: Condition, soft: bool, name: str, rng: np.random.Generator
) -> xr.Dataset:
    """The record of one condition: channels and attributes of a record of `measure`, noise from `rng`."""
    plan = schedule(condition.experiment, bench.nominal.rig)
    run = simulate(elastic_rig(bench.nominal, rig, levels, condition, soft), "reduced", workers=1)
    channels = {key: run[key].values[0] for key in CHANNELS}
    return make_record(noisy(channels, bench.nominal.rig.sensors, rng), attributes_of(bench, condition, plan, name))

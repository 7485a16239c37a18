"""From a nominal case, a structure and levels to the plant that one condition is run on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.schedule import Schedule, schedule
from gearbench.bench.refusals.stated import check_springs, check_stated
from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.truth.levels import RIPPLE_ORDERS, Levels
from gearbench.challenge.truth.plant import Coupling, Drift, Gears, Inertias, Plant, Spring, Teeth, Tone
from gearbench.challenge.truth.scale import Scale
from gearbench.challenge.truth.structure import Structure
from gearbench.challenge.truth.teeth import pair_law, scaled
from gearbench.geometry import Pair, pair
from gearbench.rig import Case, Condition, Experiment, Rig, effects_in

Array = NDArray[np.float64]

REFERENCE = 10e-6  # [m] deflection at which the pairs' stiffness is given
# Over the deflection of the mesh under the mean torque: one pair alone yields some 1.5 times as much, and torque swings
# and heavier conditions press it three times as deep.
DEEPEST = 4.5
RATE = 0.03  # [m/s] at which quadratic damping is compared with the linear one: about its rms
SLIP_TIME = 50e-6  # [s] in which the slipping coupling lets go of what exceeds its limit
# Effects that a nominal rig may have: what the truth rig has as well.
ALLOWED = ("rig.drive.coupling", "rig.mesh.stiffness_scale", "rig.sensors.noise_")


@dataclass(frozen=True)
class Bench:
    """What all truth rigs around one nominal case share: its geometry and the scale of its mesh."""

    nominal: Case
    meshing: Pair
    stiffness: float  # mean tangent stiffness [N/m] of the nominal mesh at the first condition's mean torque
    scale: Scale = field(default_factory=Scale)
    torques: Mapping[str, Array] = field(default_factory=dict)  # of conditions that were measured: one period [N m]


def conditions_of(nominal: Case) -> tuple[Condition, ...]:
    """The case's conditions, or its only experiment as one."""
    return nominal.conditions or (Condition(name="base", experiment=nominal.experiment),)


def check_nominal(nominal: Case) -> None:
    """Refuse a nominal case that no truth rig can be built around. Raises ChallengeError."""
    check_stated(nominal, "a challenge")
    check_springs(nominal, "a challenge")
    rig = nominal.rig
    extra = [key for key in effects_in(rig) if not key.startswith(ALLOWED)]
    if extra:
        raise ChallengeError(f"{extra[0]} of the nominal rig is an effect; a challenge needs a nominal rig without")
    coupling = rig.drive.coupling
    if coupling is None or coupling.stiffness is not None:
        raise ChallengeError(
            "rig.drive.coupling of the nominal rig must give inertia_kg_m2 of the rotor and no stiffness_nm_per_rad"
        )
    if rig.support.direction != "tangential" or rig.load.boundary != "speed":
        raise ChallengeError(
            f"a challenge needs rig.support.direction = tangential and rig.load.boundary = speed, not"
            f" {rig.support.direction} and {rig.load.boundary}"
        )
    for side in ("driver", "driven"):
        for key, name in (("mass_kg", "mass"), ("inertia_kg_m2", "inertia")):
            if getattr(getattr(rig, side), name) is None:
                raise ChallengeError(f"rig.{side}.{key} of the nominal rig must be given for a challenge")
    for condition in conditions_of(nominal):
        experiment = condition.experiment
        if experiment.periods < 2:
            raise ChallengeError(
                f"experiment.periods = {experiment.periods} of condition {condition.name} must be at least 2:"
                " noise shows between periods"
            )
        if experiment.multisine is None or experiment.realisations != 1:
            raise ChallengeError(f"condition {condition.name} must have a multisine and one realisation")
        schedule(experiment, rig)


def make_bench(
    nominal: Case, stiffness: float, scale: Scale | None = None, torques: Mapping[str, Array] | None = None
) -> Bench:
    """The nominal case made ready; `stiffness` [N/m] is the mean tangent stiffness of its mesh. Raises ChallengeError
    or GeometryError."""
    check_nominal(nominal)
    return Bench(nominal, pair(nominal.rig), stiffness, scale or Scale(), torques or {})


def build_plant(bench: Bench, rig: Structure, levels: Levels, experiment: Experiment) -> Plant:
    """The plant under one experiment."""
    modes = _modes(rig)  # a housing does not know what stands on it
    rig = with_levels(rig, levels, bench.nominal.rig)
    meshing, plan = bench.meshing, schedule(experiment, bench.nominal.rig)
    first = conditions_of(bench.nominal)[0].experiment
    z1, z2 = meshing.driver.teeth, meshing.driven.teeth
    rb1, rb2 = meshing.driver.base_radius, meshing.driven.base_radius
    alpha = meshing.working_pressure_angle
    lift = first.torque_mean / rb1 * np.cos(alpha) / rig.support  # about the deflections of the first condition
    rotor, driver, driven, load = rig.inertia
    reduced = rotor * driver / (rotor + driver)
    spring = (2 * np.pi * levels.coupling_frequency) ** 2 * reduced
    shaft = (2 * np.pi * rig.shaft_frequency) ** 2 * driven
    governed = (2 * np.pi * rig.governor_frequency) ** 2 * load
    foreign = levels.foreign
    limit = 0.0
    if foreign.slip_part:
        assert first.multisine is not None
        limit = first.torque_mean + foreign.slip_part * (first.multisine.amplitude or 2 * (first.multisine.rms or 0.0))
    return Plant(
        teeth=_teeth(bench, rig, levels),
        base_driver=rb1,
        base_driven=rb2,
        base_pitch=meshing.base_pitch,
        roll_pitch=meshing.rho_pitch[0],
        line_of_action=meshing.line_of_action,
        sine=float(np.sin(alpha)),
        cosine=float(np.cos(alpha)),
        speed_driver=plan.speed_driver,
        speed_driven=plan.speed_driven,
        inertia=Inertias(*rig.inertia),
        mass=Gears(*rig.mass),
        support=np.ascontiguousarray(rig.support),
        support_damping=np.ascontiguousarray(rig.support_damping),
        support_exponent=np.array([0.0, levels.exponent[0], 0.0, levels.exponent[1]]),
        support_reference=lift,
        mode_mass=modes[0],
        mode_stiffness=modes[1],
        mode_damping=modes[2],
        mode_shape=np.ascontiguousarray(rig.mode_shape),
        sensor_on_housing=rig.sensor_on_housing,
        coupling=Coupling(spring, 2 * rig.coupling_damping * np.sqrt(spring * reduced), limit, spring * SLIP_TIME),
        shaft=Spring(shaft, 2 * rig.shaft_damping * np.sqrt(shaft * driven)),
        governor=Spring(governed, 2 * rig.governor_damping * np.sqrt(governed * load)),
        load_torque=experiment.torque_mean * z2 / z1,
        eccentricity=Gears(*(0.5 * size for size in levels.runout)),
        # Most material when the centre lies on the line of action, towards the mate.
        eccentricity_angle=Gears(
            np.pi / 2 - alpha - levels.runout_phase[0], -np.pi / 2 - alpha + levels.runout_phase[1]
        ),
        ripple=_ripple(levels, experiment),
        ripple_order=float(RIPPLE_ORDERS[0]),
        tone=_tone(levels, experiment, plan),
        drift=Drift(*levels.drift, experiment.periods * plan.samples_per_period / plan.sampling_rate),
    )


def with_levels(rig: Structure, levels: Levels, nominal: Rig) -> Structure:
    """The structure with what effects make of its own numbers."""
    slope, bow = levels.profile
    support = rig.support.copy()
    for along, side, factor in zip((1, 3), ("driver", "driven"), levels.support, strict=True):
        if factor:
            support[along] = getattr(nominal.support, side).stiffness * factor
    return replace(
        rig,
        profile=rig.profile + np.array([slope, bow, 0.0, 0.0]),
        damping_ratio=nominal.damping.mesh_ratio * levels.damping if levels.damping else rig.damping_ratio,
        support=support,
    )


def _teeth(bench: Bench, rig: Structure, levels: Levels) -> Teeth:
    meshing, nominal = bench.meshing, bench.nominal.rig
    first = conditions_of(bench.nominal)[0].experiment
    wanted = bench.stiffness * rig.stiffness_factor
    load = first.torque_mean / meshing.driver.base_radius
    law = pair_law(nominal, meshing, rig.shape, rig.bow, DEEPEST * load / wanted)
    reference = REFERENCE * bench.scale.length
    law = scaled(law, rig.exponent, reference, load, wanted)
    # What bends the law leaves force and deflection under the first condition's mean torque as they are.
    stiffness = law.stiffness * (reference * wanted / ((1.0 + rig.exponent) * load)) ** levels.contact
    low, high = law.inside
    away = np.clip((law.place - 0.5 * (low + high)) / (0.5 * (high - low)), -1.0, 1.0)
    slope, bow, wave_cos, wave_sin = rig.profile
    excess = slope * away + bow * (1 / 3 - away**2)
    excess = excess + wave_cos * np.cos(2 * np.pi * away) + wave_sin * np.sin(2 * np.pi * away)
    # As the nominal model counts it: the mass of the turning parts before the mesh, the load's speed being held.
    mesh_mass = (rig.inertia[0] + rig.inertia[1]) / meshing.driver.base_radius**2
    # The ratio is that under the mean torque, as a verdict states it.
    damping = 2 * rig.damping_ratio * np.sqrt(mesh_mass / wanted)
    loaded = 1.0 + rig.damping_load * (load / wanted / reference - 1.0)
    crack = [loss / (1.0 - loss) for loss in levels.crack]
    more = levels.backlash_more * meshing.driver.base_radius / meshing.driver.reference_radius
    rate = RATE * bench.scale.length * bench.scale.frequency
    return Teeth(
        first=law.first,
        pitch=law.pitch,
        stiffness=stiffness,
        share_driver=np.ascontiguousarray(law.share_driver),
        share_driven=np.ascontiguousarray(law.share_driven),
        excess=excess - law.gap,
        error_driver=np.ascontiguousarray(levels.pitch[0]),
        error_driven=np.ascontiguousarray(levels.pitch[1]),
        crack_driver=crack[0],
        crack_driven=crack[1],
        exponent=rig.exponent + levels.contact,
        reference=reference,
        backlash=meshing.backlash_normal + more,
        damping=float(damping / loaded),
        damping_load=rig.damping_load,
        damping_onset=rig.damping_onset,
        damping_quadratic=float(damping) * levels.foreign.damping_quadratic / rate,
        friction=levels.friction,
        friction_speed=rig.friction_speed,
        friction_shape=rig.friction_shape,
    )


def _modes(rig: Structure) -> tuple[Array, Array, Array]:
    """Masses, stiffnesses and dampings of the housing's modes from their part in the supports' compliance."""
    stiffness = rig.support[1] / rig.mode_part
    omega = 2 * np.pi * rig.mode_frequency
    mass = stiffness / omega**2
    return mass, stiffness, 2 * rig.mode_damping * omega * mass


def _ripple(levels: Levels, experiment: Experiment) -> Array:
    """Cosine and sine amplitudes [N m] of A cos(order theta + phase)."""
    size = levels.ripple * experiment.torque_mean
    parts = np.stack([size * np.cos(levels.ripple_phase), -size * np.sin(levels.ripple_phase)], axis=1)
    return np.ascontiguousarray(parts)


def _tone(levels: Levels, experiment: Experiment, plan: Schedule) -> Tone:
    foreign = levels.foreign
    spacing = plan.sampling_rate / plan.samples_per_period
    line = round(foreign.tone_frequency / spacing) + foreign.tone_offset
    return Tone(foreign.tone * experiment.torque_mean, 2 * np.pi * line * spacing, foreign.tone_phase)

"""Nominal rigs drawn at random: a population of sizes, loads, speeds and noises for a diagnosis to hold on.

Families share no pair of tooth numbers. What makes rigs alike is dimensionless (load over width and module, supports
over the mesh, mesh frequency over the mesh's resonance, samples over it); what makes them differ in size follows from
module and width.
"""

from __future__ import annotations

from functools import cache
from math import lcm, pi, sqrt

import numpy as np

from gearbench.challenge.truth.scale import STIFFNESS, scale_of
from gearbench.challenge.truth.structure import FAMILIES
from gearbench.geometry import pair
from gearbench.rig import Case, Condition, Experiment, Gear

# Teeth: as many as have a hunting period that a short record holds, and neither undercut nor a ratio above four.
FEWEST, MOST, LONGEST_HUNT, LARGEST_RATIO = 18, 120, 144, 4.0
EQUAL = 0.15  # part of the rigs whose gears have the same number of teeth
MODULE_MM = (1.0, 8.0)
WIDTH = (6.0, 14.0)  # over the module
LOAD = (20e6, 90e6)  # [Pa] force over width and module
SHAFTED = (1.2, 2.0)  # mass and inertia with the shaft over those of the gear alone
ROTOR = (3.0, 10.0)  # inertia of the motor's rotor over the driver's
SUPPORT = (0.15, 0.8)  # stiffness of a support over that of the mesh
SUPPORT_RATIO = (0.05, 0.12)  # damping ratio of a gear on its support
SAMPLES = (2400, 5000)  # of a period
RATE = (4.6, 6.0)  # sampling over the mesh's resonance
TOP, BOTTOM = 0.29, 0.002  # ends of the excitation over the sampling rate
SWING = (0.25, 0.5)  # of the torque over its mean
FAR, PARTING = (0.5, 1.0), 0.25  # the same up to where flanks part, and the part of the rigs that swing so far
NOISE = (0.2, 10.0)  # over that of the demonstration's sensors, in terms of its deflection
SENSORS = {"angle": 1e-6 * 0.0282, "displacement": 0.05e-6}  # [m] noise of the demonstration's
TORQUE_NOISE = 2e-4  # over the mean
EXTRAS = ("light", "heavy", "fast", "slow")
MORE = (0.2, 0.5, 0.2, 0.05, 0.05)  # how often none, one, ... of these are measured besides


@cache
def tooth_numbers(family: str) -> tuple[tuple[int, int], ...]:
    """Pairs of tooth numbers of a family's rigs; those of the demonstration are nobody's."""
    found = [
        (one, two)
        for one in range(FEWEST, MOST + 1)
        for two in range(one, min(MOST, int(LARGEST_RATIO * one)) + 1)
        if lcm(one, two) <= LONGEST_HUNT and (one, two) != (20, 30)
    ]
    mine = list(FAMILIES).index(family)
    return tuple(both for number, both in enumerate(found) if number % len(FAMILIES) == mine)


def drawn_nominal(base: Case, family: str, rng: np.random.Generator) -> Case:
    """A nominal rig of a family's population, as uncertain as `base`, with two to six conditions of its own, the last
    one `held-out`."""

    def spread(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    equal = rng.random() < EQUAL
    pairs = [both for both in tooth_numbers(family) if (both[0] == both[1]) == equal]
    teeth = pairs[int(rng.integers(len(pairs)))]
    module = round(spread(*MODULE_MM) * 1e-3, 5)
    width = round(spread(*WIDTH) * module, 4)
    density = base.rig.material.density
    gears = [_gear(one, count, module, width, density, spread(*SHAFTED)) for one, count in zip(
        (base.rig.driver, base.rig.driven), teeth, strict=True)]  # fmt: skip
    driver, driven = gears
    assert driver.mass and driven.mass and driver.inertia and driven.inertia
    mesh = STIFFNESS * width
    springs = [float(f"{spread(*SUPPORT) * mesh:.3g}") for _ in gears]
    held = {
        f"rig.support.{side}": (spring, float(f"{2 * spread(*SUPPORT_RATIO) * sqrt(spring * mass):.3g}"))
        for side, spring, mass in zip(("driver", "driven"), springs, (driver.mass, driven.mass), strict=True)
    }
    rotor = float(f"{spread(*ROTOR) * driver.inertia:.3g}")
    coupling = base.rig.drive.coupling
    assert coupling is not None
    supports = {
        side: getattr(base.rig.support, side).model_copy(update={"stiffness": k, "damping": c})
        for side, (k, c) in ((key.split(".")[-1], both) for key, both in held.items())
    }
    rig = base.rig.model_copy(update={
        "driver": driver,
        "driven": driven,
        "support": base.rig.support.model_copy(update=supports),
        "drive": base.rig.drive.model_copy(
            update={"coupling": coupling.model_copy(update={"inertia": rotor})}),
    })  # fmt: skip
    radius = pair(rig).driver.base_radius
    torque = float(f"{spread(*LOAD) * width * module * radius:.3g}")
    resonance = sqrt(mesh * radius**2 / (driver.inertia + rotor)) / (2 * pi)
    conditions = _conditions(base, lcm(*teeth), torque, resonance, rng)
    case = base.model_copy(update={"rig": rig, "experiment": conditions[0].experiment, "conditions": conditions})
    excited = conditions[0].experiment.multisine
    assert excited is not None
    inside = (float(f"{2.5 * excited.band[0]:.3g}"), float(f"{0.97 * excited.band[1]:.3g}"))
    case = case.model_copy(update={"identification": case.identification.model_copy(update={"band": inside})})
    case = case.model_copy(update={"uncertainty": _uncertainty(base, case), "name": "nominal", "assumed": ()})
    louder = spread(*NOISE) * scale_of(case).length
    sensors = rig.sensors.model_copy(update={
        "noise_angle": SENSORS["angle"] / radius * louder,
        "noise_displacement": SENSORS["displacement"] * louder,
        "noise_torque": TORQUE_NOISE * torque * louder / scale_of(case).length,
    })  # fmt: skip
    case = case.model_copy(update={"rig": rig.model_copy(update={"sensors": sensors})})
    return _swinging(case, rng) if rng.random() < PARTING else case


def _swinging(case: Case, rng: np.random.Generator) -> Case:
    """The case with torques that swing until flanks part, under all its conditions."""
    first = case.conditions[0].experiment
    amplitude = float(f"{rng.uniform(*FAR) * first.torque_mean:.3g}")

    def swung(of: Experiment) -> Experiment:
        assert of.multisine is not None
        return of.model_copy(update={"multisine": of.multisine.model_copy(update={"amplitude": amplitude})})

    conditions = tuple(Condition(name=one.name, experiment=swung(one.experiment)) for one in case.conditions)
    return case.model_copy(update={"experiment": conditions[0].experiment, "conditions": conditions})


def _gear(base: Gear, teeth: int, module: float, width: float, density: float, shafted: float) -> Gear:
    radius = 0.5 * module * teeth
    mass = density * pi * radius**2 * width * shafted
    return base.model_copy(update={
        "teeth": teeth,
        "module": module,
        "face_width": width,
        "thinning": 0.01 * module,
        "hub_radius": round(0.6 * (radius - 1.25 * module), 5),
        "mass": float(f"{mass:.3g}"),
        "inertia": float(f"{0.5 * mass * radius**2:.3g}"),
    })  # fmt: skip


def _uncertainty(base: Case, case: Case) -> dict[str, float]:
    """Standard deviations that are the same parts of the numbers as in `base`."""

    def value(of: Case, path: str) -> float:
        found: object = of
        for key in path.split("."):
            found = getattr(found, key)
        assert isinstance(found, int | float)
        return float(found)

    return {path: sd * value(case, path) / value(base, path) for path, sd in base.uncertainty.items()}


def _conditions(
    base: Case, hunt: int, torque: float, resonance: float, rng: np.random.Generator
) -> tuple[Condition, ...]:
    """One to five conditions, and one held out."""
    per_mesh = max(round(rng.uniform(*SAMPLES) / hunt), 12)
    rate = float(f"{rng.uniform(*RATE) * resonance:.4g}")
    swing = rng.uniform(*SWING)
    count = int(rng.choice(len(EXTRAS) + 1, p=MORE))
    more = [EXTRAS[i] for i in sorted(rng.choice(len(EXTRAS), count, replace=False))]
    out = []
    for number, name in enumerate(("base", *more, "held-out")):
        mean = torque * {"light": 0.5, "heavy": 1.4, "held-out": 0.8}.get(name, 1.0)
        samples = round(per_mesh * {"fast": 0.8, "slow": 1.25}.get(name, 1.0))
        wanted = base.experiment.multisine
        assert wanted is not None
        band = (float(f"{BOTTOM * rate:.3g}"), float(f"{TOP * rate:.3g}"))
        multisine = wanted.model_copy(update={"amplitude": float(f"{swing * torque:.3g}"), "band": band, "crest": 2.5})
        experiment = base.experiment.at_mesh_frequency(rate / samples).model_copy(update={
            "torque_mean": mean,
            "sampling_rate": rate,
            "samples_per_period": samples * hunt,
            "seed": int(rng.integers(1, 1000)) + 1000 * number,
            "multisine": multisine,
        })  # fmt: skip
        out.append(Condition(name=name, experiment=experiment))
    return tuple(out)

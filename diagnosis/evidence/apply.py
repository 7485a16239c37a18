"""From unknowns back to a rig: the nominal case recalibrated, and with an effect added to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.hypotheses import Hypothesis
from gearbench.diagnosis.forces.basis import SHAPE_ORDERS
from gearbench.diagnosis.forces.nominal import Machine
from gearbench.diagnosis.forces.parameters import Layout
from gearbench.diagnosis.forces.residuals import LOSS_FACTOR
from gearbench.diagnosis.forces.unknowns import RIPPLE_ORDERS
from gearbench.rig import Case, Rig
from gearbench.rig.drive import Coupling, Ripple
from gearbench.rig.gear import Crack

Array = NDArray[np.float64]

SIDES = ("driver", "driven")


@dataclass(frozen=True)
class Estimate:
    """One parameter of an effect as its users read it."""

    name: str
    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class Unknowns:
    """Values and standard deviations (P,) of the unknowns of one fit."""

    machine: Machine
    where: Layout
    p: Array
    std: Array
    torque_mean: Mapping[str, float]  # by condition [N m]

    def of(self, key: str) -> Array:
        """Values of a block."""
        return self.p[self.where[key]]

    def std_of(self, key: str) -> Array:
        """Standard deviations of a block."""
        return self.std[self.where[key]]


def with_rig(case: Case, rig: Rig) -> Case:
    """The case with another rig."""
    return case.model_copy(update={"rig": rig})


def recalibrated(nominal: Case, found: Unknowns) -> Case:
    """The nominal case with supports, masses, inertias and mesh as the fit has them, and no effect."""
    rig, machine = nominal.rig, found.machine
    supports = {}
    gears = {}
    for i, side in enumerate(SIDES):
        support, gear = getattr(rig.support, side), getattr(rig, side)
        stiffness = machine.stiffness[i] * np.exp(found.of("stiffness")[i])
        damping = machine.damping[i] * np.exp(found.of("damping")[i])
        supports[side] = support.model_copy(update={"stiffness": float(stiffness), "damping": float(damping)})
        mass = machine.mass[i] * (1 + found.of("mass")[i])
        inertia = machine.inertia[i] * (1 + found.of("inertia")[i])
        gears[side] = gear.model_copy(update={"mass": float(mass), "inertia": float(inertia)})
    update: dict[str, object] = {"support": rig.support.model_copy(update=supports), **gears}
    if rig.drive.coupling is not None:
        rotor = machine.rotor * (1 + found.of("inertia")[2])
        coupling = rig.drive.coupling.model_copy(update={"inertia": float(rotor)})
        update["drive"] = rig.drive.model_copy(update={"coupling": coupling})
    ratio = machine.mesh_ratio * np.exp(found.of("mesh-ratio")[0])
    update["damping"] = rig.damping.model_copy(update={"mesh_ratio": float(min(ratio, 0.49))})
    update["mesh"] = rig.mesh.model_copy(update=_mesh(rig, machine, found))
    return with_rig(nominal, rig.model_copy(update=update))


def _mesh(rig: Rig, machine: Machine, found: Unknowns) -> dict[str, object]:
    """Fields of the mesh correction: nominal plus what the fit adds."""
    shape, profile = found.of("shape"), found.of("profile")

    def added(old: tuple[float, ...], new: Array) -> tuple[float, ...]:
        total = np.zeros(max(len(old), SHAPE_ORDERS))
        total[: len(old)] += old
        total[:SHAPE_ORDERS] += new
        return tuple(float(value) for value in total)

    return {
        "stiffness_scale": float(machine.scale * np.exp(found.of("scale")[0])),
        "stiffness_cos": added(rig.mesh.stiffness_cos, shape[0::2]),
        "stiffness_sin": added(rig.mesh.stiffness_sin, shape[1::2]),
        "error_mean": float(rig.mesh.error_mean + found.of("offset")[0]),
        "error_cos": added(rig.mesh.error_cos, profile[0::2]),
        "error_sin": added(rig.mesh.error_sin, profile[1::2]),
    }


def apply_effect(case: Case, hypothesis: Hypothesis, found: Unknowns) -> tuple[Case, tuple[Estimate, ...]]:
    """The case with the effect of the hypothesis added, and its parameters with standard deviations."""
    rig, estimates = APPLY[hypothesis.effect](case.rig, hypothesis, found)
    return with_rig(case, rig), tuple(estimates)


Applied = tuple[Rig, list[Estimate]]


def _change(rig: Rig, part: str, **update: object) -> Rig:
    return rig.model_copy(update={part: getattr(rig, part).model_copy(update=update)})


def _backlash(rig: Rig, hypothesis: Hypothesis, found: Unknowns) -> Applied:
    more, std = float(found.of("backlash")[0]), float(found.std_of("backlash")[0])
    for side in SIDES:
        gear = getattr(rig, side)
        thinning = gear.thinning + 0.5 * more / cos(gear.pressure_angle)
        rig = _change(rig, side, thinning=max(thinning, 0.0))
    return rig, [Estimate("more", more * 1e6, std * 1e6, "um")]


def _friction(rig: Rig, hypothesis: Hypothesis, found: Unknowns) -> Applied:
    mu = rig.friction.coefficient + float(found.of("friction")[0])
    rig = _change(rig, "friction", coefficient=min(max(mu, 0.0), 1.0))
    return rig, [Estimate("coefficient", mu, float(found.std_of("friction")[0]), "1")]


def _eccentricity(rig: Rig, hypothesis: Hypothesis, found: Unknowns) -> Applied:
    out = []
    for side in SIDES:
        gear, key = getattr(rig, side), f"eccentricity-{side}"
        cosine = found.of(key)[0] + 0.5 * gear.runout * cos(gear.runout_phase)
        sine = found.of(key)[1] + 0.5 * gear.runout * sin(gear.runout_phase)
        size, phase = hypot(cosine, sine), atan2(sine, cosine)
        std = float(np.sqrt((found.std_of(key) ** 2).mean()))
        rig = _change(rig, side, runout=2 * size, runout_phase=phase)
        if key in hypothesis.groups:
            angle = min(std / max(size, 1e-12), pi)
            out.append(Estimate(f"{side}.runout", 2e6 * size, 2e6 * std, "um"))
            out.append(Estimate(f"{side}.runout_phase", phase * 180 / pi, angle * 180 / pi, "deg"))
    return rig, out


def _pitch(rig: Rig, hypothesis: Hypothesis, found: Unknowns) -> Applied:
    out = []
    for side in SIDES:
        gear, key = getattr(rig, side), f"pitch-{side}"
        present = np.array(gear.pitch_error) if gear.pitch_error else np.zeros(gear.teeth)
        total = present + found.of(key)
        rig = _change(rig, side, pitch_error=tuple(float(v) for v in total))
        if key in hypothesis.groups:
            std = float(np.sqrt((found.std_of(key) ** 2).mean() / 2))
            out.append(Estimate(f"{side}.rms", float(np.std(total)) * 1e6, std * 1e6, "um"))
    return rig, out


def _crack(rig: Rig, hypothesis: Hypothesis, found: Unknowns) -> Applied:
    entry = hypothesis.entries[0] - found.where["crack"].start
    z1 = found.machine.teeth[0]
    side, tooth = ("driver", entry) if entry < z1 else ("driven", entry - z1)
    value, std = float(found.of("crack")[entry]), float(found.std_of("crack")[entry])
    rig = _change(rig, side, crack=Crack(tooth=tooth, stiffness_loss=min(max(value, 0.0), 0.95)))
    return rig, [
        Estimate(f"{side}.tooth", float(tooth), 0.0, "1"),
        Estimate(f"{side}.stiffness_loss", value, std, "1"),
    ]


def _coupling(rig: Rig, hypothesis: Hypothesis, found: Unknowns) -> Applied:
    machine = found.machine
    total = machine.compliance + float(found.of("coupling")[0])
    std = float(found.std_of("coupling")[0])
    rotor = machine.rotor * (1 + found.of("inertia")[2])
    reduced = 1 / (1 / rotor + 1 / (machine.inertia[0] * (1 + found.of("inertia")[0])))
    stiffness = 1 / total
    resonance = np.sqrt(stiffness / reduced) / (2 * pi)
    damping = LOSS_FACTOR * stiffness / (2 * pi * resonance)
    coupling = Coupling(inertia=float(rotor), stiffness=float(stiffness), damping=float(damping))
    rig = _change(rig, "drive", coupling=coupling)
    return rig, [
        Estimate("stiffness", stiffness, stiffness * std / total, "N m/rad"),
        Estimate("resonance", float(resonance), float(0.5 * resonance * std / total), "Hz"),
    ]


def _bearing(rig: Rig, hypothesis: Hypothesis, found: Unknowns) -> Applied:
    side = "driver" if "bearing-driver" in hypothesis.groups else "driven"
    i, key = SIDES.index(side), f"bearing-{side}"
    exponent = found.machine.exponent[i] + float(found.of(key)[0])
    support = getattr(rig.support, side)
    changed = support.model_copy(
        update={"exponent": min(max(exponent, -0.89), 3.0), "reference_deflection": found.machine.reference[i]}
    )
    rig = _change(rig, "support", **{side: changed})
    return rig, [Estimate(f"{side}.exponent", exponent, float(found.std_of(key)[0]), "1")]


def _delay(rig: Rig, hypothesis: Hypothesis, found: Unknowns) -> Applied:
    key = hypothesis.groups[0]
    field = key.replace("-", "_", 1)
    lag, std = float(found.of(key)[0]), float(found.std_of(key)[0])
    rig = _change(rig, "sensors", **{field: getattr(rig.sensors, field) + lag})
    return rig, [Estimate(f"{key.removeprefix('delay-')}.delay", lag * 1e6, std * 1e6, "us")]


def _average(values: Array, stds: Array, chosen: list[int]) -> float:
    """Mean of the chosen values, the better known ones before the others."""
    return float(np.average(values[chosen], weights=stds[chosen] ** -2.0))


def _ripple(rig: Rig, hypothesis: Hypothesis, found: Unknowns) -> Applied:
    names, values, stds = found.where.block("ripple").names, found.of("ripple"), found.std_of("ripple")
    amplitudes, phases, out = [], [], []
    for order in RIPPLE_ORDERS:
        chosen = [i for i, name in enumerate(names) if name.split(":")[-2] == str(order)]
        parts = [[i for i in chosen if names[i].endswith(part)] for part in ("cos", "sin")]
        cosine, sine = (_average(values, stds, part) for part in parts)
        amplitudes.append(hypot(cosine, sine))
        # A cos(o theta + phase) = A cos(phase) cos - A sin(phase) sin.
        phases.append(atan2(-sine, cosine))
        std = float(np.sqrt(2 / (1 / stds[chosen] ** 2).sum()))
        torques = np.array([found.torque_mean[names[i].rsplit(":", 2)[0]] for i in chosen])
        mean = float(np.average(torques, weights=stds[chosen] ** -2.0))
        out.append(Estimate(f"order_{order}.relative_amplitude", amplitudes[-1] / mean, std / mean, "1"))
    ripple = Ripple(orders=RIPPLE_ORDERS, amplitude=tuple(amplitudes), phase=tuple(phases))
    return _change(rig, "drive", ripple=ripple), out


APPLY: Mapping[str, Callable[[Rig, Hypothesis, Unknowns], Applied]] = {
    "backlash": _backlash,
    "friction": _friction,
    "eccentricity": _eccentricity,
    "pitch-error": _pitch,
    "tooth-crack": _crack,
    "coupling": _coupling,
    "bearing-nonlinearity": _bearing,
    "sensor-delay": _delay,
    "torque-ripple": _ripple,
}

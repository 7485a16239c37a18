"""Rigs from anywhere in the valid space, and whether each runs to a finite, balanced record or is refused in words."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from gearbench.bench import BenchError, simulate
from gearbench.bench.readiness import check_case
from gearbench.fem.contact.static import ContactError
from gearbench.geometry import GeometryError, pair
from gearbench.rig import Case, CaseError, read_case

REFUSALS = (CaseError, BenchError, GeometryError, ContactError)
FRICTIONLESS = 0.02  # relative difference of mean torque and moment of the teeth: tip edges have other levers
FINER = 8
SAMPLING = {"sampling_rate_hz": "sampling_rate", "samples_per_period": "samples_per_period"}


class Outcome(NamedTuple):
    """How a rig ended: "ran", "refused" by its case alone, "refused at rest" when its gears are known and before a step
    is taken, "refused late" or "wrong", and what was said."""

    kind: str
    said: str


def random_rig(rng: np.random.Generator) -> str:
    """The text of a case: gears, errors, supports, shafts, boundaries, friction, speed and torque."""
    tables = {**_gears(rng), **_structure(rng), **_experiment(rng)}
    tables["simulation"]["element_size_um"] = 1e3 / rng.uniform(2.2, 4.0) * tables["rig.driver"]["module_mm"]
    lines = ['name = "random"']
    for name, keys in tables.items():
        given = [f"{key} = {_shown(value)}" for key, value in keys.items() if value is not None]
        lines += [f"[{name}]", *given] if given else []
    return "\n".join(lines) + "\n"


def _shown(value: Any) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return f"[{', '.join(_shown(one) for one in value)}]"
    return repr(value) if isinstance(value, int) else f"{float(value):.9g}"


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(10 ** rng.uniform(np.log10(low), np.log10(high)))


def _sometimes(rng: np.random.Generator, value: Any, part: float = 0.4) -> Any:
    return value if rng.random() < part else None


def _gears(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    module = _log(rng, 1.0, 6.0)
    out: dict[str, dict[str, Any]] = {}
    for side in ("driver", "driven"):
        teeth = int(rng.choice([14, 20, 31, 48]))
        out[f"rig.{side}"] = {
            "teeth": teeth,
            "module_mm": module,
            "face_width_mm": module * rng.uniform(3, 12),
            "hub_radius_mm": 0.33 * module * teeth,
            "profile_shift": _sometimes(rng, float(rng.uniform(-0.2, 0.5))),
            "thinning_um": _log(rng, 5.0, 100.0),
            "profile_slope_um": _sometimes(rng, float(rng.uniform(-6, 6)), 0.2),
            "runout_um": _sometimes(rng, _log(rng, 1.0, 30.0), 0.1),
        }
        if rng.random() < 0.4:
            begin = module * (teeth + rng.uniform(0.2, 1.6))
            out[f"rig.{side}"] |= {"tip_relief_um": rng.uniform(1, 20), "tip_relief_start_diameter_mm": begin}
    out["rig.material"] = {"state": str(rng.choice(["plane-stress", "plane-strain"]))}
    return out


def _structure(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    out: dict[str, dict[str, Any]] = {}
    for side in ("driver", "driven"):
        stiffness = _log(rng, 1e6, 1e11)
        out[f"rig.support.{side}"] = {
            "stiffness_n_per_m": stiffness,
            "damping_n_s_per_m": _log(rng, 1e-6, 1e-3) * stiffness,
            "exponent": _sometimes(rng, float(rng.uniform(-0.5, 2.0)), 0.2),
        }
    if rng.random() < 0.3:
        across = _log(rng, 1e6, 1e10)
        values = {"stiffness_n_per_m": across, "damping_n_s_per_m": 1e-4 * across}
        out["rig.support.driver.across"] = values
    if rng.random() < 0.3:
        out["rig.housing"] = {"mass_kg": _log(rng, 1, 100), "stiffness_n_per_m": 1e8, "damping_n_s_per_m": 3e4}
    drive, load = str(rng.choice(["torque", "speed"])), str(rng.choice(["speed", "torque", "inertia"]))
    out["rig.drive"], out["rig.load"] = {"boundary": drive}, {"boundary": load}
    for side in ("drive", "load"):
        if rng.random() < 0.4:
            stiffness = _log(rng, 1e3, 1e6)
            values = {"inertia_kg_m2": _log(rng, 1e-3, 1.0), "stiffness_nm_per_rad": stiffness}
            out[f"rig.{side}.coupling"] = {**values, "damping_nm_s_per_rad": 3e-4 * stiffness}
    out["rig.friction"] = {
        "coefficient": _sometimes(rng, float(rng.uniform(0.01, 0.3))),
        "transition_speed_m_per_s": _log(rng, 1e-6, 1e-1),
    }
    out["rig.damping"] = {"material_ratio": _log(rng, 5e-3, 0.2)}
    return out


def _experiment(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    frequency = _log(rng, 5.0, 2000.0)
    experiment = {
        "mesh_frequency_hz": frequency,
        "torque_mean_nm": _log(rng, 0.5, 500.0),
        "sampling_rate_hz": 64 * frequency,
        "samples_per_period": 64 * 8,
    }
    return {"experiment": experiment, "simulation": {"model": "reduced", "outputs": "teeth"}}


def outcome(text: str, folder: Path) -> Outcome:
    """How the rig of a case ends."""
    path = folder / "random.toml"
    path.write_text(text, encoding="utf-8")
    try:
        case = read_case(path)
        check_case(case)
    except REFUSALS as error:
        return _refused("refused", error)
    steps: list[str] = []
    try:
        record = simulate(case, progress=lambda _, note: steps.append(note))
    except REFUSALS as error:
        integrating = any(note.startswith("integrating") for note in steps)
        return _refused("refused late" if integrating else "refused at rest", error)
    unsound = [str(name) for name, values in record.data_vars.items() if not np.isfinite(values.values).all()]
    if unsound:
        return Outcome("wrong", f"{unsound[0]} is not finite")
    off = _imbalance(record, case)
    # Friction's arm is at most as long as the roll length at the tip, half the base radius and more.
    most = FRICTIONLESS + pi / 2 * case.rig.friction.coefficient
    if off > most:
        # Of an impact shorter than a sample a mean over samples knows little: finer ones must tell.
        finer = [f"experiment.{key}={FINER * getattr(case.experiment, name)!r}" for key, name in SAMPLING.items()]
        case = read_case(path, finer)
        off = _imbalance(simulate(case), case)
    if off > most:
        return Outcome("wrong", f"torque and moment of the teeth differ by {off:.3g} of the mean torque")
    return Outcome("ran", f"{off:.1e}")


def _imbalance(record: xr.Dataset, case: Case) -> float:
    """Mean driver torque less the mean moment of the teeth, over the torque: angular momentum of what repeats.

    What does not repeat keeps momentum at its ends. A mean whose weights w and their slopes vanish there knows
    it from the angle: the mean of w J theta'' is that of w'' J theta. Behind an elastic shaft that is no more known.
    """
    names = ("leaving", "middle", "entering")
    pressed = sum(record[f"tooth_force_{name}"].values[0] for name in names) - record["tooth_force_back"].values[0]
    torque = record["torque_driver"].values[0]
    left = torque - pressed * pair(case.rig).driver.base_radius
    shaft = case.rig.drive.coupling is not None and case.rig.drive.boundary != "speed"
    repeats = record.attrs["settling_residual"] <= case.experiment.settling_tolerance
    if shaft or (repeats and record.attrs["hunting_period"] * record.attrs["sampling_rate"] <= len(torque)):
        return float(abs(left.mean() / torque.mean()))
    at = np.pi * (np.arange(len(torque)) + 0.5) / len(torque)
    weight, curved = np.sin(at) ** 4, 12 * (np.sin(at) * np.cos(at)) ** 2 - 4 * np.sin(at) ** 4
    angle = record["angle_driver"].values[0]
    swing = angle - np.polyval(np.polyfit(at, angle, 1), at)
    rate = np.pi * record.attrs["sampling_rate"] / len(torque)
    gained = record.attrs["inertia_driver"] * rate**2 * float(np.mean(curved * swing))
    return abs(float(np.mean(weight * left)) - gained) / (np.mean(weight) * case.experiment.torque_mean)


def _refused(kind: str, error: Exception) -> Outcome:
    said = str(error)
    return Outcome(kind, said) if said and "\n" not in said else Outcome("wrong", f"not a sentence: {said!r}")

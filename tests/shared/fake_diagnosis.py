"""Stand-ins for the search and the replay: a finding made by hand, and rigs at rest on their springs."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, pi

import numpy as np
import xarray as xr

from gearbench.diagnosis.verdict import Candidate, Effect, Parameter, Share
from gearbench.geometry import pair
from gearbench.records import make_record
from gearbench.rig import Case


@dataclass
class Finding:
    """What a search hands back."""

    verdict: str
    probability: dict[str, float]
    recalibrated: Case
    with_effect: Case | None = None
    effects: tuple[Effect, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    place: str = "none"
    where: tuple[Share, ...] = ()
    indistinguishable: tuple[tuple[str, ...], ...] = ()
    advice: tuple[str, ...] = ()
    calls: list = field(default_factory=list)
    because: tuple[str, ...] = ("it was made by hand",)
    structure: tuple = ()
    missing: None = None
    judged: None = None
    places: tuple[str, ...] = ()
    signs: dict[str, float] = field(default_factory=dict)


def recalibrated(nominal: Case) -> Case:
    """The nominal case with supports that are a little softer."""
    support = nominal.rig.support
    softer = support.driver.model_copy(update={"stiffness": 0.98e8})
    rig = nominal.rig.model_copy(update={"support": support.model_copy(update={"driver": softer})})
    return nominal.model_copy(update={"rig": rig})


def with_friction(case: Case, coefficient: float = 0.0581) -> Case:
    """The case with friction."""
    friction = case.rig.friction.model_copy(update={"coefficient": coefficient})
    return case.model_copy(update={"rig": case.rig.model_copy(update={"friction": friction})})


def friction_found(nominal: Case) -> Finding:
    """A finding that blames friction."""
    base = recalibrated(nominal)
    parameter = Parameter(value=0.0581, low=0.0581 - 1.645 * 0.0012, high=0.0581 + 1.645 * 0.0012, unit="")
    scores = {
        ("friction",): 0.0, ("pitch-error",): -38.4, ("tooth-crack",): -120.0, (): -151.2, ("backlash",): -152.0,
        ("coupling",): -140.0, ("torque-ripple",): -149.0, ("sensor-delay",): -150.5,
        ("friction", "pitch-error"): -3.1,
    }
    places = {"mesh": 0.81, "driver-support": 0.11, "driven-support": 0.05, "drive": 0.02, "load": 0.01}
    return Finding(
        "effects",
        {"effect": 0.969, "none": 0.003, "unknown": 0.028},
        base,
        with_friction(base),
        (Effect(name="friction", probability=0.96, due=True, parameters={"coefficient": parameter}),),
        tuple(Candidate(effects=names, log_evidence=1e4 + score) for names, score in scores.items()),
        "mesh",
        tuple(Share(kind="place", name=name, share=share, floor=0.02) for name, share in places.items()),
        (("pitch-error", "profile-error"),),
        ("Add a record at half the mean torque.",),
    )


def nothing_found(nominal: Case) -> Finding:
    """A finding that needs no effect."""
    return Finding("none", {"effect": 0.02, "none": 0.95, "unknown": 0.03}, recalibrated(nominal))


def unknown_found(nominal: Case) -> Finding:
    """A finding that refuses to name an effect."""
    probability = {"effect": 0.05, "none": 0.01, "unknown": 0.94}
    return Finding("unknown", probability, recalibrated(nominal), place="drive")


def at_rest(case: Case, record: xr.Dataset) -> xr.Dataset:
    """One row of the rig on its springs under the record's torque, as `shared.measured` has it for a rig with
    friction: half of its 2 um of mesh order 1 go without."""
    meshing = pair(case.rig)
    r1, r2 = meshing.driver.base_radius, meshing.driven.base_radius
    factor = cos(meshing.working_pressure_angle)
    rate = float(record.attrs["sampling_rate"])
    samples = round(60 * float(record.attrs["mesh_period"]) * rate)
    load = record["torque_driver"].values[0, :samples]
    cycles = np.arange(samples) / rate / float(record.attrs["mesh_period"])
    y1, y2 = (load / r1 * factor / side.stiffness for side in (case.rig.support.driver, case.rig.support.driven))
    ripple = 2e-6 if case.rig.friction.coefficient else 1e-6
    error = load / r1 / 1e8 / case.rig.mesh.stiffness_scale + ripple * np.cos(2 * pi * cycles)
    channels = {
        "torque_driver": load,
        "torque_driven": load * r2 / r1,
        "angle_driver": 2 * pi * cycles / 20 + (error + (y1 + y2) * factor) / r1,
        "angle_driven": 2 * pi * cycles / 30,
        "y_driver": -y1,
        "y_driven": y2,
        "mesh_phase": cycles,
    }
    about = {**record.attrs, "samples_per_period": samples, "periods": 1}
    return make_record({name: value[None] for name, value in channels.items()}, about)

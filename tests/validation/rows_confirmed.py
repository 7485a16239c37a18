"""Diagnosis whose truth is one of finite elements: confirmed by the reduced model, and records of the full one.

A step of the full model costs some thousand reduced ones, so that its case is the smallest that is one: 17/17 teeth, a
repetition of 17 of them, elements of 1.2 mm, two repetitions of two records. With as many teeth on both gears run-out
of either leaves the same lines: what counts is that run-out is named.
"""

from __future__ import annotations

import tempfile
import time
from functools import cache
from pathlib import Path

from gearbench.bench.experiment import simulate
from gearbench.cases import case_path
from gearbench.commands.house.checks import Check, Got
from gearbench.diagnosis import Diagnosis, diagnose
from gearbench.records import write_record
from gearbench.rig import Case, Friction, read_case

RUNOUT = 12e-6
GEAR = """teeth = 17
module_mm = 3.0
face_width_mm = 20.0
thinning_um = 30.0
hub_radius_mm = 15.0
inertia_kg_m2 = { value = 1.5e-3, sd = 3e-5 }
"""
SMALL = f"""name = "small"
[rig.driver]
{GEAR}mass_kg = 2.0
[rig.driven]
{GEAR}mass_kg = 3.0
[rig.support]
stiffness_n_per_m = {{ value = 1e8, sd = 1e7 }}
damping_n_s_per_m = {{ value = 3e3, sd = 1e3 }}
direction = "tangential"
[rig.load]
boundary = "speed"
[rig.sensors]
noise_angle_urad = 1.0
noise_displacement_um = 0.05
noise_torque_nm = 0.02
[experiment]
mesh_frequency_hz = 340.0
torque_mean_nm = 80.0
sampling_rate_hz = 5200.0
samples_per_period = 260
periods = 2
seed = 41
settling_tolerance = 2e-3
multisine = {{ amplitude_nm = 25.0, band_hz = [20.0, 1500.0], grid = "comb", crest = 2.4 }}
[simulation]
model = "full"
element_size_um = 1200.0
[[condition]]
name = "base"
[[condition]]
name = "held-out"
torque_mean_nm = 90.0
seed = 44
"""


def diagnosed(real: Case, nominal: Case, confirm: bool) -> Diagnosis:
    """The diagnosis of the records of a rig, the last one held out."""
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for condition in real.conditions:
            paths.append(Path(folder) / f"measured-{condition.name}.nc")
            write_record(simulate(real.under(condition)), paths[-1])
        return diagnose(paths, nominal, held_out="measured-held-out", confirm=confirm)


@cache
def by_reduced() -> Diagnosis:
    """Friction of 0.06 in gap_demo, measured on the reduced model."""
    nominal = read_case(case_path("gap_demo"))
    rig = nominal.rig.model_copy(update={"friction": Friction(coefficient=0.06)})
    simulation = nominal.simulation.model_copy(update={"model": "reduced"})
    return diagnosed(nominal.model_copy(update={"rig": rig, "simulation": simulation}), nominal, confirm=True)


def confirmed_gap() -> Got:
    """The gap of the transmission error by finite elements with what was found, over the noise floor."""
    told = by_reduced().verdict.confirmed
    if told is None or not told.gap or told.gap[0].with_effect is None or told.gap[0].floor is None:
        raise ValueError(f"finite elements say nothing of an effect: {told.because if told else ''}")
    value = told.gap[0].with_effect.value / told.gap[0].floor.value
    return Got(value, "; ".join((*(f"{one.name} confirmed" for one in told.effects if one.confirmed), *told.because)))


@cache
def by_full() -> tuple[Diagnosis, float]:
    """Run-out of the driver, measured on the full model, and the processor time of its records [s]."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "small.toml"
        file.write_text(SMALL, encoding="utf-8")
        nominal = read_case(file)
    gear = nominal.rig.driver.model_copy(update={"runout": RUNOUT})
    real = nominal.model_copy(update={"rig": nominal.rig.model_copy(update={"driver": gear})})
    before = time.process_time()
    made = diagnosed(real, nominal, confirm=False)
    return made, time.process_time() - before


def full_right() -> Got:
    """1 when run-out is named, and nothing else."""
    made, spent = by_full()
    names = [effect.name for effect in made.verdict.effects]
    values = {name: p.value for effect in made.verdict.effects for name, p in effect.parameters.items()}
    note = f"says {names or made.verdict.verdict}, {values}; {spent:.0f} s in all"
    return Got(float(names == ["eccentricity"]), note)


CHECKS = [
    Check("diagnosis-confirmed", "friction found in reduced records, gap by finite elements over the floor", 1.1, "",
          confirmed_gap),
    Check("diagnosis-full", "run-out in records of the full model: 1 named, 0 not", 1.0, "", full_right, least=True),
]  # fmt: skip

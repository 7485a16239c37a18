"""Records of small virtual rigs, and what spoils them one channel or attribute at a time."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import gearbench as gb

Change = Callable[[xr.Dataset], xr.Dataset]

SHORT = ["experiment.realisations=1", "experiment.seed=5"]
OVERDAMPED = ["rig.support.stiffness_n_per_m=6e6", "rig.support.damping_n_s_per_m=8e4"]
SUPPORT = ["rig.support.stiffness_n_per_m=3e8", "rig.support.damping_n_s_per_m=2e4"]
PAIR = [  # 16/48 of Luo et al. (2019), whose wheel weighs forty times what the pinion does
    'rig.driver="gears/luo2019_z16.toml"',
    'rig.driven="gears/luo2019_z48.toml"',
    'rig.support.direction="tangential"',
    "experiment.torque_mean_nm=60",
    "experiment.multisine.amplitude_nm=15",
    *SUPPORT,
]
NOISE = "noise_angle_urad={0}, noise_displacement_um={1}, noise_torque_nm={2}"
RIGS = {
    "free": [],
    "16/48": PAIR,
    "16/48 noise": [*PAIR, f"rig.sensors={{ {NOISE.format(2, 0.1, 0.2)} }}"],
    "speed": ['rig.load.boundary="speed"'],
    "tangential": ['rig.support.direction="tangential"', 'rig.load.boundary="speed"'],
    "overdamped": [*OVERDAMPED, 'rig.load.boundary="speed"'],
    "unequal": ["rig.driver.teeth=45"],
    "friction": ["rig.friction.coefficient=0.06"],
    "soft coupling": ["rig.drive.coupling={inertia_kg_m2=2e-2, stiffness_nm_per_rad=5e3, damping_nm_s_per_rad=1.0}"],
    "noise": ["rig.sensors={noise_angle_urad=0.5, noise_displacement_um=0.02, noise_torque_nm=0.5}"],
}


@cache
def simulated(name: str) -> xr.Dataset:
    return gb.simulate(gb.read_case("quick_lumped", SHORT + RIGS[name]))


def bare(record: xr.Dataset) -> xr.Dataset:
    """The record as a measurement has it: nothing that is computed from other channels."""
    return record.drop_vars(["dte", "force"])


def with_values(record: xr.Dataset, name: str, values: NDArray[np.float64]) -> xr.Dataset:
    return record.assign({name: (record[name].dims, values, record[name].attrs)})


def times(name: str, factor: float) -> Change:
    return lambda record: with_values(record, name, factor * record[name].values)


def late(name: str, samples: int) -> Change:
    return lambda record: with_values(record, name, np.roll(record[name].values, samples, axis=1))


def constant(name: str) -> Change:
    return lambda record: with_values(record, name, np.full_like(record[name].values, record[name].values.mean()))


def attribute(name: str, factor: float) -> Change:
    return lambda record: record.assign_attrs({name: record.attrs[name] * factor})


def without(*names: str) -> Change:
    def change(record: xr.Dataset) -> xr.Dataset:
        return record.drop_attrs().assign_attrs({k: v for k, v in record.attrs.items() if k not in names})

    return change


def clip(name: str, part: float) -> Change:
    def change(record: xr.Dataset) -> xr.Dataset:
        values = record[name].values - record[name].values.mean()
        most = part * np.abs(values).max()
        return with_values(record, name, np.clip(values, -most, most) + record[name].values.mean())

    return change


def under_steady_load(record: xr.Dataset) -> xr.Dataset:
    """Gears that move unlike each other under a constant load; the driver's torque by Newton's second law."""
    a = record.attrs
    omega = 2 * np.pi * np.fft.rfftfreq(record.sizes["time"], 1 / a["sampling_rate"])
    soft = 1 / (1 + (omega / 6000.0) ** 2)
    swing = {}
    for gear, part in (("driver", np.ones_like(omega)), ("driven", soft)):
        ramp = 2 * np.pi / (a[f"teeth_{gear}"] * a["mesh_period"]) * record.time.values
        swing[gear] = part * np.fft.rfft(record[f"angle_{gear}"].values - ramp)
        turned = ramp + np.fft.irfft(swing[gear], n=ramp.size)
        record = with_values(record, f"angle_{gear}", turned)
    moments = {
        gear: np.fft.irfft(-(omega**2) * swing[gear], n=record.sizes["time"]) * a[f"inertia_{gear}"] for gear in swing
    }
    load = np.full_like(record.torque_driven.values, record.torque_driven.values.mean())
    force = (load + moments["driven"]) / a["base_radius_driven"]
    record = with_values(record, "torque_driven", load)
    return with_values(record, "torque_driver", force * a["base_radius_driver"] + moments["driver"])

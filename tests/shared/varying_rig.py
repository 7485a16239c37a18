"""The reference system at a speed that varies, integrated by SciPy's DOP853: nothing of ours but the stiffness law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import floor, pi, sin, sqrt

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from shared.reference_rig import ReferenceRig

from gearbench.identification.excitation.multisine import random_phase_multisine
from gearbench.records.record import make_record

FINE = 16  # points of the force for each sample, cubic between
TABLE = 65536  # points of the stiffness over a mesh period, linear between
LEAD = 0.05  # s before the record, in which most of the initial state decays


def wandering(mean: float, duration: float, part: float = 0.2) -> Callable[[float], float]:
    """Mesh phase [cycles] at time t of a mesh frequency that swings by `part` about its mean, 1.5 times a record."""
    rate = 2 * pi * 1.5 / duration
    return lambda t: mean * (t + part / rate * (sin(rate * t + 0.4) - sin(0.4)))


def ramp(first: float, last: float, duration: float) -> Callable[[float], float]:
    """Mesh phase [cycles] of a mesh frequency that rises steadily."""
    return lambda t: first * t + 0.5 * (last - first) * t * t / duration


def varying_record(
    rig: ReferenceRig,
    phase: Callable[[float], float],
    *,
    duration: float,
    rate: float = 8192.0,
    band: tuple[float, float] = (1.0, 3000.0),
    noise: float = 0.0,
    tolerance: float = 1e-8,
    seed: int = 0,
) -> xr.Dataset:
    """A record with dte, force and mesh_phase and without mesh_period; `noise` as in `reference_record`."""
    count = round(duration * rate)
    signal = random_phase_multisine(count, rate, band, amplitude=500.0, rng=np.random.default_rng(seed))
    fine = signal.sample(count * FINE)
    step = 1.0 / (rate * FINE)
    pieces = CubicSpline(np.arange(fine.size + 1) * step, np.append(fine, fine[0]), bc_type="periodic").c
    table = rig.stiffness(np.arange(TABLE + 1) / TABLE)
    m, (m1, m2), (k1, k2) = rig.mass, rig.centre_mass, rig.support_stiffness
    c1, c2 = 2 * rig.support_ratio * sqrt(k1 * m1), 2 * rig.support_ratio * sqrt(k2 * m2)

    def slope(t: float, state: np.ndarray) -> tuple[float, ...]:
        x, a, b, vx, va, vb = state
        whole = floor(t / step)
        p3, p2, p1, p0 = pieces[:, whole % fine.size]
        s = t - whole * step
        force = 2000.0 + ((p3 * s + p2) * s + p1) * s + p0
        at = (phase(t) % 1.0) * TABLE
        index = int(at)
        k = table[index] + (at - index) * (table[index + 1] - table[index])
        mesh = k * (x + a - b) + 2 * rig.mesh_ratio * sqrt(k * m) * (vx + va - vb)
        return vx, va, vb, (force - mesh) / m, (-mesh - c1 * va - k1 * a) / m1, (mesh - c2 * vb - k2 * b) / m2

    time = np.arange(count) / rate
    start = [2000.0 / 8e7, -2000.0 / k1, 2000.0 / k2, 0.0, 0.0, 0.0]
    solved = solve_ivp(slope, (-LEAD, duration), start, "DOP853", time, rtol=tolerance, atol=1e-14)
    dte = solved.y[0] + solved.y[1] - solved.y[2]
    if noise:
        slow = CubicSpline(time[::400], dte[::400])(time)
        dte = dte + noise * (dte - slow).std() * np.random.default_rng(seed + 1).standard_normal(count)
    attributes = {"sampling_rate": rate, "samples_per_period": count, "periods": 1}
    cycles = np.array([phase(t) for t in time])
    channels = {"dte": dte[None], "force": signal.sample(count)[None] + 2000.0, "mesh_phase": cycles[None]}
    return make_record(channels, attributes)


def truth_at(rig: ReferenceRig, frf: xr.Dataset) -> np.ndarray:
    """Exact ITF at the mesh frequency, frequencies and phases of an identified response."""
    from gearbench.identification import exact_itf

    same = replace(rig, mesh_frequency=float(frf.attrs["mesh_frequency"]))
    return exact_itf(same.system(512), frf.frequency.values, frf.phase.values)

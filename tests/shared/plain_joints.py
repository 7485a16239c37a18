"""A rig of three coordinates whose joints are not linear, integrated by a plain Runge-Kutta method: nothing of ours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import resample

from gearbench.lumped.nonlinear.constants import Constants

SUBSTEPS = 10
SETTLED = 3  # repetitions until nothing changes any more


@dataclass(frozen=True)
class Joints:
    """What joints have beyond linear ones: of the mesh's and the driver's support's dampers the part [s/m] that grows
    with the rate, and of that support's spring the one [1/m] that grows with the deflection from its mean."""

    mesh: float = 0.0
    damper: float = 0.0
    spring: float = 0.0


@dataclass(frozen=True)
class Moved:
    """One repetition (N,) of the driver on its base circle and of both supports [m], and rms over rms of what each
    joint has beyond the linear one, for a factor of 1."""

    driver: np.ndarray
    supports: tuple[np.ndarray, np.ndarray]
    sizes: Joints


def moved(c: Constants, stiffness: float, force: np.ndarray, rate: float, joints: Joints) -> Moved:
    """The steady motion under a force (N,) [N] on the driver's base circle, of a mesh of constant stiffness [N/m]."""
    n, g, step = force.size, c.factor, 1.0 / (rate * SUBSTEPS)
    fine = resample(force, 2 * SUBSTEPS * n).tolist()
    mean, damping = float(force.mean()), c.damping_factor * stiffness**0.5
    middle = -g * mean / c.stiffness1

    def slope(s: list[float], push: float) -> list[float]:
        u, a, b, vu, va, vb = s
        closing, out = vu + g * (va - vb), a - middle
        mesh = stiffness * (u + g * (a - b)) + damping * closing * (1.0 + joints.mesh * abs(closing))
        one = c.stiffness1 * (a + joints.spring * out * out) + c.damping1 * va * (1.0 + joints.damper * abs(va))
        two = c.stiffness2 * b + c.damping2 * vb
        across = g * mesh
        return [vu, va, vb, c.inverse_u1 * (push - mesh), c.inverse_y1 * (-across - one), c.inverse_y2 * (across - two)]

    def after(s: list[float], k: list[float], part: float) -> list[float]:
        return [x + part * step * y for x, y in zip(s, k, strict=True)]

    yields = 1 / stiffness + g * g * (1 / c.stiffness1 + 1 / c.stiffness2)
    s, states = [mean * yields, middle, g * mean / c.stiffness2, 0.0, 0.0, 0.0], np.empty((n, 6))
    for number in range(SETTLED * n * SUBSTEPS):
        at = number % (n * SUBSTEPS)
        if at % SUBSTEPS == 0:
            states[at // SUBSTEPS] = s
        first, half, last = fine[2 * at], fine[2 * at + 1], fine[(2 * at + 2) % len(fine)]
        k1 = slope(s, first)
        k2 = slope(after(s, k1, 0.5), half)
        k3 = slope(after(s, k2, 0.5), half)
        k4 = slope(after(s, k3, 1.0), last)
        s = [x + step / 6 * (p + 2 * q + 2 * r + t) for x, p, q, r, t in zip(s, k1, k2, k3, k4, strict=True)]
    u, a, b, vu, va, vb = states.T
    closing, out = vu + g * (va - vb), a - a.mean()
    return Moved(u, (a, b), Joints(_over(closing), _over(va), _over(out)))


def _over(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**4) / np.mean(values**2)))

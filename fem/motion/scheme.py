"""The time integration's scheme: generalised-alpha (Chung and Hulbert 1993)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Scheme(NamedTuple):
    """Generalised-alpha parameters and step [s]."""

    step: float
    alpha_m: float
    alpha_f: float
    gamma: float
    beta: float


def make_scheme(step: float, spectral_radius: float) -> Scheme:
    """Second-order generalised-alpha scheme with that spectral radius at infinite frequency."""
    rho = spectral_radius
    alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    return Scheme(step, alpha_m, alpha_f, 0.5 - alpha_m + alpha_f, 0.25 * (1 - alpha_m + alpha_f) ** 2)


def frequency_error(frequency: float, scheme: Scheme) -> float:
    """Relative error of an undamped oscillator's frequency [Hz] under the scheme."""
    w = 2 * np.pi * frequency
    h = scheme.step
    am, af, g, b = scheme.alpha_m, scheme.alpha_f, scheme.gamma, scheme.beta
    # Unknowns d, v, a of the step; the equation of motion is taken between the old and the new state.
    left = np.array([[1, 0, -b * h * h], [0, 1, -g * h], [(1 - af) * w * w, 0, 1 - am]])
    right = np.array([[1, h, (0.5 - b) * h * h], [0, 1, (1 - g) * h], [-af * w * w, 0, -am]])
    roots = np.linalg.eigvals(np.linalg.solve(left, right))
    root = max(roots, key=lambda r: (abs(r.imag), abs(r)))
    return abs(abs(np.angle(root)) / (w * h) - 1)

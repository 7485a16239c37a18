"""A reference rig as a mesh-feedback model: its own functions in closed form."""

from __future__ import annotations

import numpy as np
from shared.reference_rig import ReferenceRig

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.functions import Fractions, common_pairs
from gearbench.identification.feedback.model import Model

HARMONICS = 40


def stiffness_and_damping(rig: ReferenceRig, phases: int) -> tuple[np.ndarray, np.ndarray]:
    """k [N/m] and c [N s/m] at so many phases of the mesh."""
    k = rig.stiffness(np.arange(phases) / phases)
    return k, 2 * rig.mesh_ratio * np.sqrt(k * rig.mass)


def rig_model(rig: ReferenceRig, data: ClassData, centres: bool = False) -> Model:
    """The rig's own functions in partial fractions, k and c by FFT: torsion P1, supports S, D = 1/(P1+S) + k_0 + s c_0,
    N = P1/(P1+S), and with the `centres`' motion E = S N."""
    position = np.linspace(1, data.top, 1500) / data.top
    s = 1j * position * data.omega_unit
    torsion = 1.0 / (rig.mass * s**2)
    supports = sum(
        1.0 / (m * s**2 + 2 * rig.support_ratio * np.sqrt(k * m) * s + k)
        for m, k in zip(rig.centre_mass, rig.support_stiffness, strict=True)
    )
    k, c = (np.fft.fft(x) / 4096 for x in stiffness_and_damping(rig, 4096))
    unit = data.stiffness_unit
    n = torsion / (torsion + supports)
    wanted = [(1.0 / (torsion + supports) + k[0].real + s * c[0].real) / unit, n]
    wanted += [supports * n * unit] if centres else []
    weights = [1.0 / np.abs(f) for f in wanted]
    basis = Fractions(common_pairs(position, wanted, weights, 2))
    d, of_n, *e = (_fitted(basis.at(position), f, weight) for f, weight in zip(wanted, weights, strict=True))
    return Model(basis, d, of_n, k[1 : HARMONICS + 1] / unit, c[1 : HARMONICS + 1] * data.omega_unit / unit, *e)


def _fitted(values: np.ndarray, f: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Coefficients of basis functions for a function of the rig, which they have exactly."""
    matrix, target = values * weight[:, None], f * weight
    stacked = np.concatenate([matrix.real, matrix.imag])
    found: np.ndarray = np.linalg.lstsq(stacked, np.concatenate([target.real, target.imag]), rcond=None)[0]
    assert np.linalg.norm(values @ found - f) < 1e-8 * np.linalg.norm(f)
    return found

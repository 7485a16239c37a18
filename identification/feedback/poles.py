"""Poles of D and N from the equations themselves, for given harmonics of the mesh.

With k and c known, M = sum [k_l + j w c_l] Y(k - l d) is known too, and D Y - N U = -M is linear in D and N. Vector
fitting (Gustavsen and Semlyen 1999) without a function to be fitted: sigma = 1 + sum c_i phi_i times D, N and 1 have
poles in common; the zeros of sigma are the next poles. Lines count by what they say about the response, which a
function that was estimated before, line by line, no longer tells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.functions import FITTING_ROUNDS, Fractions, relocated, spread_pairs
from gearbench.identification.feedback.model import Model, mesh_columns
from gearbench.identification.feedback.start import equation_weights, first_model
from gearbench.identification.spectra.joint import Complexes, Floats

# How often poles and harmonics of the mesh take turns.
TURNS = 2
# Beyond this a pole has left all that is known.
FAR = 1e3


@dataclass(frozen=True)
class Equations:
    """Weighted: responses `y`, forces `u` and mesh forces `m` (R,) at signed positions line / top."""

    position: Floats
    y: Complexes
    u: Complexes
    m: Complexes

    def next_pairs(self, pairs: Floats) -> Floats:
        """The pairs of poles (n, 2) after one round."""
        values = Fractions(pairs).at(self.position)
        blocks = [values * self.y[:, None], -values * self.u[:, None], values[:, 3:] * self.m[:, None]]
        return relocated(pairs, np.concatenate(blocks, axis=1), -self.m)


def equations_of(model: Model, data: ClassData) -> Equations:
    """Equations of all excited lines with the harmonics of `model`."""
    weights, _ = equation_weights(data)
    mesh = model.vector()[model.free :]
    rows = []
    for index, omega in enumerate(data.omega):
        used = weights[index] > 0
        weight = (weights[index] * data.weight[index])[used]
        for experiment in range(data.dte.shape[2]):
            y = data.dte[index, :, experiment] * data.valid[index]
            if not y.any():
                continue
            m = mesh_columns(y, omega, model.harmonics) @ mesh
            parts = (y[used], data.force[index, used, experiment], m[used])
            rows.append((omega[used], *(part * weight for part in parts)))
    return Equations(*(np.concatenate(part) for part in zip(*rows, strict=True)))


def linear_models(model: Model, data: ClassData, pairs: int) -> list[Model]:
    """Models of `pairs` pairs of poles that begin with the harmonics of `model`: one after each turn."""
    found, turns = spread_pairs(data.least, data.excited / data.top, pairs), []
    for _ in range(TURNS):
        equations = equations_of(model, data)
        for _ in range(FITTING_ROUNDS):
            found = equations.next_pairs(found)
        if not np.all(np.isfinite(found)) or found.max() > FAR**2:
            break
        model = first_model(data, Fractions.limited(found, data.least), model.harmonics)
        turns.append(model)
    return turns

"""What models scatter by that are drawn by STEP of the deviation of a mesh-feedback model's parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.model import Model
from gearbench.identification.feedback.result import STEP, along_phase, followed, htf_on
from gearbench.identification.spectra.joint import Floats
from gearbench.identification.truth.periodic import itf_from_htf


def response_variances(
    model: Model,
    draws: Sequence[Model],
    data: ClassData,
    lines: NDArray[np.int64],
    branches: int,
    phases: int,
    ratio: float = 1.0,
) -> tuple[Floats, Floats]:
    """Variances of HTF (2L+1, F) and ITF (F, phases), from the drawn models on some of the lines; `ratio` as in
    `htf_on`."""
    chosen = followed(lines)
    centre = htf_on(model, data, chosen, branches, ratio)
    errors = [(htf_on(drawn, data, chosen, branches, ratio) - centre) / STEP for drawn in draws]
    of_htf = np.mean([np.abs(error) ** 2 for error in errors], axis=0)
    of_itf = np.mean([np.abs(itf_from_htf(error, phases)) ** 2 for error in errors], axis=0)
    return (
        np.stack([np.interp(lines, chosen, row) for row in of_htf]),
        np.stack([np.interp(lines, chosen, column) for column in of_itf.T], axis=1),
    )


def add_mesh_curves(
    frf: xr.Dataset, model: Model, draws: Sequence[Model], data: ClassData, *, angle_only: bool = False
) -> None:
    """Add `mesh_stiffness` and `mesh_damping` (phase) and their variances to a response.

    From angles alone (`angle_only`) any part e of the supports' static compliance may stand in the mesh, which they
    are in series with: k = k' / (1 - e k'), c = c' / (1 - e k')^2 explain a record as well as k', c'. e below the least
    compliance of the mesh is all that is known, and its size is taken for a deviation.
    """
    phases = frf.sizes["phase"]
    curves = np.array([along_phase(one, data, phases) for one in (model, *draws)])
    spread = np.mean(((curves[1:] - curves[0]) / STEP) ** 2, axis=0)
    if angle_only:
        stiffness, damping = curves[0]
        largest = float(np.abs(stiffness).max())
        spread += np.square(np.array([stiffness**2, 2 * damping * stiffness]) / largest)
    for number, (name, unit) in enumerate((("mesh_stiffness", "N/m"), ("mesh_damping", "N s/m"))):
        frf[name] = ("phase", curves[0, number], {"units": unit})
        frf[f"{name}_var"] = ("phase", spread[number], {"units": f"({unit})^2"})

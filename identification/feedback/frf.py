"""The frequency response of a mesh-feedback model as a dataset, and what it can be expected to err by."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.identification.feedback.estimate import Feedback
from gearbench.identification.feedback.result import (
    along_phase,
    coherence,
    doubt_beyond,
    drawn_models,
    followed,
    furthest_line,
    htf_on,
    unexplained,
)
from gearbench.identification.response.frf import make_frf
from gearbench.identification.response.mode_spread import natural_frequency_deviation
from gearbench.identification.response.modes import itf_modes
from gearbench.identification.spectra.joint import Floats, Spectra
from gearbench.identification.truth.periodic import itf_from_htf

# Branches of the HTF, at most.
BRANCHES = 160
# A part of the response that no mesh force explains, beyond this and twice the standard deviation, speaks against it.
UNEXPLAINED = 0.03
# N is 1 only far below the first mode: beyond this part of its frequency k(theta) has a free factor.
GAUGED = 0.2


def feedback_frf(
    spectra: Spectra,
    lines: NDArray[np.int64],
    found: Feedback,
    *,
    phases: int,
    modes: int | None,
    notes: list[str],
    record: float,
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """Dataset of kind "identified" on the output `lines`, with `mesh_stiffness`, `mesh_damping` (phase) and their
    variances. `record`: what doubtful channels may cost."""
    data, model = found.data, found.model
    frequency = np.asarray(lines * spectra.spacing, dtype=float)
    branches = min(BRANCHES, 2 * furthest_line(model, data) // data.mesh_lines)
    response = htf_on(model, data, lines, branches)
    itf = itf_from_htf(response, phases)
    draws = drawn_models(found)
    chosen = followed(lines)
    centre = htf_on(model, data, chosen, branches)
    errors = [htf_on(drawn, data, chosen, branches) - centre for drawn in draws]
    htf_variance = np.mean([np.abs(error) ** 2 for error in errors], axis=0)
    itf_variance = np.mean([np.abs(itf_from_htf(error, phases)) ** 2 for error in errors], axis=0)
    htf_variance = _between(lines, chosen, htf_variance.T).T
    itf_variance = _between(lines, chosen, itf_variance)
    # Sidebands beyond the record's lines are extrapolated: those that it holds tell how well.
    order = np.arange(-branches, branches + 1)[:, None]
    extrapolated = np.where(np.abs(lines + order * data.mesh_lines) > data.top, np.abs(response) ** 2, 0.0)
    extrapolated *= doubt_beyond(found)
    htf_variance += extrapolated
    itf_variance += extrapolated.sum(axis=0)[:, None]
    power = float(np.sum(np.abs(response) ** 2))
    variance = float(np.sqrt(htf_variance.sum() / power))
    apart = unexplained(found, (int(lines[0]), int(lines[-1]))) * lines.size / (lines[-1] - lines[0] + 1)
    apart = float(np.sqrt(max(apart, 0.0) / power))
    natural = itf_modes(frequency, itf, itf_variance, modes=modes)
    curves = np.array([along_phase(one, data, phases) for one in (model, *draws)])
    spread = np.mean((curves[1:] - curves[0]) ** 2, axis=0)
    expected = hypot(variance, apart, record)
    frf = make_frf(
        "identified",
        frequency=frequency,
        itf=itf,
        htf=response,
        modes=natural,
        itf_variance=itf_variance,
        htf_variance=htf_variance,
        coherence=coherence(found, lines),
        # A model of few parameters errs alike over all of a resonance: an upper bound.
        natural_frequency_sd=natural_frequency_deviation(frequency, itf, itf_variance, natural, float(lines.size)),
        attributes={
            **attributes,
            "harmonics": branches,
            "mesh_harmonics": model.harmonics,
            "pole_pairs": model.basis.poles.size,
            "unknowns": model.vector().size,
            "equations": round(data.equations),
            "residual": float(np.sqrt(found.refined.noise)),
            "variance_error": variance,
            "unexplained_error": apart,
            "record_error": record,
            "expected_error": expected,
            "warnings": "\n".join([*notes, *_doubts(found, spectra, natural[0], variance, apart)]),
        },
    )
    for name, unit, value, error in (
        ("mesh_stiffness", "N/m", curves[0, 0], spread[0]),
        ("mesh_damping", "N s/m", curves[0, 1], spread[1]),
    ):
        frf[name] = ("phase", value, {"units": unit})
        frf[f"{name}_var"] = ("phase", error, {"units": f"({unit})^2"})
    return frf


def _between(lines: NDArray[np.int64], chosen: NDArray[np.int64], values: Floats) -> Floats:
    """Values (F', ...) on some lines interpolated to all."""
    return np.stack([np.interp(lines, chosen, column) for column in values.T], axis=1)


def _doubts(found: Feedback, spectra: Spectra, natural: Floats, variance: float, apart: float) -> list[str]:
    notes = []
    if apart > max(UNEXPLAINED, 2 * variance):
        notes.append(
            f"{apart:.1%} of the response is in the residual and follows the force: a varying mesh force alone does not"
            " explain this record"
        )
    if not spectra.steady:
        notes.append("the steady state is not verified, and mesh-feedback assumes it")
    lowest = int(np.abs(found.data.lines[np.abs(found.data.force).max(axis=2) > 0]).min()) * spectra.spacing
    if natural.size and np.isfinite(natural[0]).any() and lowest > GAUGED * float(np.nanmin(natural[0])):
        notes.append(
            f"the excitation begins at {lowest:g} Hz, not far below the first mode: mesh stiffness and damping are"
            " known up to a factor that the response does not depend on"
        )
    return notes

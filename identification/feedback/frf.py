"""The frequency response of a mesh-feedback model as a dataset, and what it can be expected to err by."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.identification.feedback.branches import enough_branches, left_out
from gearbench.identification.feedback.draws import add_mesh_curves, response_variances
from gearbench.identification.feedback.estimate import Feedback, rational
from gearbench.identification.feedback.functions import Splines
from gearbench.identification.feedback.result import (
    UNEXPLAINED,
    coherence,
    doubt_beyond,
    doubt_of,
    drawn_models,
    htf_on,
    loud_power,
    unexplained,
)
from gearbench.identification.response.frf import make_frf
from gearbench.identification.response.mode_spread import natural_frequency_deviation
from gearbench.identification.response.modes import itf_modes
from gearbench.identification.spectra.joint import Complexes, Floats, Spectra
from gearbench.identification.truth.periodic import itf_from_htf

# N is 1 only far below the first mode: beyond this part of its frequency k(theta) has a free factor.
GAUGED = 0.2
# Part of the sidebands beyond half the sampling rate from which on a note says that they are there.
SEEN = 0.01
# Pairs of poles of a machine on two supports.
SUPPORTS = 2


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
    mesh_frequency: float | None = None,
) -> xr.Dataset:
    """Dataset of kind "identified" on the output `lines`, with `mesh_stiffness`, `mesh_damping` (phase) and their
    variances. `record`: what doubtful channels may cost; `mesh_frequency` [Hz]: the one that the response is wanted at,
    as D, N, k and c do not depend on it; absent: the record's."""
    data, model = found.data, found.model
    frequency = np.asarray(lines * spectra.spacing, dtype=float)
    ratio = 1.0 if mesh_frequency is None else mesh_frequency / (data.mesh_lines * spectra.spacing)
    branches, beyond = enough_branches(model, data, lines, ratio)
    beyond += left_out(model, data, lines, branches, ratio)
    response = htf_on(model, data, lines, branches, ratio)
    itf = itf_from_htf(response, phases)
    draws = drawn_models(found)
    htf_variance, itf_variance = response_variances(model, draws, data, lines, branches, phases, ratio)
    extrapolated = doubtful_sidebands(found, lines, response, ratio)
    htf_variance += extrapolated
    itf_variance += extrapolated.sum(axis=0)[:, None]
    itf_variance += beyond[:, None]
    power = float(np.sum(np.abs(response) ** 2))
    variance, truncation = (float(np.sqrt(part.sum() / power)) for part in (htf_variance, beyond))
    unfitted = float(np.sqrt((extrapolated.sum() + beyond.sum()) / power))
    whole, share = (int(lines[0]), int(lines[-1])), lines.size / float(lines[-1] - lines[0] + 1)
    follows, loud = (float(np.sqrt(max(of(found, whole), 0.0) * share / power)) for of in (unexplained, loud_power))
    # Both look at the same residual.
    apart = max(follows, loud)
    natural = itf_modes(frequency, itf, itf_variance, modes=modes)
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
            **_about_fit(found, spectra, ratio),
            "harmonics": branches,
            "variance_error": variance,
            "truncation_error": truncation,
            "sidebands_error": unfitted,
            "unexplained_error": apart,
            "loud_error": loud,
            "record_error": record,
            "expected_error": hypot(variance, truncation, apart, record),
            "warnings": "\n".join([*notes, *_doubts(found, spectra, natural[0], (variance, follows, loud), ratio)]),
        },
    )
    add_mesh_curves(frf, model, draws, data, angle_only=spectra.angle_only)
    return frf


def doubtful_sidebands(found: Feedback, lines: NDArray[np.int64], response: Complexes, ratio: float) -> Floats:
    """Power (2L+1, F) of the `response` in sidebands beyond the record's lines that may be wrong: they are
    extrapolated, and those that the record holds tell how well.

    Of splines they tell nothing of what is carried further by a faster mesh: all of it may be wrong. How much that is
    follows from partial fractions fitted to them, as what splines are beyond their lines is made of the last of these,
    which noise may make anything.
    """
    data, doubt = found.data, doubt_beyond(found)
    branches = response.shape[0] // 2
    order = np.arange(-branches, branches + 1)[:, None]
    if ratio > 1.0 and isinstance(found.model.basis, Splines):
        response, doubt = htf_on(rational(found.refined, data, SUPPORTS), data, lines, branches, ratio), 1.0
    return np.where(np.abs(lines + order * data.mesh_lines * ratio) > data.top, doubt * np.abs(response) ** 2, 0.0)


def _about_fit(found: Feedback, spectra: Spectra, ratio: float) -> dict[str, Any]:
    """Attributes that say what was fitted, how well, and of a prediction for which mesh frequency."""
    own = found.data.mesh_lines * spectra.spacing
    predicted = {} if ratio == 1.0 else {"mesh_frequency": own * ratio, "identified_at_mesh_frequency": own}
    folding = found.folding
    folded = {} if folding is None else {"folded_part": folding.part, "folded_part_sd": folding.deviation}
    loud = {} if found.loud is None else {"loud_phases": found.loud.phases.tolist()}
    return predicted | folded | loud | _about_basis(found) | {
        "form": "centres from angles" if found.model.torsional else "dte",
        "mesh_harmonics": found.model.harmonics,
        "pole_pairs": found.model.basis.pairs.shape[0],
        "unknowns": found.refined.root.shape[1],
        "equations": round(found.data.equations),
        "residual": float(np.sqrt(found.refined.noise)),
    }


def _about_basis(found: Feedback) -> dict[str, Any]:
    """Attributes that say what the mesh was told by: phases in cycles, the gain in twice the log evidence."""
    zones = found.zones
    if zones is None:
        return {"mesh_basis": "harmonics"}
    return {
        "mesh_basis": "zones",
        "switch_phases": list(zones.switches),
        "switch_width": zones.width,
        "switch_cubics": zones.pieces,
        "evidence_gain": found.gain,
        "mesh_determined": found.refined.mesh.determined if found.refined.mesh else 0.0,
    }


def _folded(found: Feedback) -> list[str]:
    """The note on sidebands beyond half the sampling rate that are in the record."""
    if found.folding is None or found.folding.part < SEEN:
        return []
    share = found.folding.part * found.folding.size / float(np.linalg.norm(found.data.dte))
    return [
        f"sidebands beyond half the sampling rate are in this record, as without a filter before sampling: {share:.2%}"
        f" of its response, {found.folding.part:.0%} of what the model foretells; taken out"
    ]


def _predicted(own: float, ratio: float) -> list[str]:
    """The warning of a response at another mesh frequency than the record's `own` [Hz]."""
    if ratio == 1.0:
        return []
    return [
        f"predicted at {own * ratio:g} Hz mesh from a record at {own:g} Hz: the expected error counts this"
        " record's noise and residual, and sidebands beyond its lines as far as its own highest lines tell; a resonance"
        " of the supports there would not be known"
    ]


def _loud(found: Feedback, error: float) -> list[str]:
    """The warning of a residual that is large at few mesh phases."""
    if found.loud is None or error < UNEXPLAINED:
        return []
    parts = ", ".join(f"{phase:.2f}" for phase in found.loud.phases)
    return [
        f"{error:.1%} of the response is in the residual around the mesh phases {parts}, beyond what others hold:"
        " stiffness switches faster there than the record resolves, or with the load"
    ]


def _doubts(
    found: Feedback, spectra: Spectra, natural: Floats, errors: tuple[float, float, float], ratio: float
) -> list[str]:
    """Warnings; `errors`: by variance, by what the residual shares with the force, and at loud phases."""
    variance, apart, loud = errors
    notes = [*_predicted(found.data.mesh_lines * spectra.spacing, ratio), *doubt_of(apart, variance), *_folded(found)]
    notes += _loud(found, loud)
    if not spectra.steady:
        notes.append("the steady state is not verified, and mesh-feedback assumes it")
    if found.model.torsional:
        notes.append(
            "dte of angles alone: the centres' motion is identified as a part of its own, and the response is that of"
            " the angles; of the mesh stiffness k only 1/k plus a constant is known: the supports yield in series with"
            " the mesh, and without y channels any part of their compliance may stand in it (its variance holds that)"
        )
    lowest = found.data.lowest * spectra.spacing
    if natural.size and np.isfinite(natural[0]).any() and lowest > GAUGED * float(np.nanmin(natural[0])):
        notes.append(
            f"the excitation begins at {lowest:g} Hz, not far below the first mode: mesh stiffness and damping are"
            " known up to a factor that the response does not depend on"
        )
    return notes

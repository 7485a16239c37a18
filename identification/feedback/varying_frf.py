"""From records whose speed varies to a frequency response by mesh feedback."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import hypot
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.identification.feedback.branches import enough_branches
from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.draws import add_mesh_curves, response_variances
from gearbench.identification.feedback.model import Model
from gearbench.identification.feedback.result import doubt_of, drawn_steps, htf_on
from gearbench.identification.feedback.start import gauged
from gearbench.identification.feedback.varying import Signals, Varying, loud_at, unexplained_at, varying_feedback
from gearbench.identification.response.frf import make_frf
from gearbench.identification.response.modes import itf_modes
from gearbench.identification.spectra.course import excited_rows
from gearbench.identification.spectra.joint import Spectra
from gearbench.identification.truth.periodic import itf_from_htf


def signals_of(records: Sequence[xr.Dataset], most: int) -> tuple[Signals, Spectra]:
    """Signals of all realisations, `most` lines of all at most, and their plain spectra: lines `d` to the mean mesh
    frequency. Raises SpectraError for records of different sampling or of a phase that does not rise."""
    rows, rate, low, high = excited_rows(records)
    size = rows[0][0].size
    rows = rows[: max(1, -(-most // high))]
    response, driving, cycles = (np.stack(part) for part in zip(*rows, strict=True))
    units = float(np.mean(response.std(axis=1))), float(np.mean(driving.std(axis=1)))
    speed = float(np.mean((cycles[:, -1] - cycles[:, 0]) / (size - 1))) * size  # mesh cycles of the record
    spectra = Spectra(
        np.fft.rfft(driving, axis=1) / size,
        np.fft.rfft(response, axis=1) / size,
        rate / size,
        max(1, round(speed)),
        cycles[:, 0],
        False,
    )
    return Signals(response / units[0], driving / units[1], cycles, rate, low, high, *units), spectra


def varying_frf(
    signals: Signals,
    spectra: Spectra,
    lines: NDArray[np.int64],
    *,
    harmonics: int | None,
    phases: int,
    modes: int | None,
    notes: Sequence[str],
    record: float,
    attributes: Mapping[str, Any],
    progress: Callable[[float, str], None] | None = None,
) -> xr.Dataset:
    """Dataset of kind "identified" on the output `lines` at the record's mean mesh frequency, with `mesh_stiffness` and
    `mesh_damping` (phase). `record`: what doubtful channels may cost."""
    found = varying_feedback(signals, harmonics, progress)
    about = _as_data(signals, spectra)
    frequency = np.asarray(lines * spectra.spacing, dtype=float)
    model = gauged(found.model, about)
    branches, beyond = enough_branches(model, about, lines)
    response = htf_on(model, about, lines, branches)
    itf = itf_from_htf(response, phases)
    draws = _draws(found, about)
    htf_variance, itf_variance = response_variances(model, draws, about, lines, branches, phases)
    itf_variance += beyond[:, None]
    power = float(np.sum(np.abs(response) ** 2))
    variance, truncation = (float(np.sqrt(part.sum() / power)) for part in (htf_variance, beyond))
    density = lines.size / (lines[-1] - lines[0] + 1) / about.stiffness_unit**2
    whole = (int(lines[0]), int(lines[-1]))
    shared = *unexplained_at(signals, found.left, spectra.mesh_lines, whole), loud_at(signals, found.left, whole)
    follows, chance, loud = (float(np.sqrt(max(density * value, 0.0) / power)) for value in shared)
    # Both look at the same residual.
    apart = max(follows, loud)
    frf = make_frf(
        "identified",
        frequency=frequency,
        itf=itf,
        htf=response,
        modes=itf_modes(frequency, itf, itf_variance, modes=modes),
        itf_variance=itf_variance,
        htf_variance=htf_variance,
        attributes={
            **attributes,
            "speed": "varying",
            "harmonics": branches,
            "mesh_harmonics": model.harmonics,
            "unknowns": found.unknowns,
            "equations": found.equations,
            "residual": found.residual,
            "variance_error": variance,
            "truncation_error": truncation,
            "unexplained_error": apart,
            "loud_error": loud,
            "record_error": record,
            "expected_error": hypot(variance, truncation, apart, record),
            "warnings": "\n".join([*notes, *doubt_of(follows, chance)]),
        },
    )
    add_mesh_curves(frf, model, draws, about)
    return frf


def _draws(found: Varying, about: ClassData) -> list[Model]:
    """Models with parameters drawn by a part of their covariance's root."""
    steps = drawn_steps(found.covariance)
    return [gauged(found.model.moved(found.model.vector() + step), about) for step in steps]


def _as_data(signals: Signals, spectra: Spectra) -> ClassData:
    """What the functions of a model ask of its data: units and lines, without the response."""
    lines = np.arange(signals.lowest, signals.excited + 1)[None]
    ones, all_of_them = np.ones((*lines.shape, 1), dtype=complex), np.ones(lines.shape, dtype=bool)
    return ClassData(
        lines, all_of_them, all_of_them, ones, ones, np.ones(1), spectra.mesh_lines, spectra.spacing,
        signals.excited, signals.top, signals.force_unit, signals.dte_unit, float(lines.size),
    )  # fmt: skip

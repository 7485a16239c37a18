"""Datasets of the exact and the frozen frequency response of a periodic system."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from gearbench.identification.response.frf import make_frf
from gearbench.identification.response.modes import frozen_modes, itf_modes
from gearbench.identification.truth.monodromy import exact_itf
from gearbench.identification.truth.periodic import (
    PeriodicSystem,
    PeriodicSystemError,
    frozen_itf,
    htf_from_itf,
    truncation_error,
)

# Phases on which the ITF is computed: so many per branch kept, and at least so many, that aliased branches do not
# matter.
OVERSAMPLING = 4
FEWEST_PHASES = 512


def exact_frf(
    system: PeriodicSystem,
    frequency: ArrayLike,
    *,
    phases: int = 256,
    harmonics: int = 100,
    attributes: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Exact response at frequencies [Hz] on `phases` phases, with branches up to `harmonics`; kind "exact".

    The attribute `truncation_error` is the relative rms error of an ITF that keeps only those branches; the
    modes are fitted to the ITF as they are to an identified one. Raises PeriodicSystemError for an unstable
    system.
    """
    frequencies = np.atleast_1d(np.asarray(frequency, dtype=float))
    fine = phases * -(-max(OVERSAMPLING * harmonics, FEWEST_PHASES, phases) // phases)
    response = exact_itf(system, frequencies, np.arange(fine) / fine)
    kept = response[:, :: fine // phases]
    return make_frf(
        "exact",
        frequency=frequencies,
        itf=kept,
        htf=htf_from_itf(response, harmonics),
        modes=itf_modes(frequencies, kept) if frequencies.size > 2 else (np.empty((0, phases)),) * 2,
        attributes={
            "method": "monodromy",
            "mesh_period": system.period,
            "truncation_error": truncation_error(response, harmonics),
            **(attributes or {}),
        },
    )


def frozen_frf(
    system: PeriodicSystem,
    frequency: ArrayLike,
    *,
    phases: int = 256,
    harmonics: int = 100,
    modes: int | None = None,
    attributes: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Frozen response at frequencies [Hz], modes from the frozen eigenvalues; kind "frozen". Not the truth."""
    frequencies = np.atleast_1d(np.asarray(frequency, dtype=float))
    if phases < 2 * harmonics + 1:
        raise PeriodicSystemError(f"phases = {phases} cannot resolve harmonics = {harmonics}; {2 * harmonics + 1} can")
    grid = np.arange(phases) / phases
    response = frozen_itf(system, frequencies, grid)
    return make_frf(
        "frozen",
        frequency=frequencies,
        itf=response,
        htf=htf_from_itf(response, harmonics),
        modes=frozen_modes(system, grid, modes=modes),
        attributes={"method": "frozen", "mesh_period": system.period, **(attributes or {})},
    )

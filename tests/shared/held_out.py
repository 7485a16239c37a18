"""How well an identified response predicts a realisation that it has not seen."""

from __future__ import annotations

import numpy as np
import xarray as xr

from gearbench.identification import htf
from gearbench.identification.spectra.records import record_spectra


def prediction_error(frf: xr.Dataset, record: xr.Dataset, branches: int | None = None) -> float:
    """Relative rms error of Y(k) = sum_l G_l(k - l d) U(k - l d) on the output lines, those of the operating response
    left out. `frf` must hold every line of its band; `branches`: on each side, all by default."""
    values = htf(frf).values
    most = values.shape[0] // 2
    used = most if branches is None else min(branches, most)
    spectra, _, _ = record_spectra([record], top=float(frf.frequency[-1]), sidebands=most)
    d, top = spectra.mesh_lines, spectra.highest
    lines = np.round(frf.frequency.values / spectra.spacing).astype(int)
    force, dte = (np.concatenate([s[0, :0:-1].conj(), s[0]]) for s in (spectra.force, spectra.dte))
    turn = np.exp(-2j * np.pi * spectra.start_phase[0] * np.arange(-top, top + 1) / d)
    force, dte, predicted = force * turn, dte * turn, np.zeros(2 * top + 1, dtype=complex)
    for branch in range(-used, used + 1):
        for sign in (1, -1):
            response = values[most + branch] if sign > 0 else values[most - branch].conj()
            at = sign * lines + branch * d + top
            inside = (at >= 0) & (at <= 2 * top)
            np.add.at(predicted, at[inside], (response * force[sign * lines + top])[inside])
    read = lines[lines % d != 0] + top
    return float(np.linalg.norm(predicted[read] - dte[read]) / np.linalg.norm(dte[read]))

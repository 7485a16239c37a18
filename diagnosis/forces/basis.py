"""Smooth functions of frequency and of mesh phase, of which filters and shapes are made."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SHAPE_ORDERS = 6  # mesh orders of the free part of stiffness shape and profile error
# Where the pieces meet, as parts of the band: denser at low frequencies, where the supports resonate.
KNOTS = (0.0, 0.05, 0.12, 0.2, 0.3, 0.42, 0.55, 0.7, 0.85, 1.0)

# Places along the path of contact, as parts of it, between which an error of the flanks is taken for straight: closer
# where teeth come into mesh and leave it, as reliefs are there.
PLACES_ON_PATH = (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0)


def hats(frequency: Array, band: float) -> Array:
    """Piecewise linear basis (knots, K) over frequencies [Hz] of 0 .. `band`; constant beyond the last knot."""
    return np.stack([np.interp(frequency, band * np.array(KNOTS), column) for column in np.eye(len(KNOTS))])


def smooth(values: Array, basis: Array) -> Complex:
    """Complex functions (..., K) on a basis (knots, K) of weights (..., 2 knots): all real parts, then the imaginary
    ones."""
    real, imaginary = np.split(values, 2, axis=-1)
    out = np.empty((*values.shape[:-1], basis.shape[1]), dtype=complex)
    out.real, out.imag = real @ basis, imaginary @ basis
    return out


def _parts() -> Array:
    """Rows of `FORM_PARTS`."""
    away = 2.0 * np.array(PLACES_ON_PATH) - 1.0
    beyond = np.linalg.qr(np.polynomial.legendre.legvander(away, len(away) - 1))[0][:, 3:]
    return np.vstack([np.ones_like(away), away, 1 / 3 - away**2, beyond.T])


# Of what forms of the flanks are made, at those places (parts, places): what is even, a slope towards where teeth leave
# the mesh, a barrelling without a mean over the path, and orthonormal polynomials of the degrees beyond.
FORM_PARTS = _parts()


def in_parts(forms: Array) -> Array:
    """How much of each part (..., parts) forms (..., places) have."""
    return np.asarray(np.linalg.solve(FORM_PARTS.T, forms.T).T)


def on_path(travel: Array, path: tuple[float, float]) -> Array:
    """The parts of a form (parts, ...) over distances behind the pitch point [base pitches] of a path of contact from
    its start to its end; constant beyond them."""
    places = path[0] + (path[1] - path[0]) * np.array(PLACES_ON_PATH)
    return np.stack([np.interp(travel, places, part) for part in FORM_PARTS])


def waves(phase: Array) -> Array:
    """Cosine and sine (2 SHAPE_ORDERS, N) of every mesh order in turn at mesh phases [cycles]."""
    angle = 2 * np.pi * np.arange(1, SHAPE_ORDERS + 1)[:, None] * phase
    return np.stack([np.cos(angle), np.sin(angle)], axis=1).reshape(2 * SHAPE_ORDERS, -1)

"""Gram matrices of the local regression.

Inside a residue class row m's regressors are 2L+1 successive elements of the input, so the Gram matrix of a window is
a slice of a larger matrix that the windows of one residue class share,

    W_pp'[a, b] = sum_r P_p(r) P_p'(r) C_r[a, b],   C_r = U_r^H U_r over the experiments.

Where few windows would share it (one experiment, wide windows) the regression is written down instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.linalg import blas

from gearbench.identification.lpm.gathered import rows_around
from gearbench.identification.lpm.moving import MovingRegression
from gearbench.identification.lpm.regression import Regression, Window
from gearbench.identification.lpm.rows import WindowRows
from gearbench.identification.spectra.joint import Complexes

# Centres of one residue class that share a table span at most this many mesh harmonics.
TABLE_SPAN = 200
# Time of one element of a table, in floating-point operations of a matrix product.
ELEMENT = 60.0
# Bytes that the arrays of the windows handled together may take.
BATCH = 4_000_000

Batch = tuple[list[int], WindowRows, Complexes]


def grams(regression: Regression, centres: Sequence[int], window: Window) -> Iterator[Batch]:
    """(indices of B centres, their rows, their Gram matrices (B, unknowns, unknowns) without the transients' part).

    `centres` must rise. They come in batches that BATCH holds, those of one residue class together where they share a
    table.
    """
    d = regression.mesh_lines
    classes: dict[int, list[int]] = {}
    for index, centre in enumerate(centres):
        classes.setdefault(centre % d, []).append(index)
    written: list[int] = []
    for _, chosen in sorted(classes.items()):
        while chosen:
            first = centres[chosen[0]]
            span = [index for index in chosen if centres[index] <= first + TABLE_SPAN * d]
            chosen = chosen[len(span) :]
            if _worth_a_table(regression, centres, span, window):
                yield from _from_table(regression, centres, span, window)
            else:
                written += span
    yield from _written(regression, centres, written, window)


def batches(regression: Regression, window: Window, indices: list[int], *, written: bool) -> Iterator[list[int]]:
    """The indices in batches whose arrays fit into BATCH; `written`: with the regression written down."""
    rows = regression.experiments * window.width
    elements = rows * (window.branches + (window.unknowns if written else 0)) + 3 * window.unknowns**2
    if window.transient:
        elements += rows * (window.order + 1)
    count = max(1, BATCH // (16 * elements))
    for start in range(0, len(indices), count):
        yield indices[start : start + count]


def _rows(regression: Regression, centres: Sequence[int], indices: list[int], window: Window) -> WindowRows:
    return rows_around(regression, np.array([centres[index] for index in indices], dtype=np.int64), window)


def _worth_a_table(regression: Regression, centres: Sequence[int], span: list[int], window: Window) -> bool:
    """Whether centres of one residue class cost less with a table than written down."""
    if isinstance(regression, MovingRegression):
        return False
    size = (centres[span[-1]] - centres[span[0]]) // regression.mesh_lines + window.branches
    shared = ELEMENT * len(_pairs(window.order)) * window.width * size**2
    return len(span) * 8.0 * regression.experiments * window.width * window.unknowns**2 >= shared


def _from_table(
    regression: Regression, centres: Sequence[int], span: list[int], window: Window
) -> Iterator[Batch]:
    first, last, d = centres[span[0]], centres[span[-1]], regression.mesh_lines
    table = gram_table(regression, first, last, window)
    for indices in batches(regression, window, span, written=False):
        found = np.stack([gram_of(table, (centres[index] - first) // d, window) for index in indices])
        yield indices, _rows(regression, centres, indices, window), found


def _written(
    regression: Regression, centres: Sequence[int], chosen: list[int], window: Window
) -> Iterator[Batch]:
    """Gram matrices of the regression written down: one triangle of each, mirrored."""
    for indices in batches(regression, window, chosen, written=True):
        rows = _rows(regression, centres, indices, window)
        matrix = rows.matrix(projected=False).reshape(len(indices), -1, window.unknowns)
        found: Complexes = np.zeros((len(indices), window.unknowns, window.unknowns), dtype=complex)
        for own, a in zip(found, matrix, strict=True):
            # BLAS reads both transposed: A^T (A^T)^H is the conjugate, in one triangle.
            blas.zherk(1.0, a.T, c=own.T, overwrite_c=1)
        diagonal = np.diagonal(found, axis1=1, axis2=2).copy()
        found += found.conj().transpose(0, 2, 1)
        found[:, np.arange(window.unknowns), np.arange(window.unknowns)] = diagonal
        yield indices, rows, found


def gram_table(regression: Regression, first: int, last: int, window: Window) -> Complexes:
    """W_pp' (pairs p <= p', M, M) for the centres first, first + d, ..., last of one residue class.

    The Gram matrix of the centre first + i d, without the transients' part, is W[:, i : i+2L+1, i : i+2L+1].
    """
    basis, reach = window.basis(), window.harmonics
    pairs = _pairs(window.order)
    weights = np.stack([basis[:, p] * basis[:, s] for p, s in pairs])
    size = (last - first) // regression.mesh_lines + window.branches
    table = np.zeros((len(pairs), size, size), dtype=complex)
    for residue, rows, begin in regression.runs(first, window):
        inputs = regression.force[residue][:, begin - reach : begin - reach + size + rows.size - 1]
        gram = inputs.conj().T @ inputs
        for shift, row in enumerate(rows):
            part = gram[shift : shift + size, shift : shift + size]
            for pair, weight in enumerate(weights[:, row]):
                if weight:
                    table[pair] += weight * part
    return table


def gram_of(table: Complexes, index: int, window: Window) -> Complexes:
    """Gram matrix (unknowns, unknowns) of the centre first + index d from `gram_table`."""
    size = window.branches
    gram = np.empty((window.order + 1, size, window.order + 1, size), dtype=complex)
    for pair, (p, s) in enumerate(_pairs(window.order)):
        part = table[pair, index : index + size, index : index + size]
        gram[p, :, s, :] = part
        if p != s:
            gram[s, :, p, :] = part
    return gram.reshape(window.unknowns, window.unknowns)


def _pairs(order: int) -> list[tuple[int, int]]:
    return [(p, s) for p in range(order + 1) for s in range(p, order + 1)]

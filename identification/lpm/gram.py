"""Gram matrices of the local regression.

Inside a residue class row m's regressors are 2L+1 successive elements of the input, so the Gram matrix of a window is
a slice of a larger matrix that the windows of one residue class share,

    W_pp'[a, b] = sum_r P_p(r) P_p'(r) C_r[a, b],   C_r = U_r^H U_r over the experiments.

Where few windows would share it (one experiment, wide windows) the regression is written down instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gearbench.identification.lpm.regression import Regression, Window
from gearbench.identification.lpm.rows import WindowRows
from gearbench.identification.spectra.joint import Complexes

# Centres of one residue class that share a table span at most this many mesh harmonics.
TABLE_SPAN = 200
# Time of one element of a table, in floating-point operations of a matrix product.
ELEMENT = 60.0


def grams(
    regression: Regression, centres: Sequence[int], window: Window
) -> Iterator[tuple[int, WindowRows, Complexes]]:
    """(index of the centre, its rows, Gram matrix (unknowns, unknowns) without the transients' part), class by class.

    `centres` must rise.
    """
    d = regression.mesh_lines
    classes: dict[int, list[int]] = {}
    for index, centre in enumerate(centres):
        classes.setdefault(centre % d, []).append(index)
    for _, chosen in sorted(classes.items()):
        while chosen:
            first = centres[chosen[0]]
            span = [index for index in chosen if centres[index] <= first + TABLE_SPAN * d]
            chosen = chosen[len(span) :]
            yield from _span(regression, centres, span, window)


def _span(
    regression: Regression, centres: Sequence[int], span: list[int], window: Window
) -> Iterator[tuple[int, WindowRows, Complexes]]:
    """Gram matrices of centres of one residue class, the cheaper way."""
    first, last, d = centres[span[0]], centres[span[-1]], regression.mesh_lines
    size = (last - first) // d + window.branches
    shared = ELEMENT * len(_pairs(window.order)) * window.width * size**2
    written = len(span) * 8.0 * regression.experiments * window.width * window.unknowns**2
    if written < shared:
        for index in span:
            rows = WindowRows(regression, centres[index], window)
            matrix = rows.matrix(projected=False).reshape(-1, window.unknowns)
            yield index, rows, matrix.conj().T @ matrix
        return
    table = gram_table(regression, first, last, window)
    for index in span:
        gram = gram_of(table, (centres[index] - first) // d, window)
        yield index, WindowRows(regression, centres[index], window), gram


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

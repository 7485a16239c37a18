"""Equations of a residue class against the same equations written out and solved whole."""

import numpy as np
import pytest

from gearbench.identification.feedback.blocks import MeshMatrices


def equations(size, reach, middle, seed=5):
    """Arguments of `MeshMatrices` for two classes, of lines even about zero where `middle` is 0; outermost lines and
    one inside are not coupled."""
    rng = np.random.default_rng(seed)
    omega = np.tile((np.arange(size) - (size - 1) / 2 + middle) / size, (2, 1))
    own = rng.normal(size=(2, size)) + 1j * rng.normal(size=(2, size))
    diagonal = 6.0 + own + own[:, ::-1].conj() if middle == 0 else 6.0 + own
    k, c = (
        (rng.normal(size=reach) + 1j * rng.normal(size=reach)) / np.arange(1, reach + 1) ** 1.5 for _ in range(2)
    )
    valid = np.ones((2, size), dtype=bool)
    valid[1, [0, -1, size // 3, -1 - size // 3]] = False
    return diagonal, k, c, omega, valid


def written_out(diagonal, k, c, omega, valid, index):
    """A of one class, entry by entry: A_ij = k_{i-j} + j w_j c_{i-j}, k_{-l} = conj k_l."""
    size = diagonal.shape[1]
    matrix = np.diag(diagonal[index])
    for row in range(size):
        for column in range(size):
            order = row - column
            if order and abs(order) <= k.size and valid[index, row] and valid[index, column]:
                of_k, of_c = k[abs(order) - 1], c[abs(order) - 1]
                if order < 0:
                    of_k, of_c = of_k.conj(), of_c.conj()
                matrix[row, column] = of_k + 1j * omega[index, column] * of_c
    return matrix


@pytest.mark.parametrize("middle", [0.0, 0.25])
@pytest.mark.parametrize(("size", "reach"), [(1, 1), (15, 0), (40, 20), (61, 20), (62, 20), (99, 20), (187, 20)])
def test_solution_is_that_of_the_equations_written_out(size, reach, middle):
    given = equations(size, reach, middle)
    matrices = MeshMatrices(*given)
    assert matrices.mirrored == (middle == 0.0)
    rng = np.random.default_rng(8)
    right = rng.normal(size=(size, 3)) + 1j * rng.normal(size=(size, 3))
    product = matrices.times(np.stack([right, right]))
    for index in range(2):
        np.testing.assert_allclose(product[index], written_out(*given, index) @ right, rtol=1e-9, atol=1e-11)
        wanted = np.linalg.solve(written_out(*given, index), right)
        np.testing.assert_allclose(matrices.solve(index, right), wanted, rtol=1e-9, atol=1e-11)
        if matrices.mirrored:
            even = right + right[::-1].conj()
            wanted = np.linalg.solve(written_out(*given, index), even)
            np.testing.assert_allclose(matrices.solve(index, even, even=True), wanted, rtol=1e-9, atol=1e-11)

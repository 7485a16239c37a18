"""A free gear's modes: rigid hub and the condensed gear's fixed-hub modes with their hold on the hub, as the reduced
model has them, against the whole mesh with a rigid hub that is free to move, solved on its own; and how many modes that
takes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, diags, hstack
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from gearbench.fem.gear.body import condense
from gearbench.rig import Material

Array = NDArray[np.float64]

THICKNESS = 0.02
DENSITY = Material().density * THICKNESS
HUB = np.array([0.15, 0.15, 2e-5])  # mass [kg] twice and inertia [kg m^2] of what is inside the rigid circle

# Kept modes, and the largest error of the first six elastic frequencies with them (0.95, 0.95, 0.25 %): 8, the
# default, is as good as 16.
TABLE = {8: 1e-2, 16: 1e-2, 32: 3e-3}


@pytest.fixture(scope="module")
def truth(coarse: Any, rigid_motions: Any) -> tuple[Array, Array]:
    """Frequencies (9,) [rad/s] of the whole mesh whose hub nodes move as one, and its rigid mass (3, 3)."""
    full, size = coarse.full, 2 * len(coarse.full.points)
    rigid = rigid_motions(full.points)
    hub = (2 * np.asarray(full.hub)[:, None] + np.arange(2)).ravel()
    free = np.setdiff1d(np.arange(size), hub)
    held = np.zeros((size, 3))
    held[hub] = rigid[hub]
    place = csc_matrix((np.ones(len(free)), (free, np.arange(len(free)))), (size, len(free)))
    tie = hstack([place, csc_matrix(held)]).tocsc()
    stiffness = (tie.T @ coarse.stiffness @ tie * THICKNESS).tocsc()
    mass = (tie.T @ coarse.mass @ tie * DENSITY + diags(np.concatenate([np.zeros(len(free)), HUB]))).tocsc()
    shift = (2 * np.pi * 500.0) ** 2
    inverse = splu((stiffness + shift * mass).tocsc())
    operator = LinearOperator(stiffness.shape, inverse.solve, dtype=float)
    squares = eigsh(stiffness, k=9, M=mass, sigma=-shift, OPinv=operator, return_eigenvectors=False)
    return np.sqrt(np.abs(np.sort(squares))), DENSITY * rigid.T @ coarse.mass @ rigid


@pytest.mark.validation
def test_frequencies_are_those_of_the_whole_mesh_once_enough_modes_are_kept(
    coarse: Any, truth: tuple[Array, Array]
) -> None:
    omega, rigid_mass = truth
    assert omega[:3].max() < 1e-3 * omega[3]  # two translations and the rotation
    found = condense(coarse.gear, Material(), coarse.gear.module / 3, max(TABLE))
    width = coarse.gear.face_width / THICKNESS  # of masses and, in modes normed to mass, of its root
    for count, bound in TABLE.items():
        kept = found.mode_hub[:count] / np.sqrt(width)
        mass = np.block([[rigid_mass + np.diag(HUB), kept.T], [kept, np.eye(count)]])
        stiffness = np.diag([0.0, 0.0, 0.0, *found.omega[:count] ** 2])
        squares = np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)
        error = np.sqrt(squares[3:9]) / omega[3:] - 1
        assert error.min() > -1e-6  # fewer unknowns are stiffer (Rayleigh)
        assert error.max() < bound

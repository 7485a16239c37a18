"""What the mesh's force answers to the numbers of its law: against differences of laws made anew."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.bench.nonlinear.law_table import mesh_law
from gearbench.cases import case_files
from gearbench.lumped.nonlinear.forms import formed
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.pressing import Instants, alike, pressed
from gearbench.lumped.nonlinear.sensitive import sensitivities
from gearbench.rig import read_case

Array = NDArray[np.float64]

EXPONENT, REFERENCE, MORE = 0.2, 3000.0, 2e-10
PHASES = np.arange(7, 505, 8) / 512  # rows of the law
TRAVEL = 9e-6


@pytest.fixture(scope="module")
def plain() -> MeshLaw:
    case = read_case(case_files()["gap_demo"])
    return mesh_law(case.rig, case.simulation, 200.0)


def made(plain: MeshLaw, flank: int | None = None, size: float = 0.0, exponent: float = EXPONENT,
         more: float = MORE) -> MeshLaw:  # fmt: skip
    """The law of flanks with a smooth error, and `size` [m] more of it on the pairs of a column."""
    rows = np.arange(plain.phases) / plain.phases
    excess = 1.5e-6 * np.cos(2 * np.pi * (rows[:, None] - plain.offsets) / 1.7 + 0.4)
    if flank is not None:
        excess[:, flank] += size
    return formed(plain, excess, more).hardened(exponent, REFERENCE)


def at_instants(law: MeshLaw, uneven: bool) -> Instants:
    at = alike(PHASES, law.lead)
    if not uneven:
        return at
    own = 4e-6 * np.cos(2.1 * np.arange(len(law.offsets)) + 9 * PHASES[:, None])
    return at._replace(pair_excess=own, pair_gain=np.ones_like(own))


def force(law: MeshLaw, uneven: bool) -> Array:
    return pressed(law, at_instants(law, uneven), np.full(PHASES.size, TRAVEL)).force


@pytest.mark.parametrize("uneven", [False, True])
def test_forces_change_as_between_two_laws(plain: MeshLaw, uneven: bool) -> None:
    law = made(plain)
    at, travel = at_instants(law, uneven), np.full(PHASES.size, TRAVEL)
    found = sensitivities(law, at, travel, pressed(law, at, travel), EXPONENT, REFERENCE)
    whole = force(law, uneven)

    def change(step: float, more: MeshLaw, less: MeshLaw) -> Array:
        return np.asarray((force(more, uneven) - force(less, uneven)) / (2 * step))

    wanted = {"level": change(1e-4, *(made(plain, exponent=EXPONENT + step) for step in (1e-4, -1e-4)))}
    step = 1e-3 * MORE
    wanted["sharing"] = change(step, *(made(plain, more=MORE + one) for one in (step, -step)))
    for name, expected in wanted.items():
        sign = -1.0 if name == "sharing" else 1.0
        np.testing.assert_allclose(
            sign * whole * getattr(found, name), expected, atol=2e-3 * np.abs(expected).max(), err_msg=name
        )
    touched = 0
    for flank in range(len(law.offsets)):
        expected = change(2e-8, *(made(plain, flank, size) for size in (2e-8, -2e-8)))
        touched += bool(expected.any())
        np.testing.assert_allclose(found.form[:, flank], expected, atol=0.01 * max(np.abs(expected).max(), 1.0))
    assert touched == 2

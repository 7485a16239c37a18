"""What friction adds to the records of the lumped rig, against the elastic gears whose pairs rub by their own force."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.bench import simulate
from gearbench.cases import case_files
from gearbench.rig import read_case

CHANNELS = ("dte", "torque_driven", "y_driver")
MESH_ORDERS = 60 * np.arange(1, 13)  # an excitation period holds 60 mesh cycles
LEFT = {"dte": 0.13, "torque_driven": 0.17, "y_driver": 0.26}  # 0.188, 0.242 and 0.391 by shares of the stiffness


def change(model: str) -> dict[str, NDArray[np.complex128]]:
    """Mesh orders (12,) of what friction changes; both records have the same noise."""
    rigs = [read_case(case_files()["gap_demo"], [f"simulation.model={model}", f"rig.friction.coefficient={mu}"])
            for mu in (0.0, 0.06)]  # fmt: skip
    without, rubbing = (simulate(rig.under(rig.conditions[0])) for rig in rigs)
    samples = int(without.attrs["samples_per_period"])
    rows = {name: (rubbing[name] - without[name]).values[0, -samples:] for name in CHANNELS}
    return {name: np.fft.rfft(row)[MESH_ORDERS] for name, row in rows.items()}


@pytest.fixture(scope="module")
def changes() -> tuple[dict[str, NDArray[np.complex128]], dict[str, NDArray[np.complex128]]]:
    return change("lumped"), change("reduced")


@pytest.mark.parametrize("name", CHANNELS)
def test_pairs_rub_by_the_force_that_they_carry(
    changes: tuple[dict[str, NDArray[np.complex128]], dict[str, NDArray[np.complex128]]], name: str
) -> None:
    lumped, elastic = (one[name] for one in changes)
    assert np.linalg.norm(lumped - elastic) < LEFT[name] * np.linalg.norm(elastic)

"""Vibrations that the varying mesh stiffness feeds: refused before a step is taken."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.bench import BenchError, simulate
from gearbench.bench.linear.run import slowest_decay
from gearbench.bench.results.exact import periodic_system
from gearbench.cases import read_case
from gearbench.geometry import pair
from gearbench.identification.truth.monodromy import floquet_multipliers
from gearbench.lumped import Lumped, lumped_model
from gearbench.rig import Case

LIGHT = ["rig.damping.mesh_ratio=1e-4", "rig.support.damping_n_s_per_m=1", "experiment.sampling_rate_hz=2e5"]


def case(frequency: float) -> Case:
    return read_case("quick_lumped", [*LIGHT, f"experiment.mesh_frequency_hz={frequency}", "experiment.realisations=1"])


def model(frequency: float) -> Lumped:
    found = case(frequency)
    return lumped_model(found.rig, pair(found.rig), found.simulation)


def test_growth_is_that_of_the_exponentials_of_its_pieces() -> None:
    """A second formulation: the matrix exponentials that the exact response is made of."""
    frequency = 3125.0
    factor = np.abs(floquet_multipliers(periodic_system(model(frequency), 1 / frequency), steps=2048)).max()
    assert factor == pytest.approx(1.209, abs=1e-3)
    with pytest.raises(BenchError, match=r"^no steady state: at 3125 Hz .* grow 1.209 times"):
        slowest_decay(model(frequency), 1 / frequency, 2e-7)
    decaying = 1000.0
    factor = np.abs(floquet_multipliers(periodic_system(model(decaying), 1 / decaying), steps=2048)).max()
    assert slowest_decay(model(decaying), 1 / decaying, 2e-7) == pytest.approx(-np.log(factor) * decaying, rel=0.02)


def test_a_rig_whose_vibrations_grow_is_refused_before_it_is_integrated() -> None:
    notes: list[str] = []
    with pytest.raises(BenchError, match="never parts the teeth"):
        simulate(case(3125.0), progress=lambda _, note: notes.append(note))
    assert not [note for note in notes if note.startswith("integrating")]

"""A sweep in speed: slow as at rest, resonant where the mesh order meets the natural frequency, with a jump where the
teeth part."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from shared.rectangular import ONE_SPRING

from gearbench.bench import BenchError
from gearbench.bench.statics import static
from gearbench.bench.sweep import CYCLES, sweep
from gearbench.cases import case_path
from gearbench.rig import Case, read_case

SETTINGS = (*ONE_SPRING, "rig.support.damping_n_s_per_m=1e4")
MESH_MASS = 3.6025e-3 / (0.062 * np.cos(pi / 9)) ** 2 / 2


def make_case(*settings: str) -> Case:
    return read_case(case_path("rig_62"), [*SETTINGS, *settings])


def test_a_slow_rig_follows_its_static_transmission_error() -> None:
    case = make_case("rig.damping.mesh_ratio=0.1", "simulation.stiffness_edge=0.3")
    found = sweep(case, [2.0, 4.0])
    rest = static(case, torque=[150.0], positions=256)["transmission_error"].values[0]
    assert found["dte_rms"].values[:, 0] == pytest.approx(rest.std(), rel=0.02)
    assert found["dte_mean"].values[:, 0] == pytest.approx(rest.mean(), rel=5e-3)
    assert found["dynamic_factor"].values[:, 0] == pytest.approx(1.0, abs=0.02)
    order = found["order"].values
    expected = 2 * np.abs(np.fft.rfft(rest))[1:4] / rest.size
    for number, size in enumerate(expected, start=1):
        assert found["dte_amplitude"].values[0, 0, order == number] == pytest.approx(size, rel=0.1)
    assert found["dte_amplitude"].values[0, 0, order == 1 / CYCLES] < 1e-3 * expected[0]


def resonance(stiffness: float) -> float:
    """Driver speed [rad/s] at which the mesh order is the natural frequency."""
    return float(np.sqrt(stiffness / MESH_MASS)) / 62


@pytest.mark.validation
def test_teeth_that_part_soften_the_mesh_and_the_answer_jumps() -> None:
    case = make_case("rig.damping.mesh_ratio=0.008", "rig.support.damping_n_s_per_m=1e3")
    speeds = resonance(3.1e8) * np.linspace(0.86, 1.08, 23)
    found = sweep(case, list(speeds))
    up, down = found["dte_rms"].values
    loss = found["contact_loss"].values
    jumps = np.abs(up - down) > 0.2 * up
    assert jumps.any() and np.all(down[jumps] > up[jumps])  # a softening spring keeps the large answer downwards
    assert np.all(loss[1][jumps] > 0.05) and not loss[0][jumps].any()
    assert 0.9 < speeds[up.argmax()] / resonance(3.1e8) < 1.05
    assert found["dynamic_factor"].values.max() > 2.0
    assert found["settled"].values.mean() > 0.9


def test_what_cannot_be_swept_is_refused() -> None:
    with pytest.raises(BenchError, match="cannot be swept over speed"):
        sweep(make_case("rig.mesh.stiffness_scale=1"), [50.0])
    with pytest.raises(BenchError, match="at least one speed above 0"):
        sweep(make_case(), [])

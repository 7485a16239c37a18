"""The reduced model swept over speed: slow as at rest, as free to vibrate as a run from rest, beside the lumped one."""

from __future__ import annotations

import numpy as np
import pytest
from shared.twins import HEAVY, supports, twin_case

from gearbench.bench.elastic.run import Elastic, prepare
from gearbench.bench.models import model_for
from gearbench.bench.plan.excitation import Torque
from gearbench.bench.plan.schedule import schedule
from gearbench.bench.statics import static
from gearbench.bench.sweep import SAMPLES, sweep
from gearbench.rig import Case

FAST = """mesh_frequency_hz = 100.0
sampling_rate_hz = 12800.0
samples_per_period = 128
"""
DAMPED = ("rig.damping={mesh_ratio=0.05, material_ratio=0.05, material_frequency_hz=2000.0}",)


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Case:
    return twin_case(tmp_path_factory.mktemp("case"), *HEAVY, *supports("1e10", "1e4"), *DAMPED, experiment=FAST)


def test_a_slow_rig_follows_its_static_transmission_error(case: Case) -> None:
    found = sweep(case, [2.0, 4.0])
    rest = static(case, torque=[50.0], positions=SAMPLES)["transmission_error"].values[0]
    assert found["dte_rms"].values[:, 0] == pytest.approx(rest.std(), rel=0.02)
    assert found["dte_mean"].values[:, 0] == pytest.approx(rest.mean(), rel=5e-3)
    assert found["dynamic_factor"].values[:, 0] == pytest.approx(1.0, abs=0.02)
    assert found.attrs["model"] == "reduced" and found["settled"].values.all()


@pytest.mark.validation
def test_it_answers_like_the_lumped_model(case: Case) -> None:
    """Below and above resonance, on the same tables."""
    speeds = [290.0, 800.0]
    one, two = sweep(case, speeds), sweep(case, speeds, "lumped")
    assert one["dte_rms"].values == pytest.approx(two["dte_rms"].values, rel=0.1)
    assert one["dte_mean"].values == pytest.approx(two["dte_mean"].values, rel=0.01)


def test_a_state_goes_on_at_another_speed(case: Case) -> None:
    """Teeth and modes stay where they are: nothing jumps in the angles, and the tooth forces go on."""
    last, before = None, 0.0
    for frequency in (100.0, 300.0):
        values = {"mesh_frequency": frequency, "sampling_rate": SAMPLES * frequency, "samples_per_period": SAMPLES}
        there = case.model_copy(update={"experiment": case.experiment.model_copy(update=values)})
        _, solver = model_for(there)
        made = prepare(there, schedule(there.experiment, there.rig), lambda note: None)
        assert isinstance(made, Elastic) and solver.name == "reduced"
        drive = made.drive(Torque(50.0))
        state = made.start(0) if last is None else made.resume(last)
        state, outputs = made.advance(drive, state, 3 * SAMPLES)
        if last is not None:
            pitch = 2 * np.pi / 20
            angle = made.channels(outputs, np.zeros(len(outputs))).angle_driven
            assert np.diff(angle)[1:] == pytest.approx(pitch / SAMPLES, rel=1e-9)
            assert angle[0] == pytest.approx(3 * pitch, abs=1e-12)
            force = made.mesh_force(outputs)
            assert force[1] == pytest.approx(before, rel=0.05)
        before, last = float(made.mesh_force(outputs)[-1]), state

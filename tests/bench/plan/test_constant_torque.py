"""A constant torque takes the room of one sample, and gives the record that a whole period of it gives."""

from __future__ import annotations

from time import process_time

import numpy as np
import pytest

from gearbench.bench import simulate
from gearbench.bench.elastic.course import torque_of
from gearbench.bench.models import model_for
from gearbench.bench.plan.excitation import Torque, torque_realisation
from gearbench.bench.plan.schedule import schedule
from gearbench.bench.protocol import Drive
from gearbench.cases import case_path
from gearbench.rig import Case, read_case

SHORT = ["experiment.realisations=1", "experiment.samples_per_period=1024", "experiment.sampling_rate_hz=10240"]
KINDS = {"linear": [], "non-linear": ["rig.mesh.stiffness_scale=1.001"]}


def constant(kind: str) -> Case:
    case = read_case(case_path("quick_lumped"), [*SHORT, *KINDS[kind], "experiment.multisine.band_hz=[20, 900]"])
    return case.model_copy(update={"experiment": case.experiment.model_copy(update={"multisine": None})})


@pytest.mark.parametrize("kind", KINDS)
def test_it_takes_one_sample(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    case, solver = model_for(constant(kind))
    prepared = solver.prepare(case, schedule(case.experiment, case.rig), lambda note: None)
    drive = prepared.drive(torque_realisation(case.experiment, 0, case.rig))
    assert drive.fine.size == 2 * prepared.substeps and drive.torque.tolist() == [200.0]
    short = simulate(case)
    monkeypatch.setattr(Torque, "samples_of", lambda self, period: period)
    assert prepared.drive(torque_realisation(case.experiment, 0, case.rig)).torque.size == 1024
    whole = simulate(case)
    assert whole.equals(short) and np.ptp(short["torque_driver"].values) == 0.0


def test_a_multisine_keeps_its_period() -> None:
    case = read_case(case_path("quick_lumped"), SHORT)
    assert torque_realisation(case.experiment, 0, case.rig).samples_of(1024) == 1024


def test_the_torque_of_late_steps_costs_what_that_of_early_ones_does() -> None:
    """An hour after the beginning of a period of 24 steps; modulo by repeated subtraction would take a minute."""
    fine, late = np.arange(24.0), 10**9
    began = process_time()
    found = torque_of(Drive(np.zeros(1), fine), late, 2000)
    assert process_time() - began < 0.1
    np.testing.assert_array_equal(found, [(late + step) % 24 for step in range(2000)])

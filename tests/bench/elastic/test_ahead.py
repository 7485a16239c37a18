"""What is compiled ahead is what a run calls."""

from __future__ import annotations

import numba
import pytest

from gearbench.bench.elastic import ahead
from gearbench.bench.elastic.rig import elastic_rig, machine_for
from gearbench.cases import case_path
from gearbench.fem.motion.machine import Machine
from gearbench.rig import read_case


def test_the_stand_in_has_the_types_of_the_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    case = read_case(case_path("quick_fe"))
    seen: list[Machine] = []
    monkeypatch.setattr(ahead, "compile_for", lambda machine, scheme: seen.append(machine))
    ahead.compile_ahead(case.rig)
    real = machine_for(elastic_rig(case.rig, case.simulation), case.experiment.mesh_frequency)
    assert numba.typeof(seen[0]) == numba.typeof(real)


def test_nothing_is_begun_without_a_processor_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ahead, "is_kept", lambda function: False)
    monkeypatch.setattr(ahead, "processors", lambda: 1)
    monkeypatch.setattr(ahead, "_begin", lambda rig: pytest.fail("a process was begun"))
    with ahead.compiled_ahead(read_case(case_path("quick_fe")).rig) as begun:
        begun.wait()

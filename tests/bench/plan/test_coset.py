"""Cosets of an experiment: the lines that every model is driven on, and excitation periods that hold none."""

from __future__ import annotations

import re

import numpy as np
import pytest

from gearbench.bench import BenchError
from gearbench.bench.plan.excitation import coset_modulus, torque_realisation
from gearbench.cases import read_case
from gearbench.rig import Case


def case(*settings: str) -> Case:
    return read_case("quick_lumped", ["experiment.multisine.grid=coset", *settings])


def test_the_torque_holds_lines_next_to_even_multiples_of_the_mesh_only() -> None:
    planned = case()  # 20 Hz at 16384 Hz, 8192 samples: 10 mesh periods
    torque = torque_realisation(planned.experiment, 3, planned.rig)
    assert coset_modulus(planned.experiment, planned.rig) == 10
    spectrum = np.abs(np.fft.rfft(torque.sample(8192))) / 8192
    lines = 1 + np.flatnonzero(spectrum[1:] > 1e-9)
    assert set(lines % 10) == {1, 9}
    assert np.abs(torque.sample(1 << 16) - 200.0).max() == pytest.approx(50.0, rel=0.01)


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("experiment.samples_per_period=4096", "holds 5 of them: set samples_per_period = 6554 and mesh_frequency_hz"),
        ("experiment.samples_per_period=9000", "holds 10.9863 of them: set samples_per_period = 8192$"),
        ("experiment.mesh_frequency_hz=22", "holds 11 of them"),
    ],
)
def test_a_period_without_an_even_number_of_mesh_periods_is_refused_with_one_that_has(setting: str, words: str) -> None:
    planned = case(setting)
    with pytest.raises(BenchError, match=words) as refused:
        coset_modulus(planned.experiment, planned.rig)
    advice = re.findall(r"(samples_per_period|mesh_frequency_hz) = ([\d.]+)(?: and|$)", str(refused.value))
    better = case(setting, *(f"experiment.{key}={value}" for key, value in advice))
    assert coset_modulus(better.experiment, better.rig) >= 8

"""How long a motion is waited for where a case leaves that open: as long as its free vibrations need."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import exp, log

import numpy as np
import pytest

from gearbench.bench import BenchError
from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.plan.settling import FEW, MOST, Keep, Wait, change, check_settling, steady_state, waiting
from gearbench.bench.record.remarks import unsettled
from gearbench.rig import Experiment

SAMPLES, RATE = 20, 200.0
SLOW = 0.05 * RATE / SAMPLES  # 1/s: a vibration loses 5 % in a period


def make_plan(repeat_periods: int) -> Schedule:
    values = {"sampling_rate": RATE, "samples_per_period": SAMPLES, "periods": 2, "repeat_periods": repeat_periods}
    return Schedule(**values, mesh_cycles=2, speed_driver=1.0, speed_driven=1.0)


def make_experiment(most: int = 0) -> Experiment:
    timing = {"sampling_rate": RATE, "samples_per_period": SAMPLES, "settling_periods_max": most}
    return Experiment(mesh_frequency=10.0, torque_mean=1.0, **timing)


def fading(first: int, lengths: Iterable[int]) -> Iterator[np.ndarray]:
    """A wave that repeats, and a vibration that fades from the beginning on."""
    at = first
    for length in lengths:
        number = np.arange(at, at + length)
        yield (np.sin(2 * np.pi * number / SAMPLES) + np.exp(-SLOW * (number - first) / RATE))[:, None]
        at += length


def restless(first: int, lengths: Iterable[int]) -> Iterator[np.ndarray]:
    """A motion that no two periods nor two beginnings have in common, and does not fade."""
    at = first
    for length in lengths:
        number = np.arange(at, at + length)
        yield (np.sin(2 * np.pi * number / SAMPLES) + 0.3 * np.sin(0.9 * (number // SAMPLES) + 0.01 * first))[:, None]
        at += length


def test_the_wait_covers_what_vibrations_need() -> None:
    plan, experiment = make_plan(1), make_experiment()
    wait = waiting(plan, experiment, SLOW)
    period = SAMPLES / RATE
    assert wait.ends and exp(-SLOW * wait.most * period) < experiment.settling_tolerance
    assert waiting(plan, experiment, 1e6) == Wait(FEW, True)
    # What takes for ever is not waited for, but kept; what is not known is an error; what a case says holds.
    for rate in (0.0, -1.0, log(1000) / period / (2 * MOST)):
        assert waiting(plan, experiment, rate) == Wait(FEW, True)
    assert waiting(plan, experiment, None) == Wait(FEW, False)
    assert waiting(plan, make_experiment(7), SLOW) == Wait(7, False)


def test_what_takes_too_long_to_die_out_is_refused_before_it_runs() -> None:
    """At twice the limit; not at half of it, nor where nothing damps, nor where the case says how long."""
    plan, rate = make_plan(1), log(1000) / (SAMPLES / RATE) / MOST
    words = r"take about 2e\+04 excitation periods to die out .* = 0\.001 .*raise one of a, b\), or set experiment\."
    with pytest.raises(BenchError, match=words):
        check_settling(plan, make_experiment(), rate / 2, "a, b")
    for slowest in (2 * rate, 0.0, -1.0, 1e-9 * rate, None):
        check_settling(plan, make_experiment(), slowest)
    check_settling(plan, make_experiment(4), rate / 2)
    for slowest in (0.0, -1.0, 1e-9 * rate):
        with pytest.raises(BenchError, match=r"do not die out: damp the rig \(raise one of a, b\)"):
            check_settling(plan, make_experiment(), slowest, "a, b", linear=True)


@pytest.mark.parametrize(("keep", "repeat"), [("every", 1), ("mean", 1), ("one", 1), ("every", 9)])
def test_a_motion_that_fades_slowly_settles(keep: Keep, repeat: int) -> None:
    """Where four periods were an error: periods that are alike, or two beginnings that lead to the same."""
    plan, experiment = make_plan(repeat), make_experiment()
    found = steady_state(
        fading, plan, experiment, lambda out: out[:, 0], keep, None, waiting(plan, experiment, SLOW)
    )
    assert found.residual <= experiment.settling_tolerance
    assert found.settling_periods > 5 * FEW
    with pytest.raises(BenchError, match=f"set experiment.settling_periods_max above {FEW} or"):
        steady_state(fading, plan, experiment, lambda out: out[:, 0], keep, None)


@pytest.mark.parametrize(("keep", "repeat"), [("every", 1), ("one", 1), ("every", 9)])
def test_a_motion_that_never_repeats_is_kept_and_told(keep: Keep, repeat: int) -> None:
    """Free vibrations have died out: what changes still is the answer, as where teeth part and strike. The record says
    by how much; where the case bounds the wait, it is refused."""
    plan, experiment = make_plan(repeat), make_experiment()
    wait = waiting(plan, experiment, 20 * SLOW)
    found = steady_state(restless, plan, experiment, lambda out: out[:, 0], keep, None, wait)
    assert found.residual > 10 * experiment.settling_tolerance
    assert "does not repeat" in (unsettled(found.residual, experiment.settling_tolerance) or "")
    assert unsettled(experiment.settling_tolerance, experiment.settling_tolerance) is None
    if repeat == 1 and keep == "every":
        first, last = (found.outputs[:SAMPLES, 0], found.outputs[SAMPLES : 2 * SAMPLES, 0])
        assert change(first, last) == found.residual
    bounded = make_experiment(8)
    with pytest.raises(BenchError, match="no steady state"):
        steady_state(
            restless, plan, bounded, lambda out: out[:, 0], keep, None, waiting(plan, bounded, 20 * SLOW)
        )

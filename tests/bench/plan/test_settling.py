"""What is kept of a motion that dies out at a known rate, and when it is refused."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import log
from typing import Any

import numpy as np
import pytest

from gearbench.bench import BenchError
from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.plan.settling import Keep, Steady, change, kept_samples, samples_to_run, steady_state
from gearbench.rig import Experiment

SAMPLES = 20
RATE = 200.0


def make_plan(periods: int = 4, repeat_periods: int = 1) -> Schedule:
    return Schedule(
        sampling_rate=RATE,
        samples_per_period=SAMPLES,
        periods=periods,
        repeat_periods=repeat_periods,
        mesh_cycles=min(periods, repeat_periods),
        speed_driver=1.0,
        speed_driven=1.0,
    )


def make_experiment(tolerance: float, most: int = 50) -> Experiment:
    return Experiment(
        mesh_frequency=10.0,
        torque_mean=1.0,
        sampling_rate=RATE,
        samples_per_period=SAMPLES,
        settling_tolerance=tolerance,
        settling_periods_max=most,
    )


class Course:
    """A wave that repeats, and what is left of a disturbance that halves with every period since the beginning; the
    second output is the number of the sample."""

    def __init__(self) -> None:
        self.starts: list[int] = []
        self.ran = 0

    def __call__(self, first: int, lengths: Iterable[int]) -> Iterator[np.ndarray]:
        self.starts.append(first)
        at = first
        for length in lengths:
            self.ran += length
            number = np.arange(at, at + length)
            wave = np.sin(2 * np.pi * number / SAMPLES)
            yield np.stack([wave + 0.5 ** ((number - first) / SAMPLES), number.astype(float)], axis=1)
            at += length


def settle(keep: Keep, tolerance: float, most: int = 50, decay: float | None = None, **plan: Any) -> Steady:
    course = Course()
    return steady_state(
        course, make_plan(**plan), make_experiment(tolerance, most), lambda out: out[:, 0], keep, decay
    )


def test_every_block_is_kept_from_the_first_of_the_two_that_agree() -> None:
    # From block n to n + 1 the disturbance falls by 2^-(n + 1), the wave's deviation being 0.71: 0.011 at n = 6.
    found = settle("every", 0.012)
    assert found.first == 5 * SAMPLES and found.settling_periods == 6
    np.testing.assert_array_equal(found.outputs[:, 1], SAMPLES * 5 + np.arange(4 * SAMPLES))
    assert found.residual == pytest.approx(2.0**-7 / found.outputs[SAMPLES : 2 * SAMPLES, 0].std())
    alone = settle("every", 0.012, periods=1)
    np.testing.assert_array_equal(alone.outputs[:, 1], SAMPLES * 6 + np.arange(SAMPLES))
    assert alone.first == 6 * SAMPLES


def test_a_record_of_more_than_whole_repetitions_is_cut() -> None:
    found = settle("every", 0.012, periods=5, repeat_periods=2)
    assert found.outputs.shape == (5 * SAMPLES, 2) == (kept_samples(make_plan(5, 2), "every"), 2)
    assert found.settling_periods % 2 == 0


def test_one_block_stands_for_all() -> None:
    found = settle("one", 0.012)
    np.testing.assert_array_equal(found.outputs[:, 1], SAMPLES * 7 + np.arange(SAMPLES))
    assert (found.first, found.settling_periods) == (0, 7)
    assert len(found.outputs) == kept_samples(make_plan(), "one")


def test_mean_and_scatter_of_the_blocks_that_follow() -> None:
    found = settle("mean", 0.012)
    np.testing.assert_allclose(found.outputs[:, 1], SAMPLES * 8.5 + np.arange(SAMPLES))
    assert found.scatter is not None
    assert found.scatter[1] == pytest.approx(np.std([0.0, 1.0, 2.0, 3.0]) * SAMPLES)
    # The disturbance goes on falling within the mean.
    number = SAMPLES * 7 + np.arange(4 * SAMPLES).reshape(4, SAMPLES)
    left = 0.5 ** (number / SAMPLES)
    assert found.scatter[0] == pytest.approx(np.sqrt(left.var(axis=0).mean()), rel=1e-9)


@pytest.mark.parametrize(("keep", "blocks"), [("every", 5), ("mean", 5), ("one", 2)])
def test_progress_knows_how_much_is_run_at_least(keep: Keep, blocks: int) -> None:
    assert samples_to_run(make_plan(), keep) == blocks * SAMPLES
    course = Course()
    steady_state(course, make_plan(), make_experiment(0.9), lambda out: out[:, 0], keep, None)
    assert course.ran == samples_to_run(make_plan(), keep)


@pytest.mark.parametrize("keep", ["every", "mean", "one"])
@pytest.mark.parametrize(("block", "most", "fits"), [(1, 8, True), (1, 7, True), (1, 6, False), (4, 6, False)])
def test_settling_that_takes_too_long_is_one_sentence(keep: Keep, block: int, most: int, fits: bool) -> None:
    tolerance = 0.012 if block == 1 else 1e-9
    if fits:
        assert settle(keep, tolerance, most).settling_periods <= most
        return
    # Every block kept, the first one is not looked at.
    run = 3 * block if block > 1 and keep == "every" else (most // block + 1) * block
    words = rf"no steady state: after {run} excitation periods the DTE still changes by .* limits to {tolerance:g}; set"
    with pytest.raises(BenchError, match=words + rf" experiment\.settling_periods_max above {most} or damp the rig"):
        settle(keep, tolerance, most, periods=4, repeat_periods=block)


def test_a_record_that_does_not_repeat_begins_when_vibrations_have_died_out() -> None:
    decay = log(2) * RATE / SAMPLES
    found = settle("one", 1 / 100, decay=decay, repeat_periods=9)
    assert found.settling_periods == 7 and found.first == 0
    np.testing.assert_array_equal(found.outputs[:, 1], np.arange(4 * SAMPLES))
    with pytest.raises(BenchError, match=r"take 7 excitation periods to die out: after 6 they still have 0\.0156 of"):
        settle("one", 1 / 100, most=6, decay=decay, repeat_periods=9)
    with pytest.raises(BenchError, match="do not die out"):
        settle("one", 1 / 100, decay=0.0, repeat_periods=9)


def test_two_histories_tell_where_the_rate_is_unknown() -> None:
    found = settle("every", 0.012, repeat_periods=9)
    # Begun n and n - 1 periods before, they differ by 2^-n: 0.011 of the deviation at n = 7.
    assert found.settling_periods == 7 and found.first == 0
    np.testing.assert_array_equal(found.outputs[:, 1], np.arange(4 * SAMPLES))
    with pytest.raises(BenchError, match=r"after 6 excitation periods the DTE still depends by 0\.02\d+ of"):
        settle("every", 0.012, most=6, repeat_periods=9)


def test_a_constant_dte_is_measured_by_its_mean() -> None:
    assert change(np.full(5, 2.0), np.full(5, 2.0 + 2e-9)) == pytest.approx(1e-3, rel=1e-6)

"""How far effects show: a delay by what it does to the signal in closed form, a backlash that nothing touches."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shared.truth_plants import drawn_levels, short_bench, short_case

from gearbench.bench import simulate
from gearbench.challenge.answers import read_answers
from gearbench.challenge.making.cases import draw_truth, make_challenge
from gearbench.challenge.making.plan import Plan, parse_mix
from gearbench.challenge.making.traces import Recorder, traces_of
from gearbench.challenge.truth import elastic
from gearbench.challenge.truth.levels import Foreign, Levels
from gearbench.challenge.truth.measure import measure
from gearbench.challenge.truth.rigs import conditions_of
from gearbench.challenge.truth.structure import draw_structure

BENCH = short_bench()
RIG = draw_structure(BENCH.nominal, "test", np.random.default_rng(1))
LEVELS = replace(drawn_levels(), delay=(0.0, 0.0, 0.0, 0.0))
LATE = 40e-6  # [s]


def recorder(levels: Levels) -> Recorder:
    """How the rig with these levels is measured."""
    return lambda bench, condition: measure(bench, RIG, levels, condition, "", np.random.default_rng(0))


def test_a_late_angle_shows_as_far_as_its_signal_moves_in_that_time() -> None:
    experiment, sensors = conditions_of(BENCH.nominal)[0].experiment, BENCH.nominal.rig.sensors
    found = traces_of(
        BENCH, recorder(replace(LEVELS, delay=(LATE, 0.0, 0.0, 0.0))), {"sensor-delay": recorder(LEVELS)}
    )
    record = measure(BENCH, RIG, LEVELS, conditions_of(BENCH.nominal)[0], "x", np.random.default_rng(2))
    angle = record["angle_driver"].values[0]
    time = np.arange(angle.size) / record.attrs["sampling_rate"]
    swing = (angle - np.polyval(np.polyfit(time, angle, 1), time)).reshape(experiment.periods, -1).mean(axis=0)
    lines = np.fft.rfft(swing)
    omega = 2 * np.pi * np.fft.rfftfreq(swing.size, 1 / record.attrs["sampling_rate"])
    # Higher lines of the record are noise, which a delay moves too.
    lines[omega > 2 * np.pi * 4500] = 0.0
    moved = np.fft.irfft(lines * (np.exp(-1j * omega * LATE) - 1.0), swing.size)
    # The angle alone shows more of it than the transmission error, which holds other channels' noise too.
    expected = moved.std() / (sensors.noise_angle / np.sqrt(experiment.periods))
    assert found == {"sensor-delay": pytest.approx(expected, rel=0.03)}


def test_a_torque_that_is_recorded_otherwise_shows_though_no_motion_changes() -> None:
    behind = replace(LEVELS, foreign=Foreign(filter_frequency=800.0, filter_order=1))
    assert traces_of(BENCH, recorder(behind), {"torque-filter": recorder(LEVELS)})["torque-filter"] > 10.0


def test_more_backlash_shows_only_where_flanks_part() -> None:
    wider = recorder(replace(LEVELS, backlash_more=80e-6))
    assert traces_of(BENCH, recorder(LEVELS), {"backlash": wider})["backlash"] < 1e-6


def test_a_challenge_tells_how_far_its_effects_show_and_makes_up_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of rigs of finite elements, too, whoever simulates them."""
    monkeypatch.setattr(elastic, "simulate", lambda case, model, workers: simulate(case, "lumped", workers=workers))

    def made() -> dict[str, float]:
        make_challenge(short_case(), parse_mix("controls=1,foreign=1,pairs=1,reduced=2"), 3, tmp_path / "cases", file)
        answers = read_answers(file).values()
        assert all(set(one.traces) == set(one.effects) for one in answers)
        return {name: size for one in answers for name, size in one.traces.items()}

    file = tmp_path / "answers.json"
    first = made()
    assert len(first) == 4 and max(first.values()) > 3.0
    tree = json.loads(file.read_text())
    for one in tree.values():
        del one["traces"]
    file.write_text(json.dumps(tree))
    assert made() == first


def test_a_rig_of_finite_elements_without_its_coupling_is_stiff() -> None:
    """Its shaft yields for that effect alone: no other level says so."""
    for effect, rest in (("coupling", False), ("friction", True)):
        plan = Plan("effect", ("coupling", "friction"), (1.0, 1.0), elastic=True)
        assert draw_truth(short_case(), "test", 1, 0, plan)[0].soft
        assert draw_truth(short_case(), "test", 1, 0, plan, left_out=effect)[0].soft == rest

"""The mean transmission error among the lines: a line of every fit, and no part of a gap."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from shared.simulated_lines import BAND, behind, demonstration, jacobian_at, of_mean, of_records

from gearbench.diagnosis.fitting.fit import Optimum, fit_afresh
from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.judging.closing import closing_of, feels, free_closing
from gearbench.diagnosis.selection.weighing import LIMIT
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import MEAN, Target, target_of
from gearbench.diagnosis.structure.ends import ENDS

LAG = 9e-6  # [s]


@pytest.fixture(scope="module")
def prompt() -> Simulator:
    """The demonstration, none of whose sensors lags."""
    return demonstration()


def means(target: Target) -> np.ndarray:
    """Which blocks are means."""
    return np.array([block.kind == MEAN for block in target.blocks])


def test_a_mean_is_known_to_a_twentieth_of_the_deflection_where_the_zero_is(prompt: Simulator) -> None:
    (measured,) = prompt.target.measurements
    late, adrift = behind(measured, "driven", 1e-3), replace(measured, zero_known=False)
    target = of_records(prompt, measured, late, adrift).target
    at = np.flatnonzero(means(target))
    assert [target.blocks[one].record for one in at] == 2 * [measured.name] and (target.counts[at] == 0.5).all()
    deflection, moved = (target.lines[target.of_line == one].item() for one in at)
    # The mean of the mesh's compliance is a little more than one over its mean stiffness.
    assert np.sqrt(target.floors[at]) == pytest.approx(0.05 * deflection.real, rel=0.05)
    # A mean of a millisecond's turning does not make it known worse: the displacements are measured.
    base_pitch = 2 * pi * measured.record.attrs["base_radius_driver"] / measured.record.attrs["teeth_driver"]
    assert (moved - deflection).real == pytest.approx(measured.mesh_frequency * base_pitch * 1e-3)


def test_means_count_as_one_line_for_every_speed(prompt: Simulator) -> None:
    (measured,) = prompt.target.measurements
    here = prepare(measured, prompt.layout.model, BAND)
    for speeds, lines in (((1.0, 1.0, 1.0), 1), ((1.0, 1.25, 1.0), 2), ((0.8, 1.25, 1.0, 1.03), 3)):
        conditions = [replace(here, pitch_speed=one * here.pitch_speed) for one in speeds]
        target = target_of([measured] * len(speeds), conditions)
        assert target.counts[means(target)] == pytest.approx(lines / len(speeds))


def test_without_displacements_the_mean_is_known_to_a_twentieth_of_itself() -> None:
    bare = demonstration(without=("y_driver", "y_driven"))
    line = bare.target.lines[np.flatnonzero(bare.target.of_line == np.flatnonzero(means(bare.target))[0])]
    assert np.sqrt(bare.target.floors[means(bare.target)]) == pytest.approx(0.05 * line.real)


def test_a_mean_is_no_part_of_a_gap(prompt: Simulator) -> None:
    (measured,) = prompt.target.measurements
    signals = prompt.channels(np.zeros(prompt.layout.size), measured)
    ripple = 1e-7 * np.cos(2 * pi * measured.phase)
    late = of_records(prompt, behind(measured, "driven", 1e-3)).target
    worse, apart = ({**signals, "dte": signals["dte"] + more} for more in (ripple, 1e-4))
    for target in (of_records(prompt, measured).target, late):
        assert np.allclose(*(target.shares(target.lines - target.gathered([one])) for one in (signals, apart)))
        assert feels(target, worse, signals) and not feels(target, apart, signals)
        for closing in (closing_of, free_closing):
            still = closing(target, signals, signals).growth
            assert closing(target, apart, signals).growth == pytest.approx(still)
            assert closing(target, worse, signals).growth > 2.0 * still
    still_rig = late.of_lines(~late.excited[late.of_line])
    assert not still_rig.excited_counts[means(still_rig)].any() and still_rig.excited_counts[~means(still_rig)].all()
    # It counts among what a record is likely by.
    assert closing_of(late, signals, {**signals, "dte": signals["dte"] + 4.43e-4}).gain > 3.0


@pytest.mark.parametrize(
    ("key", "size"),
    [("scale", 0.5e-6), ("shape", 0.03e-6), ("delay-angle_driver", 1.6e-6), ("delay-angle_driven", 1.6e-6),
     ("pitch-driven", 0.01e-6), ("flanks", 0.6e-6), (ENDS, 0.1e-6), ("delay-y_driver", 0.0)],
)  # fmt: skip
def test_a_derivative_of_the_mean_is_what_two_simulations_differ_by(prompt: Simulator, key: str, size: float) -> None:
    """In metres a standard deviation, of which it has that `size` at least."""
    unknowns, p = prompt.layout.unknowns, np.zeros(prompt.layout.size)
    at = unknowns[key].start
    sd = unknowns.prior()[at]
    found, expected = of_mean(prompt, jacobian_at(prompt, p)[at], p, at, 0.05 * sd)
    assert found * sd == pytest.approx(expected * sd, rel=0.01, abs=1e-12)
    assert abs(expected * sd) >= size


@pytest.mark.parametrize("zero_known", [True, False])
def test_a_fit_takes_the_lag_of_the_driven_angle_from_the_mean(zero_known: bool) -> None:
    """Lines hardly show that angle's lag: without a zero it stays where it is."""
    late = demonstration(lags={"angle_driven": LAG})
    (measured,) = late.target.measurements
    unknowns, sd = late.layout.unknowns, late.layout.unknowns.prior()
    driver, driven = unknowns["delay-angle_driver"].start, unknowns["delay-angle_driven"].start
    assert 2.0 < LAG / sd[driven] < 3.0
    told = of_records(late, replace(measured, zero_known=zero_known))
    best = fit_afresh(told, np.zeros(unknowns.size), sd, renewals=1)
    assert best is not None
    assert (best.p[driven] - best.p[driver] == pytest.approx(LAG, rel=0.2)) == zero_known


@pytest.mark.parametrize("records", [1, 3])
def test_a_zero_that_is_off_spoils_nothing(prompt: Simulator, records: int) -> None:
    """A few times what is unknown of a mean it is thought to be the lag of the driven angle that it looks like, in part
    and as an effect for no more than the means of all records count; far off for nothing. Nothing else moves."""
    unknowns, sd = prompt.layout.unknowns, prompt.layout.unknowns.prior()
    lag = unknowns["delay-angle_driven"].start
    wide = sd.copy()
    wide[lag] = unknowns.group("delay-angle_driven").wide[0]

    def fitted(off: float, prior: np.ndarray) -> Optimum:
        (measured,) = prompt.target.measurements
        moved = measured.periods["angle_driven"] - off / measured.record.attrs["base_radius_driven"]
        record = replace(measured, periods={**measured.periods, "angle_driven": moved})
        alike = [replace(record, name=f"{record.name}-{number}") for number in range(records)]
        best = fit_afresh(of_records(prompt, *alike), np.zeros(unknowns.size), prior, renewals=1)
        assert best is not None
        return best

    right = fitted(0.0, sd).p
    for off, part in ((2e-6, 0.5), (8e-6, 0.5), (2e-5, 0.3), (4e-4, 0.05)):
        away = np.abs(fitted(off, sd).p - right)
        assert away[lag] <= part * sd[lag]
        assert (np.delete(away, lag) <= 0.2 * np.delete(sd, lag)).all()
    late = fitted(8e-6, wide)
    assert late.evidence - fitted(8e-6, sd).evidence < 0.5 * LIMIT


def test_a_mean_of_displacements_without_a_zero_is_none(prompt: Simulator) -> None:
    """Sensors that see what moves alone: the transmission error's mean lacks the supports' then."""
    (measured,) = prompt.target.measurements
    moving = {name: one - one.mean() for name, one in measured.periods.items() if name.startswith("y_")}
    assert means(of_records(prompt, measured).target).any()
    bare = of_records(prompt, replace(measured, periods={**measured.periods, **moving})).target
    assert not means(bare).any() and bare.meant == ()

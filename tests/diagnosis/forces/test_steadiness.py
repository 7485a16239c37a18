"""Scatter between periods: white noise counts for nothing, and a rig that changes from one period to the next shows
it in the equation of what has changed. The two periods are simulated in time domain, each on a rig of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
import xarray as xr

from gearbench.bench import simulate
from gearbench.bench.nonlinear.replay import replay
from gearbench.cases import case_files
from gearbench.diagnosis.effects.library import all_unknowns
from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.forces.covariance import BLOCK
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.nominal import NominalModel, nominal_model
from gearbench.diagnosis.forces.steadiness import (
    Unsteady,
    excess_of,
    least_unsteadiness,
    quiet_level,
    unsteadiness,
)
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.intake.measurements import Measurement, measurement
from gearbench.rig import Case, Ripple, read_case

BAND = 3000.0
NOISE = {"angle": 1e-6, "y": 0.05e-6, "torque": 0.02}  # what the nominal rig states


@dataclass(frozen=True)
class Bench:
    nominal: Case
    record: xr.Dataset
    steady: Measurement
    model: NominalModel
    unknowns: Unknowns

    @property
    def p(self) -> np.ndarray:
        p = np.zeros(self.unknowns.size)
        p[self.unknowns["radial"]] = 30.0  # the lumped model has none
        return p

    def unsteadiness(self, later: Case | None = None, *, noise: float = 1.0, periods: int = 2) -> Unsteady:
        seen = self.seen(later, noise=noise, periods=periods)
        return unsteadiness(self.model, [seen], self.unknowns, self.p, BAND)

    def seen(self, later: Case | None = None, *, noise: float = 1.0, periods: int = 2) -> Measurement:
        """One period of the nominal rig and others of another one."""
        first = self.steady.periods
        second = first if later is None else measurement(replay(later, self.record), "x", self.nominal).periods
        turn = np.random.default_rng(6)
        seen = {}
        for channel, values in first.items():
            both = np.stack([values[0], *(second[channel][0] for _ in range(periods - 1))])
            seen[channel] = both + noise * NOISE[channel.split("_")[0]] * turn.standard_normal(both.shape)
        return replace(self.steady, periods=seen)

    def changed(self, part: str, field: str, **update: object) -> Case:
        rig = self.nominal.rig
        value = getattr(getattr(rig, part), field).model_copy(update=update) if field else None
        inner = getattr(rig, part).model_copy(update={field: value} if field else update)
        return self.nominal.model_copy(update={"rig": rig.model_copy(update={part: inner})})


@pytest.fixture(scope="module")
def bench() -> Bench:
    case = read_case(case_files()["gap_demo"], ["condition.0.multisine.amplitude_nm=20"])
    nominal = case.under(case.conditions[0])
    record = simulate(nominal)
    made = nominal_model(nominal, 220.0, 100.0)
    steady = measurement(replay(nominal, record), "base", nominal)
    where = all_unknowns(made, [prepare(steady, made, BAND)])
    return Bench(nominal, record, steady, made, where)


def test_white_noise_counts_for_nothing(bench: Bench) -> None:
    assert bench.unsteadiness().excess.max() < 10
    assert bench.unsteadiness(periods=12, noise=30.0).excess.max() < 10  # its size is read off the record


def test_noise_of_any_colour_counts_for_nothing(bench: Bench) -> None:
    """What an equation makes of noise need not be known: a hundred times more of it in the resonance of a shaft."""
    turn = np.random.default_rng(8)
    shape = (2, 4, 4000)
    colour = 1 + 30 / (1 + ((np.arange(4000) - 2000) / 100) ** 2)
    scatter = colour * (turn.standard_normal(shape) + 1j * turn.standard_normal(shape)) / 2
    scatter = (scatter - scatter.mean(axis=0)) * np.sqrt(2)
    quiet = np.arange(4000) % 5 > 0
    level = quiet_level(scatter, quiet)
    assert np.median(level / (0.5 * colour**2)) == pytest.approx(1.0, rel=0.15)
    blind = np.ones((5, 4000))
    assert excess_of(scatter, np.ones((4, 4000), complex), blind).excess.max() > 1000
    assert excess_of(scatter, np.ones((4, 4000), complex), np.maximum(blind, level.max(axis=0))).excess.max() < 50
    assert not quiet_level(scatter, np.arange(4000) < 10).any()


def test_one_period_says_nothing(bench: Bench) -> None:
    assert not bench.unsteadiness(periods=1).excess.any()


CHANGES: dict[str, Callable[[Bench], Case]] = {
    "driver-support": lambda b: b.changed("support", "driver", stiffness=1.1e8),
    "driven-support": lambda b: b.changed("support", "driven", stiffness=1.1e8),
    "drive": lambda b: b.changed("drive", "", ripple=Ripple(orders=(7, 33), amplitude=(4.0, 6.0), phase=(0.2, 0.4))),
    "mesh": lambda b: b.changed("mesh", "", stiffness_scale=1.1),
    "load": lambda b: b.changed("sensors", "", delay_torque_driven=20e-6),  # the speed is prescribed there
}


@pytest.mark.parametrize("place", CHANGES)
def test_a_rig_that_changes_shows_in_its_own_equation(bench: Bench, place: str) -> None:
    found = dict(zip(PLACES, bench.unsteadiness(CHANGES[place](bench)).excess, strict=True))
    own = found.pop(place)
    assert own > 100 and own > 10 * max(found.values())


def test_the_place_is_told_by_the_rig_in_which_less_changes(bench: Bench) -> None:
    """A mesh that is taken for three times as stiff as it is seems to change with all that shakes it."""
    seen = [bench.seen(CHANGES["drive"](bench))]
    stiff = bench.p
    stiff[bench.unknowns["scale"]] = np.log(3.0)
    astray = unsteadiness(bench.model, seen, bench.unknowns, stiff, BAND)
    assert PLACES[int(np.argmax(astray.excess))] == "mesh"
    for rigs in ([stiff, bench.p], [bench.p, stiff]):
        found = least_unsteadiness(bench.model, seen, bench.unknowns, rigs, BAND)
        assert PLACES[int(np.argmax(found.excess))] == "drive"


def test_the_place_is_that_of_most_force(bench: Bench) -> None:
    """A torque that changes shakes a support too, whose equation is wrong by what its stiffness is off, and whose
    displacement has little noise: more scatters there, beyond noise, but less force."""
    seen = bench.seen(CHANGES["drive"](bench))
    off = bench.p
    off[bench.unknowns["stiffness"].start] = 0.2
    found = unsteadiness(bench.model, [seen], bench.unknowns, off, BAND)
    drive, support = (PLACES.index(place) for place in ("drive", "driver-support"))
    limits = dict.fromkeys(PLACES, 100.0) | {"driver-support": 1.0}
    assert found.excess[support] > found.excess[drive] / 100.0 > 1.0
    assert found.worst(limits)[0] == "drive"
    assert found._replace(acts="mesh").worst(limits) == ("mesh", np.inf)
    # Of two repetitions one has it: half its amplitudes, as rms over the base radius.
    assert found.force[drive] == pytest.approx(np.hypot(4.0, 6.0) / 2.0 / bench.model.base_radius[0], rel=0.1)


def test_excess_is_told_for_so_many_lines(bench: Bench) -> None:
    """Twice the records have twice the lines, and no more of anything."""
    seen = bench.seen(CHANGES["mesh"](bench))
    once, twice = (unsteadiness(bench.model, [seen] * n, bench.unknowns, bench.p, BAND) for n in (1, 2))
    assert once.excess.max() > 100 and twice.excess == pytest.approx(once.excess)


def test_an_error_of_the_mesh_force_is_no_equations_own() -> None:
    """What all equations have in common, each with its complex part of it, is the mesh's; what one adds is
    that equation's."""
    turn = np.random.default_rng(5)

    def noise(*shape: int) -> np.ndarray:
        return (turn.standard_normal(shape) + 1j * turn.standard_normal(shape)) / np.sqrt(2)

    bins = 50 * BLOCK
    share = np.exp(2j * np.pi * turn.uniform(size=(4, bins)))
    scatter = noise(2, 4, bins) - share * 20 * noise(2, 1, bins)
    count = excess_of(scatter, share, np.ones((5, bins))).excess
    # Bins of two periods times the logarithm of 20^2 + 1, within the scatter of 16 degrees of freedom.
    assert count[-1] == pytest.approx(2 * bins * np.log(401), rel=0.05)
    assert count[:-1].max() < 0.02 * count[-1]
    scatter[:, 2] += 10 * noise(2, bins)
    both = excess_of(scatter, share, np.ones((5, bins))).excess
    assert both[2] == pytest.approx(2 * bins * np.log(101), rel=0.05)
    assert both[[0, 1, 3]].max() < 0.02 * both[2]


def test_equations_without_a_channel_are_left_out() -> None:
    turn = np.random.default_rng(5)
    scatter = 10 * (turn.standard_normal((2, 4, 80)) + 1j * turn.standard_normal((2, 4, 80)))
    scatter[:, 1] = np.nan
    found = excess_of(scatter, np.ones((4, 80), complex), np.ones((5, 80))).excess
    assert found[1] == 0.0 and found[[0, 2, 3]].min() > 100

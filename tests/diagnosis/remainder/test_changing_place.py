"""The place of what changes between repetitions, against matrices of the rig written down here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import xarray as xr
from shared.truth_plants import CASES

from gearbench.bench import simulate
from gearbench.diagnosis.evidence.calibration import LIMITS
from gearbench.diagnosis.evidence.problem import problem_of
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.steadiness import Unsteady
from gearbench.diagnosis.intake.measurements import measurement
from gearbench.diagnosis.remainder import changing_place as module
from gearbench.diagnosis.remainder.changing_place import place_of_changes, placed, unit_answers
from gearbench.diagnosis.replay.replays import Replays
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import target_of
from gearbench.diagnosis.structure.layout import layout_of
from gearbench.lumped.nonlinear.constants import Constants
from gearbench.lumped.nonlinear.model import nonlinear_model
from gearbench.rig import Case, read_case
from gearbench.rig.contract import Place

STIFFNESS = 4.2e8
# A mesh whose stiffness hardly changes.
EVEN = (
    "experiment.mesh_frequency_hz=512", "experiment.samples_per_period=1200", "experiment.periods=4",
    "simulation.mesh_stiffness=rectangular", f"simulation.stiffness_single_n_per_m={0.998 * STIFFNESS}",
    f"simulation.stiffness_double_n_per_m={1.002 * STIFFNESS}", "rig.sensors.noise_angle_urad=0.1",
    "rig.sensors.noise_displacement_um=0.005", "rig.sensors.noise_torque_nm=0.005",
)  # fmt: skip
BAND = (200.0, 4000.0)  # [Hz]
Lines = dict[str, np.ndarray]


@dataclass(frozen=True)
class Bench:
    nominal: Case
    record: xr.Dataset
    constants: Constants
    radii: tuple[float, float]

    @property
    def samples(self) -> int:
        """Those of one repetition."""
        return int(self.record.attrs["samples_per_period"])

    @property
    def frequency(self) -> np.ndarray:
        """That [Hz] of the lines of one repetition."""
        return np.fft.rfftfreq(self.samples, 1 / float(self.record.attrs["sampling_rate"]))

    def moved(self, place: Place) -> Lines:
        """What channels (K,) change by under a unit force at a place of a rig whose mesh has a constant stiffness and
        whose driven gear is held."""
        c, g = self.constants, self.constants.factor
        omega, mesh = 2 * np.pi * self.frequency, np.array([1.0, g, -g])
        masses = 1.0 / np.array([c.inverse_u1, c.inverse_y1, c.inverse_y2])
        support = [np.zeros(omega.size), *(k + 1j * omega * d for k, d in
                   ((c.stiffness1, c.damping1), (c.stiffness2, c.damping2)))]  # fmt: skip
        tooth = STIFFNESS + 1j * omega * c.damping_factor * STIFFNESS**0.5
        dynamic = tooth[:, None, None] * np.outer(mesh, mesh)
        for number in range(3):
            dynamic[:, number, number] += support[number] - omega**2 * masses[number]
        force = {"drive": [1, 0, 0], "driver-support": [0, 1, 0], "driven-support": [0, 0, 1], "mesh": -mesh}
        pushed = np.broadcast_to(np.array(force.get(place, np.zeros(3)), dtype=complex), (omega.size, 3))
        u, one, two = np.linalg.solve(dynamic, pushed[..., None])[..., 0].T
        borne = tooth * (u + g * (one - two)) + (place == "mesh")
        return {"angle_driver": u, "y_driver": one, "y_driven": two, "dte": u + g * (one - two),
                "torque_driven": self.radii[1] * (borne + (place == "load"))}  # fmt: skip

    def found(self, changed: xr.Dataset | None = None) -> Any:
        """The rig itself as found in a record, and what was measured."""
        measured = measurement(self.record if changed is None else changed, "one", self.nominal)
        problem = problem_of([measured], self.nominal)
        layout = layout_of(self.nominal, problem.model, problem.conditions, ())
        simulator = Simulator(layout, target_of([measured], problem.conditions), Replays(problem.model.sound))
        best = SimpleNamespace(p=np.zeros(layout.size))
        selection = SimpleNamespace(best=best)
        return SimpleNamespace(simulator=simulator, selection=selection, end_of=lambda optimum: optimum.p), measured

    def changing(self, places: Sequence[Place], size: float = 3.0, without: Sequence[str] = ()) -> xr.Dataset:
        """The record with forces [N] at places, others in every repetition, without some channels."""
        rng, out = np.random.default_rng(3), self.record.copy(deep=True)
        inside = (self.frequency > BAND[0]) & (self.frequency < BAND[1]) & (np.arange(self.frequency.size) % 7 == 0)
        repetitions = out["y_driver"].shape[1] // self.samples
        for place in places:
            lines = self.moved(place)
            shape = repetitions, inside.size
            force = size * inside * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / inside.sum() ** 0.5
            for name, unit in ((name, 1 / self.radii[0] if name == "angle_driver" else 1.0) for name in out.data_vars):
                if name in lines:
                    part = np.fft.irfft(force * lines[str(name)] * unit, self.samples) * self.samples / 2
                    out[name] = out[name] + part.reshape(1, -1)
        return out.drop_vars(without)


@pytest.fixture(scope="module")
def bench() -> Bench:
    nominal = read_case(CASES / "gap_demo.toml", EVEN).model_copy(update={"conditions": ()})
    record = simulate(nominal)
    problem = problem_of([measurement(record, "one", nominal)], nominal)
    layout = layout_of(nominal, problem.model, problem.conditions, ())
    model = nonlinear_model(nominal.rig, layout.meshing, problem.model.law)
    one, two = layout.model.base_radius
    return Bench(nominal, record, model.constants(), (float(one), float(two)))


@pytest.mark.parametrize("place", PLACES)
def test_a_unit_force_moves_what_the_matrices_say(bench: Bench, place: Place) -> None:
    found, measured = bench.found()
    last = int(np.flatnonzero(bench.frequency < BAND[1])[-1])
    inside = bench.frequency[: last + 1] > BAND[0]
    answers = unit_answers(found.simulator, found.selection.best.p, measured, last)
    got = {name: lines[PLACES.index(place), inside] for name, lines in answers.items()}
    wanted = {name: lines[: last + 1][inside] for name, lines in bench.moved(place).items()}
    for name, lines in wanted.items():
        assert np.linalg.norm(got[name] - lines) <= 0.02 * np.linalg.norm(lines)


@pytest.mark.parametrize("place", PLACES)
def test_the_place_of_what_changes_is_found(bench: Bench, place: Place) -> None:
    """A force on a driven gear that is held moves nothing but the torque: it may be the sensor's as well."""
    found, measured = bench.found(bench.changing([place]))
    assert place_of_changes(found, [measured]) == (place if place != "load" else None)


@pytest.mark.parametrize(
    ("channel", "size"), [("y_driver", 1e-7), ("y_driven", 1e-7), ("torque_driven", 0.1), ("angle_driver", 3e-6)]
)
def test_what_one_sensor_alone_shows_acts_at_no_place(bench: Bench, channel: str, size: float) -> None:
    changed, samples = bench.record.copy(deep=True).drop_vars("dte", errors="ignore"), bench.record["time"].size
    grown = 1.0 + 0.2 * (np.arange(samples) // bench.samples)
    tone = np.cos(2 * np.pi * 83 * np.arange(samples) / bench.samples)
    changed[channel] = changed[channel] + size * grown * tone
    found, measured = bench.found(changed)
    assert place_of_changes(found, [measured]) is None


def test_what_answers_the_torque_that_is_measured_acts_at_no_place(bench: Bench) -> None:
    changed = bench.changing(["drive"])
    quiet = bench.changing([])
    inside = (bench.frequency > BAND[0]) & (bench.frequency < BAND[1]) & (np.arange(bench.frequency.size) % 7 == 0)
    torque = changed["torque_driver"].values.reshape(-1, bench.samples)
    part = np.fft.irfft(inside * np.arange(1.0, len(torque) + 1.0)[:, None], bench.samples) * bench.samples
    changed["torque_driver"] = quiet["torque_driver"] + 1e-3 * part.reshape(1, -1)
    found, measured = bench.found(changed)
    assert place_of_changes(found, [measured]) is None


def test_a_channel_that_was_not_measured_anew_is_left_out(bench: Bench) -> None:
    changed = bench.changing(["driver-support"])
    once = changed["torque_driven"].values[:, : bench.samples]
    changed["torque_driven"] = changed["torque_driven"] * 0.0 + np.tile(once, 4)
    found, measured = bench.found(changed)
    assert place_of_changes(found, [measured]) == "driver-support"


def test_nothing_is_told_of_noise_of_two_places_or_of_one_channel(bench: Bench) -> None:
    angles = ("y_driver", "y_driven", "torque_driven")
    changed = (
        bench.changing([]),
        bench.changing(["driver-support", "driven-support"]),
        bench.changing(["drive"], without=angles),
    )
    assert [place_of_changes(one, [measured]) for one, measured in map(bench.found, changed)] == [None] * 3


def test_records_that_need_not_repeat_are_not_asked(bench: Bench) -> None:
    found, _ = bench.found(bench.changing(["drive"]))
    assert place_of_changes(found, []) is None


@pytest.mark.parametrize(
    ("seen", "much", "anchored", "asked"),
    [(1.1, False, False, True), (0.9, False, True, False), (0.9, True, True, True), (0.9, True, False, False)],
)
def test_the_rig_is_asked_where_forces_see_something_or_much_changes_and_flanks_stay_together(
    monkeypatch: pytest.MonkeyPatch, seen: float, much: bool, anchored: bool, asked: bool
) -> None:
    monkeypatch.setattr(module, "place_of_changes", lambda found, steady: "drive")
    force = seen * np.array([LIMITS.unsteady[place] for place in PLACES])
    found: Any = SimpleNamespace(simulator=SimpleNamespace(anchored=anchored))
    made = placed(Unsteady(force, force), LIMITS, found, [], much=much)
    assert made.acts == ("drive" if asked else None)


def test_a_rig_without_steady_motion_tells_no_place(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(found: Any, steady: Any) -> Place:
        raise ValueError("does not settle")

    monkeypatch.setattr(module, "place_of_changes", failing)
    force = np.full(len(PLACES), 1e5)
    before, found = Unsteady(force, force), object()
    assert placed(before, LIMITS, cast("Any", found), [], much=True) is before

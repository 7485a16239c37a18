"""The list of models, and what a new one costs: here a mesh that is a spring."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench import BenchError, simulate
from gearbench.bench.models import MODELS, model_for
from gearbench.bench.plan.excitation import Torque
from gearbench.bench.plan.schedule import ProgressReport, Schedule
from gearbench.bench.plan.settling import Keep
from gearbench.bench.protocol import Channels, Drive, Model, Note
from gearbench.bench.record.channels import force_of
from gearbench.bench.record.sensors import filter_delay, filter_response
from gearbench.bench.record.static import Loads, static_dataset
from gearbench.bench.statics import static
from gearbench.cases import case_path
from gearbench.geometry import Pair, pair
from gearbench.rig import Case, Sensors, Simulation, read_case

Array = NDArray[np.float64]
STIFFNESS = 1e8


@dataclass(frozen=True)
class PreparedSpring:
    """Outputs (samples, 2): DTE [m] and the rotation of the driver [rad]; the angle runs on from block to block."""

    meshing: Pair
    plan: Schedule

    keep: Keep = "every"
    piece: int = 100
    absolute: bool = True
    substeps: int = 1
    decay: float | None = None
    slowest: float | None = None
    warnings: tuple[str, ...] = ("only a spring",)

    @property
    def settings(self) -> Mapping[str, Any]:
        return {"model": "spring"}

    @property
    def attributes(self) -> Mapping[str, Any]:
        return {}

    def drive(self, torque: Torque) -> Drive:
        period = torque.sample(self.plan.samples_per_period)
        return Drive(period, period)

    def start(self, sample: int) -> int:
        return sample

    def advance(self, drive: Drive, state: int, samples: int) -> tuple[int, Array]:
        number = np.arange(state, state + samples)
        dte = force_of(np.take(drive.fine, number, mode="wrap"), self.meshing) / STIFFNESS
        turned = number / self.plan.sampling_rate * self.plan.speed_driver
        return state + samples, np.stack([dte, turned], axis=1)

    def dte(self, outputs: Array) -> Array:
        return outputs[:, 0]

    def channels(self, outputs: Array, torque: Array) -> Channels:
        dte, turned = outputs.T
        r1, r2 = self.meshing.driver.base_radius, self.meshing.driven.base_radius
        still = np.zeros_like(dte)
        return Channels(
            torque * r2 / r1, turned + dte / r1, turned * r1 / r2, still, still, dte, force_of(torque, self.meshing)
        )

    def apart(self, outputs: Array) -> NDArray[np.bool_]:
        return outputs[:, 0] < 0

    def strayed(self, outputs: Array) -> None:
        """A spring knows no flanks."""

    def divided(self, outputs: Array) -> None:
        """All steps are alike."""


class Spring(Model):
    """A mesh without mass."""

    name = "spring"
    title = "spring"
    elastic = False

    def refuse(self, case: Case) -> None:
        if case.rig.friction.coefficient:
            raise BenchError("the spring does not represent rig.friction.coefficient")

    def prepare(self, case: Case, plan: Schedule, note: Note) -> PreparedSpring:
        note("winding the spring")
        return PreparedSpring(pair(case.rig), plan)

    def static(self, case: Case, loads: Loads, phase: Array, report: ProgressReport) -> xr.Dataset:
        radius = pair(case.rig).driver.base_radius
        force = np.broadcast_to(loads[1][:, None] / radius, (len(loads[1]), len(phase)))
        k = np.full(force.shape, STIFFNESS)
        about = {"model": self.name}
        return static_dataset(
            loads, phase, transmission_error=force / k, torque=force * radius, secant=k, tangent=k, attributes=about
        )


@pytest.fixture
def case(monkeypatch: pytest.MonkeyPatch) -> Case:
    # All that a new model takes beside its own file.
    monkeypatch.setattr("gearbench.bench.models.MODELS", {**MODELS, "spring": lambda case: Spring()})
    return read_case(case_path("quick_lumped"), ["experiment.realisations=2", "rig.driven.runout_um=5"])


def test_the_case_file_knows_the_names_of_all_models() -> None:
    assert set(get_args(Simulation.model_fields["model"].annotation)) == set(MODELS)


def test_a_case_runs_on_the_model_of_its_name(case: Case) -> None:
    for name in (*MODELS, "spring"):
        chosen, model = model_for(case, name)
        assert (chosen.simulation.model, model.name) == (name, name)
    with pytest.raises(BenchError, match=r"simulation\.model = 'magic' is not one of lumped, reduced, full, spring"):
        model_for(case, "magic")


def test_a_new_model_gets_its_experiment_for_nothing(case: Case) -> None:
    said: list[str] = []
    record = simulate(case, "spring", lambda fraction, note: said.append(note))
    np.testing.assert_allclose(record["dte"].values * STIFFNESS, record["force"].values)
    assert record.sizes["time"] == case.experiment.periods * case.experiment.samples_per_period
    assert not np.array_equal(record["dte"].values[0], record["dte"].values[1])
    assert said[0] == "winding the spring" and "realisation 2 of 2" in said
    # 62 mesh cycles take longer than this record of 20: its periods are unlike, and it begins at mesh phase 0.
    assert record.attrs["repeats_after_mesh_cycles"] == 62
    assert "longer than the record" in record.attrs["warnings"] and "only a spring" in record.attrs["warnings"]
    assert record["mesh_phase"].values[0, 0] == 0.0 and record.attrs["contact_lost_samples"] == 0


def test_a_model_of_absolute_angles_gets_its_sensors_for_nothing(case: Case) -> None:
    # The spring follows its torque at once, so that every channel is known as a sum of lines.
    sound = case.rig.driven.model_copy(update={"runout": 0.0})
    sensors = Sensors(delay_angle_driver=70e-6, filter=3000.0, gain_torque_driver=1.1)
    plain, seen = (
        simulate(case.model_copy(update={"rig": case.rig.model_copy(update=fields)}), "spring")
        for fields in ({"driven": sound}, {"driven": sound, "sensors": sensors})
    )
    time = plain["time"].values
    speed = 2 * np.pi * case.experiment.mesh_frequency_for(62) / 62
    response = filter_response(np.fft.rfftfreq(time.size, time[1] - time[0]), 3000.0)
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(time.size, time[1] - time[0]) * 70e-6)

    def through(name: str, ramp: float, delay: NDArray[np.complex128] | float) -> Array:
        swing = plain[name].values - ramp * time
        return np.asarray(np.fft.irfft(np.fft.rfft(swing) * response * delay, n=time.size) + ramp * time)

    late = filter_delay(3000.0)
    driver = through("angle_driver", speed, turn) - speed * (late + 70e-6)
    np.testing.assert_allclose(seen["angle_driver"].values, driver, atol=1e-9)
    np.testing.assert_allclose(seen["torque_driver"].values, 1.1 * through("torque_driver", 0.0, 1.0), atol=1e-4)
    # The encoder's error returns after a turn, longer than this record: neither delay nor filter would be known.
    turning = sensors.model_copy(update={"encoder_runout_driven": 30e-6})
    with pytest.raises(BenchError, match="needs a record that repeats"):
        longer = case.rig.model_copy(update={"driven": sound, "sensors": turning})
        simulate(case.model_copy(update={"rig": longer}), "spring")
    alone = case.rig.model_copy(update={"driven": sound, "sensors": Sensors(encoder_runout_driven=30e-6)})
    turned = simulate(case.model_copy(update={"rig": alone}), "spring")
    error = turned["angle_driven"].values - plain["angle_driven"].values
    np.testing.assert_allclose(error, np.broadcast_to(30e-6 * np.cos(speed * turned["time"].values), error.shape))


def test_realisations_that_settle_at_different_times_are_brought_to_one_start(
    case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    even = case.model_copy(update={"rig": read_case(case_path("quick_lumped")).rig})
    plain = simulate(even, "spring")
    changes = iter([1.0])  # one realisation takes a block longer
    monkeypatch.setattr("gearbench.bench.plan.settling.change", lambda before, after: next(changes, 0.0))
    late = simulate(even, "spring")
    block = plain.attrs["samples_per_period"]
    assert late["time"].values[0] - plain["time"].values[0] == pytest.approx(block / plain.attrs["sampling_rate"])
    for name in ("angle_driver", "mesh_phase"):
        ahead = late[name].values - plain[name].values
        np.testing.assert_allclose(ahead, ahead[0, 0], rtol=1e-9)
        assert ahead[0, 0] > 0
    np.testing.assert_allclose(late["dte"].values, plain["dte"].values)


def test_static_and_refusals_go_the_same_way(case: Case) -> None:
    found = static(case, "spring", torque=[100.0], positions=4)
    assert found["stiffness_secant"].values == pytest.approx(STIFFNESS)
    with pytest.raises(BenchError, match="cycles = 2 must be 1 for the model spring"):
        static(case, "spring", positions=4, cycles=2)
    friction = case.rig.friction.model_copy(update={"coefficient": 0.1})
    rubbing = case.model_copy(update={"rig": case.rig.model_copy(update={"friction": friction})})
    with pytest.raises(BenchError, match="the spring does not represent"):
        simulate(rubbing, "spring")

"""Intake: how records are cut, what is refused in which words, what is said to cost power."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from shared.measured import MESH, RATE, SAMPLES, attributes, channels, nominal, record, written

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.intake.measurements import Measurement, held_out_of, intake, measurement
from gearbench.diagnosis.intake.quality import drift_of
from gearbench.records import RecordError, make_record, read_record

Channels = dict[str, np.ndarray]


def taken(values: Channels | None = None, **changes: object) -> Measurement:
    return measurement(record(values, **changes), "base", nominal())


def refusal(values: Channels | None = None, **changes: object) -> str:
    with pytest.raises((DiagnosisError, RecordError)) as caught:
        taken(values, **changes)
    sentence = str(caught.value)
    assert sentence.startswith("base") and "\n" not in sentence
    return sentence


# ---- how a record is cut


def test_a_clean_record_is_cut_into_hunting_periods_without_a_word() -> None:
    made = taken(channels(noise=0.0))
    assert (made.repetitions, made.mesh_cycles, made.mesh_frequency, made.condition) == (2, 60, MESH, "base")
    assert made.warnings == () and made.drift == 0.0 and made.phase_known and made.zero_known
    assert {rows.shape for rows in made.periods.values()} == {(2, SAMPLES)}
    # Rows repeat: the second one's angles have turned on by whole gears and are the same departures.
    for name, rows in made.periods.items():
        assert np.abs(rows[1] - rows[0]).max() <= 1e-9 * max(1.0, np.abs(rows).max()), name
    assert np.allclose(made.phase, np.arange(SAMPLES) * MESH / RATE, atol=1e-9)
    # Driver at 100 N m on three springs of 1e8 N/m (mesh, both supports with the cosine of 20 degrees twice).
    radius = 0.03 * np.cos(np.radians(20))
    expected = 100 / radius / 1e8 * (1 + 2 * np.cos(np.radians(20)) ** 2) / radius
    assert made.mean("angle_driver").mean() == pytest.approx(expected, rel=1e-6)


def test_noise_is_that_of_one_sample() -> None:
    noise = taken().noise
    for name, rms in (("torque_driver", 0.02), ("angle_driver", 1e-6), ("y_driven", 5e-8)):
        assert noise[name] == pytest.approx(rms, rel=0.05)  # 12288 differences: 0.6 %


@pytest.mark.parametrize("start", [0.0, 7.25, -3.5])
def test_phase_comes_from_the_channel_or_from_the_angles(start: float) -> None:
    values = channels(phase=start)
    assert taken(values).phase[0] == pytest.approx(start, abs=1e-9)
    without = {name: value for name, value in values.items() if name != "mesh_phase"}
    made = taken(without)
    # Half of the driver's mean departure, 3.5 mrad of 20 teeth, is all that the fit can be off by.
    assert made.phase[0] == pytest.approx(start, abs=0.01) and made.phase_known
    made = taken(without, mesh_phase_origin=None)
    assert not made.phase_known and any("origin of the mesh phase is arbitrary" in one for one in made.warnings)


def test_an_excitation_of_half_a_hunting_period_gives_rows_of_two() -> None:
    made = taken(channels(samples=SAMPLES // 2, periods=4), samples_per_period=SAMPLES // 2, periods=4)
    assert (made.repetitions, made.mesh_cycles, made.phase.size) == (2, 60, SAMPLES)
    odd = channels(samples=SAMPLES // 2, periods=3)
    made = taken(odd, samples_per_period=SAMPLES // 2, periods=3)
    assert made.record.sizes["time"] == made.record.attrs["samples_per_period"] == SAMPLES
    assert made.repetitions == 1 and made.zero_known and any("are left out" in one for one in made.warnings)


def test_an_excitation_of_two_hunting_periods_gives_one_row_of_both() -> None:
    made = taken(samples_per_period=2 * SAMPLES, periods=1)
    assert (made.repetitions, made.mesh_cycles) == (1, 120)
    assert any("2 hunting periods" in one for one in made.warnings)


def test_without_a_declared_mesh_period_the_angles_tell_it() -> None:
    made = taken(mesh_period=None)
    assert made.mesh_frequency == pytest.approx(MESH, rel=1e-12) and made.repetitions == 2
    assert made.record.attrs["mesh_period"] == pytest.approx(1 / MESH, rel=1e-12)


def test_what_the_record_does_not_say_of_its_rig_the_case_says() -> None:
    said = taken(teeth_driver=None, working_pressure_angle=None, support_direction=None).record.attrs
    assert (said["teeth_driver"], said["support_direction"]) == (20, "tangential")
    assert np.degrees(said["working_pressure_angle"]) == pytest.approx(20.0, abs=1e-9)


def test_condition_by_name_attribute_or_nearness() -> None:
    light = channels(torque=40.0)
    assert measurement(record(light), "set3-light", nominal()).condition == "light"
    assert measurement(record(light, condition="light"), "base", nominal()).condition == "light"
    assert measurement(record(light), "first", nominal()).condition == "light"


# ---- what is refused


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"teeth_driver": 21}, ("teeth_driver = 21", "rig.driver.teeth = 20", "another rig")),
        ({"base_radius_driven": 0.0425}, ("base_radius_driven = 42.5 mm", "0.1%")),
        ({"working_pressure_angle": 0.36}, ("working_pressure_angle = 20.63 deg", "0.5 deg")),
        ({"support_direction": "line-of-action"}, ("support_direction", "line-of-action")),
        ({"driven_boundary": "torque"}, ("driven_boundary", "rig.load.boundary")),
        ({"torque_mean": 120.0}, ("torque_driver is 100 N m", "torque_mean = 120", "2%")),
        ({"mesh_period": 0.021}, ("50 Hz", "mesh_period", "47.619 Hz")),
    ],
)
def test_what_a_record_says_against_the_case_is_refused(changes: dict, words: tuple[str, ...]) -> None:
    sentence = refusal(**changes)
    assert all(word in sentence for word in words), sentence


def scaled(name: str, factor: float) -> Channels:
    return {key: factor * value if key.startswith(name) else value for key, value in channels().items()}


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (lambda: scaled("angle_", 180 / np.pi), ("mesh frequency of 2864.8 Hz", "in degrees?")),
        (lambda: scaled("angle_driven", 180 / np.pi), ("ratio", "angle_driven in degrees?")),
        (lambda: scaled("angle_", -1.0), ("does not rise", "must be positive")),
        (lambda: scaled("y_driver", 1e3), ("y_driver swings by", "in mm or um", "the module")),
        (lambda: scaled("y_driven", -1.0), ("y_driven", "wrong way round")),
        (lambda: scaled("torque_", 1e3), ("mean torque 1e+05 N m", "in N mm?")),
        (lambda: scaled("torque_driver", -1.0), ("mean of torque_driver is -100", "must be positive")),
        (lambda: scaled("torque_driven", -1.0), ("torque_driven", "against the driven rotation")),
        (lambda: channels(torque=60.0), ('mean torque 60 N m, where the case\'s condition "base" has 100', "30%")),
        (lambda: channels(mesh=55.0), ('mesh frequency 55 Hz, where the case\'s condition "base" has 50', "5%")),
    ],
)
def test_wrong_units_signs_and_conditions_are_refused_with_a_hint(
    values: Callable[[], Channels], words: tuple[str, ...]
) -> None:
    sentence = refusal(values(), mesh_period=None)
    assert all(word in sentence for word in words), sentence


def test_teeth_that_only_the_angles_betray_are_refused() -> None:
    values = channels()
    values["angle_driven"] = values["angle_driven"] * 30 / 31
    sentence = refusal(values, teeth_driven=None)
    assert "1.55" in sentence and "20/30" in sentence and "1.5" in sentence


def test_wrapped_angles_and_unsteady_speed_are_refused() -> None:
    values = channels()
    wrapped = {**values, "angle_driver": np.mod(values["angle_driver"], 2 * np.pi)}
    assert "unwrapped" in refusal(wrapped)
    time = np.arange(2 * SAMPLES) / RATE
    swing = 0.4 * np.sin(2 * np.pi * time / 1.2)
    unsteady = {
        **values,
        "angle_driver": values["angle_driver"] + swing * 2 * np.pi / 20,
        "angle_driven": values["angle_driven"] + swing * 2 * np.pi / 30,
    }
    assert "steady" in refusal(unsteady) and "0.25" in refusal(unsteady)


def test_records_that_are_too_short_or_hold_no_whole_hunting_period_are_refused() -> None:
    short = {name: value[: SAMPLES // 2] for name, value in channels().items()}
    sentence = refusal(short, samples_per_period=SAMPLES // 2, periods=1)
    assert "30 mesh periods" in sentence and "lcm(20, 30) = 60" in sentence and "1.2 s" in sentence
    # 1.3 s an excitation period: 65 teeth, and 130 after two.
    long = channels(samples=13312)
    sentence = refusal(long, samples_per_period=13312)
    assert "130 mesh periods" in sentence and "60" in sentence


def test_missing_angles_and_torque_are_refused() -> None:
    values = channels()
    reduced = {"dte": 1e-6 * values["y_driver"], "force": values["torque_driver"]}
    assert "angle_driver" in refusal(reduced)


def test_clipped_channels_are_refused_and_quantised_ones_are_not() -> None:
    values = channels()
    top = np.quantile(values["y_driven"], 0.97)
    assert "y_driven is clipped at 3" in refusal({**values, "y_driven": np.minimum(values["y_driven"], top)})
    step = np.ptp(values["y_driven"]) / 50
    assert taken({**values, "y_driven": np.round(values["y_driven"] / step) * step}).repetitions == 2


def test_values_that_are_not_numbers_are_named(tmp_path: Path) -> None:
    path = written(tmp_path, "base")
    broken = read_record(path)
    broken["y_driver"].values[0, 77] = np.nan
    path.unlink()
    broken.to_netcdf(path, engine="h5netcdf", encoding={str(n): {"_FillValue": None} for n in broken.variables})
    with pytest.raises(RecordError) as caught:
        intake([path], nominal())
    assert all(word in str(caught.value) for word in ("base.nc", "y_driver", "not finite", "sample 77"))


def test_the_same_record_twice_and_records_of_different_rigs_are_refused(tmp_path: Path) -> None:
    one = written(tmp_path, "base")
    with pytest.raises(DiagnosisError, match="given twice"):
        intake([one, tmp_path / "." / "base.nc"], nominal())
    copy = written(tmp_path, "other", channels())
    with pytest.raises(DiagnosisError, match="the same samples"):
        intake([one, copy], nominal())
    heavier = written(tmp_path, "light", channels(torque=40.0), inertia_driver=2.5e-3)
    with pytest.raises(DiagnosisError, match=r"different rigs: inertia_driver = 0\.0023 and 0\.0025 kg m\^2"):
        intake([one, heavier], nominal())
    with pytest.raises(DiagnosisError, match="at least one"):
        intake([], nominal())


# ---- what is said to cost power


def test_missing_dead_and_silent_channels_are_said() -> None:
    values = channels()
    kept = {name: value for name, value in values.items() if name not in ("y_driver", "torque_driven")}
    made = taken(kept)
    assert set(made.periods) == {"torque_driver", "angle_driver", "angle_driven", "y_driven"}
    assert [one.split(":")[0] for one in made.warnings] == ["there is no y_driver", "there is no torque_driven"]
    made = taken({**values, "y_driven": np.full(2 * SAMPLES, 3e-5)})
    assert "y_driven" not in made.periods and "dead sensor" in made.warnings[0]
    for rounding in (0.0, 1e-13):
        logged = 150.0 + rounding * np.arange(2 * SAMPLES) / SAMPLES
        made = taken({**values, "torque_driven": logged})
        assert "torque_driven" not in made.periods and "there is no torque_driven" in " ".join(made.warnings)
    made = taken(scaled("y_driven", 1e-3))
    assert any("y_driven stays within" in one for one in made.warnings)


def test_one_period_and_averaged_periods_are_said() -> None:
    single = {name: value[:SAMPLES] for name, value in channels().items()}
    made = taken(single, periods=1)
    assert made.repetitions == 1 and made.noise == {} and "one hunting period only" in made.warnings[0]
    assert "stay hidden" in made.warnings[0]
    made = taken(single, periods=1, periods_averaged=4)
    assert "mean over 4 blocks" in made.warnings[0]


def test_a_condition_that_the_case_does_not_have_is_said_and_a_far_one_refused() -> None:
    made = measurement(record(channels(torque=150.0)), "extra", nominal())
    assert made.condition == "base" and "150 N m" in made.warnings[0]
    made = measurement(record(channels(torque=120.0)), "extra", nominal())
    assert made.condition == "base" and "120 N m" in made.warnings[0]
    assert not measurement(record(channels(torque=104.0)), "extra", nominal()).warnings
    with pytest.raises(DiagnosisError, match=r"400 N m.*a factor 3"):
        measurement(record(channels(torque=400.0)), "extra", nominal())


def test_drift_of_the_level_is_measured_and_white_noise_is_not() -> None:
    values = channels()
    ramp = np.linspace(0.0, 1.0, 2 * SAMPLES)
    size = values["y_driven"].std()
    made = taken({**values, "y_driven": values["y_driven"] + 0.2 * size * ramp})
    # A ramp over both rows moves their means apart by half its height.
    assert made.drift == pytest.approx(0.1, rel=0.02)
    assert made.warnings[0].startswith("y_driven drifts")
    assert all(taken(channels(seed=seed, noise=20.0)).drift == 0.0 for seed in range(5))


def test_growing_scatter_is_said() -> None:
    values = channels(noise=0.0)
    rng = np.random.default_rng(3)
    time = np.linspace(0.0, 1.0, 2 * SAMPLES)
    made = taken({**values, "y_driver": values["y_driver"] + 2e-7 * (0.2 + time) * rng.normal(size=time.size)})
    assert any("scatter of y_driver" in one for one in made.warnings)
    notes: list[str] = []
    drift_of({"y_driver": rng.normal(size=(3, 4000)), "torque_driver": rng.normal(size=(3, 4000))}, (1.0, 1.5), notes)
    assert notes == []


def test_a_speed_that_wanders_is_no_noise_of_the_angles() -> None:
    rng = np.random.default_rng(4)
    time = np.linspace(0.0, 1.0, 4000)
    tones = np.array([(0.1, 2.3, 0.2), (1.4, 0.4, 3.0), (0.3, 2.2, 0.1)]) @ np.cos(np.outer((2, 3, 5), 6.0 * time))
    wander = 1e-6 * tones * (0.2 + time)
    radii = (0.03, 0.06)
    rms = 5e-8
    angles = [(wander + rms * rng.normal(size=wander.shape)) / radius for radius in radii]
    notes: list[str] = []
    drift_of({"angle_driver": angles[0], "angle_driven": angles[1]}, radii, notes)
    (sentence,) = (one for one in notes if "drifts" not in one)
    assert sentence.startswith("the speed wanders")
    told = float(sentence.split("up to ")[1].split(" um")[0])
    assert told == pytest.approx(1e6 * np.abs(np.diff(wander, axis=0)).max(), rel=0.05)
    # Noise of one angle that grows is still told, beside the same wander.
    notes.clear()
    louder = angles[0] + 20 * rms / radii[0] * (0.01 + time) * rng.normal(size=wander.shape)
    drift_of({"angle_driver": louder, "angle_driven": angles[1]}, radii, notes)
    assert any(one.startswith("the scatter of the transmission error") for one in notes)


def test_an_angle_zero_that_is_not_contact_is_said_and_taken_off() -> None:
    values = channels()
    made = taken({**values, "angle_driven": values["angle_driven"] + 2.0})
    assert not made.zero_known and abs(made.mean("angle_driven").mean()) < 1e-12
    assert any("zero is not unloaded contact" in one for one in made.warnings)


def test_a_second_realisation_is_left_out_in_words() -> None:
    other = channels(seed=1)
    two = {name: np.stack([value, other[name]]) for name, value in channels().items()}
    made = measurement(make_record(two, attributes()), "base", nominal())
    assert made.repetitions == 2 and "2 realisations only the first" in made.warnings[0]


# ---- what is held out


def named(*names: str) -> list[Measurement]:
    one = taken()
    return [Measurement(name, one.record, one.periods, RATE, MESH, one.phase, condition=name) for name in names]


@pytest.mark.parametrize(
    ("names", "wanted", "held"),
    [
        (("base", "held-out"), None, "held-out"),
        (("base",), None, None),
        (("held-out",), None, None),
        (("a", "b", "c"), None, None),
        (("a", "b", "c", "d"), None, "d"),
        (("a", "b"), "a", "a"),
    ],
)
def test_which_record_is_held_out(names: tuple[str, ...], wanted: str | None, held: str | None) -> None:
    rest, out = held_out_of(named(*names), wanted)
    assert (out.name if out else None) == held
    assert {one.name for one in rest} == set(names) - {held}


def test_held_out_of_an_unknown_or_the_only_record_is_refused() -> None:
    with pytest.raises(DiagnosisError, match="held_out = x names 0 records, must name one of a, b"):
        held_out_of(named("a", "b"), "x")
    with pytest.raises(DiagnosisError, match="only record"):
        held_out_of(named("a"), "a")

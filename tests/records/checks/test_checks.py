"""Records of small virtual rigs, sound and spoilt one channel at a time: what the door says."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from shared.spoilt import (
    RIGS,
    Change,
    attribute,
    bare,
    clip,
    constant,
    late,
    simulated,
    times,
    under_steady_load,
    with_values,
    without,
)

import gearbench as gb
from gearbench.records import RecordError
from gearbench.records.checks import check_record
from gearbench.records.checks.clipping import clipped_ends, lost_by_clipping
from gearbench.records.transmission_error import force_of_torques


@pytest.fixture(scope="module")
def rigs() -> dict[str, xr.Dataset]:
    return {name: simulated(name) for name in ("free", "tangential", "overdamped", "16/48", "16/48 noise")}


def swapped(record: xr.Dataset) -> xr.Dataset:
    found = record
    for quantity in ("torque", "angle", "y"):
        first, second = (record[f"{quantity}_{gear}"].values for gear in ("driver", "driven"))
        found = with_values(with_values(found, f"{quantity}_driver", second), f"{quantity}_driven", first)
    return found


@pytest.mark.parametrize("name", RIGS)
def test_sound_records_pass_in_silence(name: str) -> None:
    record = simulated(name)
    assert check_record(record) == ()
    assert check_record(bare(record)) == ()
    assert check_record(record[["dte", "force"]]) == ()


REFUSED: list[tuple[Change, str]] = [
    (swapped, "are driver and driven swapped|driver and driven are swapped"),
    (times("y_driver", -1.0), "y_driver moves against the force of the teeth"),
    (times("y_driven", -1.0), "y_driven moves against the force of the teeth"),
    (times("y_driver", 1e3), "in mm or um"),
    (times("y_driven", 1e-3), "in mm or um"),
    (times("angle_driven", 180 / np.pi), "is angle_driven in degrees"),
    (lambda r: times("angle_driver", 57.29578)(times("angle_driven", 57.29578)(r)), "are the angles in degrees"),
    (times("angle_driver", -1.0), "angle_driver does not rise"),
    (
        lambda r: with_values(r, "angle_driver", r.angle_driver.values - 2 * np.pi * (r.angle_driver.values > 0.5)),
        "angle_driver jumps",
    ),
    (times("torque_driver", 1e3), "torque_mean = 200 N m .*in N mm"),
    (times("torque_driven", 1e3), "torque_driven in N mm"),
    (times("torque_driven", -1.0), "torque_driven in the other direction"),
    (attribute("teeth_driver", 63 / 62), "teeth 63/62 want"),
    (attribute("base_radius_driver", 1e3), "is it in mm"),
    (attribute("working_pressure_angle", 180 / np.pi), "is it in degrees"),
    (attribute("mesh_period", 1.5), "but mesh_period says"),
]


@pytest.mark.parametrize("rig", ["free", "tangential", "overdamped"])
@pytest.mark.parametrize(("change", "words"), REFUSED, ids=[words[:30] for _, words in REFUSED])
def test_what_cannot_be_is_refused(rigs: dict[str, xr.Dataset], rig: str, change: Change, words: str) -> None:
    with pytest.raises(RecordError, match=words):
        check_record(change(bare(rigs[rig])))


def test_torque_without_a_declared_mean_is_known_by_the_inertias(rigs: dict[str, xr.Dataset]) -> None:
    both = times("torque_driver", 1e3)(times("torque_driven", 1e3)(bare(rigs["tangential"])))
    with pytest.raises(RecordError, match="the torques are 1000 times too large for the accelerations"):
        check_record(without("torque_mean")(both))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (times("dte", -1.0), "the stored dte .* contradicts angle_driver"),
        (times("dte", 0.5), "the stored dte"),
        (late("dte", 7), "the stored dte"),
        (times("force", 1e3), "the stored force .* contradicts torque_driver"),
        (times("force", -1.0), "the stored force"),
    ],
)
def test_stored_signals_that_the_channels_contradict(rigs: dict[str, xr.Dataset], change: Change, words: str) -> None:
    with pytest.raises(RecordError, match=words):
        check_record(change(rigs["tangential"]))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (times("dte", -1.0), "the dte move against the torque"),
        (times("dte", 0.0), r"dte is constant \(0 m\)"),
        (times("dte", 1e6), "in mm or um"),
    ],
)
def test_dte_and_force_alone(rigs: dict[str, xr.Dataset], change: Change, words: str) -> None:
    with pytest.raises(RecordError, match=words):
        check_record(change(rigs["free"][["dte", "force"]]))


@pytest.mark.parametrize(("mean", "refused"), [(0.5, False), (3.0, True)])
def test_a_mean_against_the_force_counts_beyond_what_parting_flanks_leave(
    rigs: dict[str, xr.Dataset], mean: float, refused: bool
) -> None:
    """Mean of the dte in rms of its fluctuation: flanks that part have it anywhere in the backlash."""
    record = rigs["free"][["dte", "force"]]
    swings = record.dte.values - record.dte.values.mean()
    opposed = with_values(record, "dte", -swings - mean * swings.std())
    said = "nothing"
    try:
        found = check_record(opposed)
        said = " ".join(one.sentence for one in found)
    except RecordError as error:
        said = str(error)
    assert ("move against the torque" in said) == refused


@pytest.mark.parametrize(
    ("name", "samples"), [("torque_driver", 1), ("torque_driver", -3), ("y_driver", 3), ("torque_driver", 20)]
)
def test_a_late_channel_is_named_with_its_delay(rigs: dict[str, xr.Dataset], name: str, samples: int) -> None:
    (found,) = check_record(late(name, samples)(bare(rigs["free"])))
    words = "lags behind" if samples > 0 else "leads"
    assert f"{name} {words} the other channels" in found.sentence
    assert float(found.sentence.split("(")[1].split(" ")[0]) == pytest.approx(abs(samples), rel=0.02)
    assert not found.refused and found.error > 0.1


@pytest.mark.parametrize("rig", ["16/48", "16/48 noise"])
@pytest.mark.parametrize("name", ["torque_driver", "angle_driver"])
def test_one_sample_shows_beside_stiff_supports_and_under_noise(
    rigs: dict[str, xr.Dataset], rig: str, name: str
) -> None:
    record = bare(rigs[rig])
    values = record[name].values
    ramp = 2 * np.pi / (16 * record.attrs["mesh_period"] * record.attrs["sampling_rate"]) * np.arange(values.shape[1])
    ramp = ramp if name == "angle_driver" else 0 * ramp
    later = np.roll(values - ramp, 1, axis=1) + ramp
    found = [one for one in check_record(with_values(record, name, later)) if "does not repeat" not in one.sentence]
    assert len(found) == 1 and f"{name} lags behind" in found[0].sentence and found[0].error > 0.1


def test_a_boundary_that_the_gears_do_not_keep_is_said(rigs: dict[str, xr.Dataset]) -> None:
    (found,) = check_record(bare(rigs["16/48"]).assign_attrs(driven_boundary="speed"))
    assert 'driven_boundary = "speed", but the driven gear takes part' in found.sentence
    held = bare(rigs["tangential"])
    (found,) = check_record(held.assign_attrs(driven_boundary="torque"))
    assert "turns as steadily as if it were held" in found.sentence
    # T1 / rb1 is right; with equal gears of 3.6e-3 and 0.0163 kg m^2 at least the load's part is taken wrong.
    right = held.torque_driver.values / held.attrs["base_radius_driver"]
    wrong = force_of_torques(held.assign_attrs(driven_boundary="torque")).values
    apart = float(np.std(wrong - right) / np.std(right))
    assert found.error == pytest.approx(apart, rel=0.1) and apart > 0.05


def test_inertias_that_do_not_balance_are_said_with_those_that_do(rigs: dict[str, xr.Dataset]) -> None:
    # A load that does not answer the driver's torque, so that the force depends on the inertias.
    record = under_steady_load(bare(rigs["free"]).drop_vars(["y_driver", "y_driven"]))
    assert check_record(record) == ()
    (found,) = [one for one in check_record(attribute("inertia_driver", 2.0)(record)) if "inertia_" in one.sentence]
    declared = record.attrs["inertia_driver"]
    assert f"inertia_driver = {2 * declared:.4g} kg m^2" in found.sentence and f"with {declared:.4g} " in found.sentence


def test_the_same_realisation_twice_is_refused(rigs: dict[str, xr.Dataset]) -> None:
    record = rigs["free"]
    with pytest.raises(RecordError, match="realisations 0 and 1 hold the same samples"):
        check_record(record.isel(realisation=[0, 0]))
    with pytest.raises(RecordError, match="records 1 and 2 of 2 hold the same samples"):
        gb.identify([record, record.copy()])


@pytest.mark.parametrize("rig", ["free", "tangential", "16/48 noise"])
def test_a_clock_or_mesh_period_off_by_a_hundredth_is_refused(rigs: dict[str, xr.Dataset], rig: str) -> None:
    record = bare(rigs[rig])
    with pytest.raises(RecordError, match="mesh_period says"):
        check_record(attribute("mesh_period", 1.01)(record))
    fast = attribute("sampling_rate", 1.01)(record.assign_coords(time=record.time / 1.01))
    with pytest.raises(RecordError, match="mesh_period says"):
        check_record(fast)


def test_a_stored_signal_of_another_gain_is_said(rigs: dict[str, xr.Dataset]) -> None:
    for rig in ("tangential", "16/48 noise"):
        (found,) = [one for one in check_record(times("dte", 1.1)(rigs[rig])) if "stored" in one.sentence]
        assert "the stored dte is 1.1 times" in found.sentence and found.error == pytest.approx(0.1, abs=0.02)


def test_dead_channels_are_said(rigs: dict[str, xr.Dataset]) -> None:
    (dead,) = check_record(constant("torque_driven")(bare(rigs["free"])))
    assert "torque_driven is constant" in dead.sentence and dead.error == 1.0
    # A gear at constant speed needs no torque of its own.
    assert check_record(constant("torque_driven")(bare(rigs["tangential"]))) == ()
    (dead,) = check_record(constant("y_driver")(bare(rigs["free"])))
    assert "y_driver is constant" in dead.sentence and 0.1 < dead.error < 0.6


@pytest.mark.parametrize("share", [0.01, 0.1])
def test_few_clipped_samples_show(rigs: dict[str, xr.Dataset], share: float) -> None:
    record = bare(rigs["16/48 noise"])
    low, high = np.quantile(record.torque_driver.values, [share / 2, 1 - share / 2])
    spoilt = with_values(record, "torque_driver", np.clip(record.torque_driver.values, low, high))
    (found,) = [one for one in check_record(spoilt) if "clipped" in one.sentence]
    assert f"clipped at {share:.2g} of" in found.sentence and 0.0 < found.error < 0.2


@pytest.mark.parametrize("part", [0.5, 0.8])
def test_a_clipped_torque_costs_what_clipping_took(rigs: dict[str, xr.Dataset], part: float) -> None:
    record = bare(rigs["free"])
    spoilt = clip("torque_driver", part)(record)
    (found,) = [one for one in check_record(spoilt) if "clipped" in one.sentence]
    lost = float((record.torque_driver - spoilt.torque_driver).std() / spoilt.torque_driver.std())
    assert 0.6 * lost < found.error < 5 * lost


def test_lost_by_clipping_of_a_sine() -> None:
    values = np.sin(2 * np.pi * np.arange(4000) / 80.0)
    kept = np.clip(values, -0.8, 0.8)
    assert lost_by_clipping(kept) == pytest.approx((values - kept).std() / kept.std(), rel=0.3)
    assert clipped_ends(values) == (0.0, 0.0)


def test_a_quantised_signal_is_not_clipped() -> None:
    assert clipped_ends(np.round(np.sin(np.arange(5000) / 7) * 20)) == (0.0, 0.0)
    high, low = clipped_ends(np.minimum(np.round(np.sin(np.arange(5000) * np.pi / 250) * 200), 150))
    # A sine stands above 3/4 of its height for (1 - 2 asin(0.75) / pi) / 2 of its time; the nearest step counts.
    assert high == pytest.approx((1 - 2 * np.arcsin(0.7475) / np.pi) / 2, rel=0.02) and low == 0.0


def test_periods_that_differ_are_told_as_a_share() -> None:
    record = simulated("noise")
    noise = record.dte.values.std() * 0.5 * np.random.default_rng(2).standard_normal(record.dte.shape)
    (found,) = check_record(with_values(record[["dte", "force"]], "dte", record.dte.values + noise))
    assert "the dte does not repeat" in found.sentence and "0.47 of its rms" in found.sentence


ODD: list[tuple[str, object, str]] = [
    ("inertia_driver", "2 kg", "is not a number"),
    ("mesh_period", [1.0, 2.0], "is not a number"),
    ("teeth_driven", "many", "is not a number"),
    ("working_pressure_angle", 0.3 + 1j, "is not a number"),
    ("periods_averaged", np.nan, "must be finite"),
    ("inertia_driven", 1e300, "must lie between"),
    ("support_direction", np.zeros(3), "is not text"),
    ("schema", np.zeros(3), "schema is|is not text"),
    ("mesh_phase", "early", "is no number of cycles"),
    ("mesh_phase", np.zeros(5), "has 5 values"),
]


@pytest.mark.parametrize(("name", "value", "words"), ODD, ids=[f"{name}-{words}" for name, _, words in ODD])
def test_an_attribute_of_the_wrong_kind_is_refused_by_name(
    rigs: dict[str, xr.Dataset], name: str, value: object, words: str
) -> None:
    with pytest.raises(RecordError, match=words):
        gb.validate_record(rigs["free"].assign_attrs({name: value}))


SETTINGS = gb.IdentificationSettings(
    harmonics=40, order=2, window=8, band=(800.0, 1500.0), phases=32, accept_doubts=True
)


@pytest.fixture(scope="module")
def measured() -> tuple[xr.Dataset, xr.Dataset]:
    """A record that nothing is wrong with, and what is identified from it."""
    record = bare(gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=40"])))
    return record, gb.identify([record], SETTINGS)


@pytest.mark.validation
@pytest.mark.parametrize(
    "change",
    [
        clip("torque_driver", 0.8),
        late("torque_driver", 3),
        clip("torque_driver", 0.5),
        late("torque_driver", 1),
    ],
    ids=["clipped at 0.8", "three samples late", "clipped at half", "one sample late"],
)
def test_expected_error_covers_what_is_only_warned_of(measured: tuple[xr.Dataset, xr.Dataset], change: Change) -> None:
    record, sound = measured
    spoilt = gb.identify([change(record)], SETTINGS)
    error = np.linalg.norm(gb.itf(spoilt) - gb.itf(sound)) / np.linalg.norm(gb.itf(sound))
    assert error < 2.0 * spoilt.attrs["expected_error"]
    assert spoilt.attrs["expected_error"] > 1.5 * sound.attrs["expected_error"]
    assert "torque_driver" in spoilt.attrs["warnings"]


def test_compare_and_identify_refuse_at_the_door(rigs: dict[str, xr.Dataset]) -> None:
    wrong = times("y_driver", -1.0)(bare(rigs["free"]))
    with pytest.raises(RecordError, match="b: y_driver moves against"):
        gb.compare(rigs["free"], wrong)
    with pytest.raises(RecordError, match="y_driver moves against"):
        gb.identify([wrong])
    doubtful = late("torque_driver", 2)(bare(rigs["free"]))
    assert any("b: torque_driver lags" in note for note in gb.compare(rigs["free"], doubtful).notes)

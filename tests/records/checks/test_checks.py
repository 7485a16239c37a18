"""Records of small virtual rigs, sound and spoilt one channel at a time: what the door says."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import gearbench as gb
from gearbench.records import RecordError
from gearbench.records.checks import check_record
from gearbench.records.checks.clipping import clipped_ends, lost_by_clipping

Change = Callable[[xr.Dataset], xr.Dataset]

SHORT = ["experiment.realisations=1", "experiment.seed=5"]
OVERDAMPED = ["rig.support.stiffness_n_per_m=6e6", "rig.support.damping_n_s_per_m=8e4"]
RIGS = {
    "free": [],
    "speed": ['rig.load.boundary="speed"'],
    "tangential": ['rig.support.direction="tangential"', 'rig.load.boundary="speed"'],
    "overdamped": [*OVERDAMPED, 'rig.load.boundary="speed"'],
    "unequal": ["rig.driver.teeth=45"],
    "friction": ["rig.friction.coefficient=0.06"],
    "soft coupling": ["rig.drive.coupling={inertia_kg_m2=2e-2, stiffness_nm_per_rad=5e3, damping_nm_s_per_rad=1.0}"],
    "noise": ["rig.sensors={noise_angle_urad=0.5, noise_displacement_um=0.02, noise_torque_nm=0.5}"],
}


def simulated(name: str) -> xr.Dataset:
    return gb.simulate(gb.read_case("quick_lumped", SHORT + RIGS[name]))


@pytest.fixture(scope="module")
def rigs() -> dict[str, xr.Dataset]:
    return {name: simulated(name) for name in ("free", "tangential", "overdamped")}


def bare(record: xr.Dataset) -> xr.Dataset:
    """The record as a measurement has it: nothing that is computed from other channels."""
    return record.drop_vars(["dte", "force"])


def with_values(record: xr.Dataset, name: str, values: NDArray[np.float64]) -> xr.Dataset:
    return record.assign({name: (record[name].dims, values, record[name].attrs)})


def times(name: str, factor: float) -> Change:
    return lambda record: with_values(record, name, factor * record[name].values)


def late(name: str, samples: int) -> Change:
    return lambda record: with_values(record, name, np.roll(record[name].values, samples, axis=1))


def constant(name: str) -> Change:
    return lambda record: with_values(record, name, np.full_like(record[name].values, record[name].values.mean()))


def attribute(name: str, factor: float) -> Change:
    return lambda record: record.assign_attrs({name: record.attrs[name] * factor})


def without(*names: str) -> Change:
    def change(record: xr.Dataset) -> xr.Dataset:
        return record.drop_attrs().assign_attrs({k: v for k, v in record.attrs.items() if k not in names})

    return change


def clip(name: str, part: float) -> Change:
    def change(record: xr.Dataset) -> xr.Dataset:
        values = record[name].values - record[name].values.mean()
        most = part * np.abs(values).max()
        return with_values(record, name, np.clip(values, -most, most) + record[name].values.mean())

    return change


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
    (lambda r: times("angle_driver", 57.29578)(times("angle_driven", 57.29578)(r)), "are? in degrees|is the angles"),
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


@pytest.mark.parametrize(
    ("name", "samples"), [("torque_driver", 1), ("torque_driver", -3), ("y_driver", 3), ("torque_driver", 20)]
)
def test_a_late_channel_is_named_with_its_delay(rigs: dict[str, xr.Dataset], name: str, samples: int) -> None:
    (found,) = check_record(late(name, samples)(bare(rigs["free"])))
    words = "lags behind" if samples > 0 else "leads"
    assert f"{name} {words} the other channels" in found.sentence
    assert float(found.sentence.split("(")[1].split(" ")[0]) == pytest.approx(abs(samples), rel=0.02)
    assert not found.refused and found.error > 0.1


def test_dead_channels_are_said(rigs: dict[str, xr.Dataset]) -> None:
    (dead,) = check_record(constant("torque_driven")(bare(rigs["free"])))
    assert "torque_driven is constant" in dead.sentence and dead.error == 1.0
    # A gear at constant speed needs no torque of its own.
    assert check_record(constant("torque_driven")(bare(rigs["tangential"]))) == ()
    (dead,) = check_record(constant("y_driver")(bare(rigs["free"])))
    assert "y_driver is constant" in dead.sentence and 0.1 < dead.error < 0.6


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


def test_periods_that_differ_are_told_as_a_share() -> None:
    record = simulated("noise")
    noise = record.dte.values.std() * 0.5 * np.random.default_rng(2).standard_normal(record.dte.shape)
    (found,) = check_record(with_values(record[["dte", "force"]], "dte", record.dte.values + noise))
    assert "the dte does not repeat" in found.sentence and "0.47 of its rms" in found.sentence


def test_text_in_an_attribute_is_refused_by_name(rigs: dict[str, xr.Dataset]) -> None:
    for name, value in (("inertia_driver", "2 kg"), ("mesh_period", [1.0, 2.0]), ("teeth_driven", "many")):
        with pytest.raises(RecordError, match=f"attribute {name} = .* is not a number"):
            gb.validate_record(rigs["free"].assign_attrs({name: value}))


@pytest.mark.parametrize(
    "change",
    [clip("torque_driver", 0.5), clip("torque_driver", 0.8), late("torque_driver", 1), late("torque_driver", 3)],
    ids=["clipped at half", "clipped at 0.8", "one sample late", "three samples late"],
)
def test_expected_error_covers_what_is_only_warned_of(change: Change) -> None:
    case = gb.read_case("quick_lumped", ["experiment.realisations=40"])
    record = bare(gb.simulate(case))
    settings = gb.IdentificationSettings(harmonics=40, order=2, window=8, band=(500.0, 2500.0), phases=32)
    sound, spoilt = gb.identify([record], settings), gb.identify([change(record)], settings)
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

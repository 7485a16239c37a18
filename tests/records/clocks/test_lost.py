"""Samples that channels lost within a record are named with number and place, and nothing else is taken for them."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from shared.spoilt import RIGS, bare, simulated, with_values

from gearbench.records.clocks.late import clocks_agree
from gearbench.records.clocks.lost import channels_keep_step, periods_keep_step
from gearbench.records.clocks.slips import no_gap_in_all_channels
from gearbench.records.seen.look import Look


def lost(record: xr.Dataset, names: tuple[str, ...], count: int, at: float) -> xr.Dataset:
    """Without `count` samples of some channels after the part `at` of the record; at the end they go on as they would.

    Angles go on by whole periods."""
    size = record.sizes["time"]
    place = int(at * size)
    for name in names:
        values = record[name].values
        turned = values[:, :1] * 0.0
        if name.startswith("angle_"):
            gear = name.removeprefix("angle_")
            cycles = size / record.attrs["sampling_rate"] / record.attrs["mesh_period"]
            turned = turned + cycles * 2 * np.pi / record.attrs[f"teeth_{gear}"]
        longer = np.concatenate([values, values[:, :count] + turned], axis=1)
        record = with_values(record, name, np.delete(longer, np.s_[place : place + count], axis=1))
    return record


@pytest.fixture(scope="module")
def record() -> xr.Dataset:
    return bare(simulated("16/48 noise"))


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (("y_driver",), "y_driver leaps"),
        (("torque_driver",), "torque_driver leaps"),
        (("y_driver", "y_driven"), "the displacements (y_driven, y_driver) leap"),
        (("angle_driver", "angle_driven"), "the angles (angle_driven, angle_driver) leap"),
    ],
)
@pytest.mark.parametrize(("count", "at"), [(3, 0.55), (12, 0.31)])
def test_lost_samples_are_named(record: xr.Dataset, names: tuple[str, ...], words: str, count: int, at: float) -> None:
    look = Look(lost(record, names, count, at))
    assert clocks_agree(look) == []
    (found,) = channels_keep_step(look)
    assert found.refused and found.sentence.startswith(f"{words} by ") and "lost samples" in found.sentence
    assert float(found.sentence.split("by ")[1].split(" samples")[0]) == pytest.approx(count, abs=0.5)
    first, last = (int(one) for one in found.sentence.split("between samples ")[1].split(",")[0].split(" and "))
    assert first < at * look.samples < last


@pytest.mark.parametrize("name", RIGS)
def test_sound_rigs_and_common_lags_keep_step(name: str) -> None:
    record = bare(simulated(name))
    for given in (record, with_values(record, "y_driver", np.roll(record["y_driver"].values, 4, axis=1))):
        assert channels_keep_step(Look(given)) == [] and no_gap_in_all_channels(Look(given)) == []


@pytest.mark.parametrize("count", [5, 40])
def test_samples_that_all_channels_lost_are_missed(record: xr.Dataset, count: int) -> None:
    names = tuple(f"{kind}_{gear}" for kind in ("torque", "angle", "y") for gear in ("driver", "driven"))
    look = Look(lost(record, names, count, 0.4))
    assert channels_keep_step(look) == []
    (found,) = no_gap_in_all_channels(look)
    assert f"about {count} samples are missing in the angles, or in all" in found.sentence
    assert f"samples {int(0.4 * look.samples) - 1} and" in found.sentence


@pytest.mark.parametrize("name", ["dte", "force"])
@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_periods_that_come_early_are_named_without_channels_of_the_gears(name: str, noise: float) -> None:
    """Three periods of dte and force alone, five samples of one lost in the second."""
    whole = simulated("free")
    size = whole.sizes["time"] // int(whole.attrs["periods"])
    assert periods_keep_step(Look(whole)) == []
    random, rows = np.random.default_rng(2), {}
    for one in ("dte", "force"):
        values = np.tile(whole[one].values[0, :size], 4)
        values = np.delete(values, np.s_[int(1.4 * size) : int(1.4 * size) + 5]) if one == name else values
        rows[one] = values[: 3 * size] + noise * values.std() * random.standard_normal(3 * size)
    time = ("time", np.arange(3 * size) / whole.attrs["sampling_rate"], whole.time.attrs)
    given = xr.Dataset(
        {one: (("realisation", "time"), row[None], whole[one].attrs) for one, row in rows.items()}, {"time": time},
        whole.attrs | {"periods": 3, "samples_per_period": size},
    )  # fmt: skip
    (found,) = periods_keep_step(Look(given))
    assert f"the {name} of samples {2 * size} to {3 * size} is that of the first" in found.sentence
    assert float(found.sentence.split(f"first {size} ")[1].split()[0]) == pytest.approx(5.0, abs=0.1)
    assert "earlier" in found.sentence and "lost" in found.sentence

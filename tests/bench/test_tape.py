"""Interrupted simulations go on where they were: same record to the last bit, nothing done twice."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr

import gearbench as gb
from gearbench.bench import experiment
from gearbench.bench import tape as tape_module
from gearbench.bench.tape import Shelf, discard, leaves, restored
from gearbench.files import FileError
from gearbench.rig import Case

LINEAR = gb.read_case(
    "quick_lumped",
    ["experiment.realisations=3", "experiment.samples_per_period=4096", "experiment.multisine.band_hz=[9,900]"],
)
# Both gears free and a record shorter than what repeats: its courses begin anew until two agree.
NON_LINEAR = gb.read_case(
    "quick_lumped",
    [
        "experiment.realisations=2",
        "experiment.samples_per_period=2048",
        "experiment.periods=2",
        "experiment.mesh_frequency_hz=4",
        "experiment.multisine.band_hz=[9,900]",
        "rig.driver.runout_um=5",
    ],
)
REDUCED = gb.read_case(
    "quick_fe",
    [
        "experiment.samples_per_period=1024",
        "experiment.sampling_rate_hz=10240",
        "experiment.periods=1",
        "experiment.mesh_frequency_hz=100",
        "experiment.multisine.band_hz=[9,900]",
        "identification.band_hz=[9,900]",
    ],
)


class Stopped(Exception):
    """An interruption."""


@pytest.fixture(autouse=True)
def _eager(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(experiment, "Shelf", partial(Shelf, interval=0.0))


def interrupted(case: Case, folder: Path, after: int) -> None:
    """Simulate until progress has been told `after` times."""
    told = 0

    def listen(fraction: float, note: str) -> None:
        nonlocal told
        told += fraction > 0
        if told > after:
            raise Stopped

    with pytest.raises(Stopped):
        gb.simulate(case, progress=listen, checkpoints=folder)


def same(one: xr.Dataset, two: xr.Dataset) -> bool:
    return one.equals(two) and all(np.array_equal(one.attrs[key], two.attrs[key]) for key in one.attrs)


@pytest.mark.parametrize("case", [LINEAR, NON_LINEAR, REDUCED], ids=["linear", "non-linear", "reduced"])
def test_a_simulation_interrupted_again_and_again_ends_as_if_it_had_not(case: Case, tmp_path: Path) -> None:
    folder = tmp_path / "record.nc.part"
    whole = gb.simulate(case)
    for after in (1, 1, 2):
        interrupted(case, folder, after)
    assert same(gb.simulate(case, checkpoints=folder), whole)


def test_what_was_done_is_not_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "part"
    gb.simulate(LINEAR, checkpoints=folder)

    def advance(*_: object) -> None:
        raise AssertionError("integrated again")

    monkeypatch.setattr("gearbench.bench.linear.run.LinearRig.advance", advance)
    gb.simulate(LINEAR, checkpoints=folder)


def test_another_simulation_begins_anew(tmp_path: Path) -> None:
    folder = tmp_path / "part"
    gb.simulate(LINEAR, checkpoints=folder)
    other = LINEAR.model_copy(update={"experiment": LINEAR.experiment.model_copy(update={"seed": 7})})
    assert same(gb.simulate(other, checkpoints=folder), gb.simulate(other))


@pytest.mark.parametrize("damage", ["cut", "empty", "text"])
def test_damaged_checkpoints_cost_time_only(damage: str, tmp_path: Path) -> None:
    folder = tmp_path / "part"
    interrupted(NON_LINEAR, folder, 4)
    for path in sorted(folder.glob("*.npz")):
        content = path.read_bytes()
        path.write_bytes({"cut": content[: len(content) // 2], "empty": b"", "text": b"no archive"}[damage])
    assert same(gb.simulate(NON_LINEAR, checkpoints=folder), gb.simulate(NON_LINEAR))


def test_foreign_files_stay(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(FileError, match="another origin"):
        gb.simulate(LINEAR, checkpoints=tmp_path)
    assert (tmp_path / "thesis.tex").exists()


def test_only_what_a_simulation_made_is_discarded(tmp_path: Path) -> None:
    mine, kept = tmp_path / "mine.part", tmp_path / "record.nc.part"
    mine.mkdir()
    (mine / "about.json").write_text('{"title": "years of work"}')
    interrupted(LINEAR, kept, 1)
    assert (kept / "about.json").exists()
    discard(mine)
    discard(kept)
    assert mine.exists() and not kept.exists()


def test_states_come_back_as_they_were() -> None:
    class Inner(NamedTuple):
        values: np.ndarray
        number: int

    class Outer(NamedTuple):
        time: float
        inner: Inner

    teeth = np.zeros(3, np.dtype([("side", np.int8), ("gap", float)], align=True))
    state = Outer(0.1 + 0.2, Inner(teeth, 4))
    back = restored(state, iter(leaves(state)))
    assert back.time == state.time and type(back.inner) is Inner and back.inner.number == 4
    assert back.inner.values.dtype.isalignedstruct
    with pytest.raises(ValueError, match="too few"):
        restored(state, iter(leaves(state)[:-1]))


@pytest.mark.parametrize(("size", "least", "most"), [(1, 790, 800), (4000, 100, 200)])
def test_large_states_are_kept_less_often_as_time_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: int, least: int, most: int
) -> None:
    """Over 4000 s a small state is kept every 5 s. A large one is kept so often that a fiftieth of the time may be
    lost: 50 + 50 ln(4000/250) = 189 times at most."""
    clock = [0.0]
    monkeypatch.setattr(tape_module.time, "monotonic", lambda: clock[0])
    kept = [0.0]
    monkeypatch.setattr(Shelf, "write", lambda *given: kept.append(clock[0]))
    tape = Shelf(tmp_path / "part", "a").tape("0", np.zeros(size))
    for second in range(4000):
        clock[0] = float(second)
        tape.put(np.full(size, clock[0]), np.array([[clock[0]]]))
        assert clock[0] - kept[-1] < max(5.0, 0.02 * second) + 1.0
    assert least <= len(kept) <= most

"""Records that go into their file piece by piece: the same to the last bit, in memory that does not grow with them."""

from __future__ import annotations

import tracemalloc
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearbench as gb
from gearbench.bench import experiment, realisations
from gearbench.bench.plan import memory, stored
from gearbench.bench.tape import Shelf
from gearbench.files import FileError
from gearbench.rig import Case

SHORT = [
    "experiment.realisations=3",
    "experiment.samples_per_period=2048",
    "experiment.periods=2",
    "experiment.mesh_frequency_hz=20",
    "experiment.multisine.band_hz=[9,900]",
]
SENSORS = [
    "rig.sensors.noise_angle_urad=1",
    "rig.sensors.noise_torque_nm=0.1",
    "rig.sensors.quantisation_angle_urad=3",
    "rig.sensors.gain_torque_driver=1.02",
]
LAG = ["rig.sensors.filter_hz=3000", "rig.sensors.delay_angle_driver_us=100"]
RUNOUT = ["rig.sensors.encoder_runout_driver_urad=30", "rig.driver.runout_um=5"]
REDUCED = [
    "experiment.samples_per_period=512",
    "experiment.sampling_rate_hz=10240",
    "experiment.periods=3",
    "experiment.mesh_frequency_hz=100",
    "experiment.multisine.band_hz=[20,900]",
    "identification.band_hz=[20,900]",
    "simulation.outputs=teeth",
]
CASES = {
    "linear": ("quick_lumped", SHORT),
    "non-linear": ("quick_lumped", [*SHORT, *SENSORS, "rig.mesh.stiffness_scale=1.001"]),
    "filtered": ("quick_lumped", [*SHORT, *SENSORS, *LAG]),
    "run-out": ("quick_lumped", [*SHORT, *SENSORS, *RUNOUT]),
    "drift": ("quick_lumped", [*SHORT, *SENSORS, "rig.mesh.stiffness_drift=0.01"]),
    "reduced": ("quick_fe", [*REDUCED, *SENSORS]),
}
SOON, LATER = ("non-linear", "filtered", "reduced"), ("linear", "run-out", "drift")


@pytest.fixture
def _pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pieces of 500 samples, of which all wait on the disk."""
    monkeypatch.setattr(realisations, "PIECE", 500)
    monkeypatch.setattr(stored, "LONG", 1)
    monkeypatch.setattr(experiment, "Shelf", partial(Shelf, interval=0.0))


def case_of(name: str, *settings: str) -> Case:
    base, given = CASES[name]
    return gb.read_case(base, [*given, *settings])


def same(one: xr.Dataset, two: xr.Dataset) -> bool:
    ordered = list(one.variables) == list(two.variables) and list(one.attrs) == list(two.attrs)
    return ordered and one.identical(two) and all(np.array_equal(one[name], two[name]) for name in one.variables)


@pytest.mark.usefixtures("_pieces")
@pytest.mark.parametrize("name", [*SOON, *(pytest.param(name, marks=pytest.mark.validation) for name in LATER)])
def test_the_record_is_the_one_that_is_made_in_memory(name: str, tmp_path: Path) -> None:
    case, path = case_of(name), tmp_path / "record.nc"
    record = gb.simulate(case)
    made = gb.simulate_to(case, path, workers=2)
    found = gb.read_record(path)
    assert same(found, record)
    assert list(tmp_path.iterdir()) == [path]
    assert made["torque_rms_nm"] == pytest.approx(float(record["torque_driver"].std()), rel=1e-12)
    assert made["dte_peak_to_peak_um"] == 1e6 * float(record["dte"].max() - record["dte"].min())


@pytest.mark.usefixtures("_pieces")
def test_what_is_interrupted_ends_as_if_it_had_not(tmp_path: Path) -> None:
    """While realisations run and while the file is written."""
    case, path = case_of("run-out"), tmp_path / "record.nc"
    gb.simulate_to(case, path)
    whole = path.read_bytes()
    path.unlink()

    def stop(at: str, fraction: float, note: str) -> None:
        if note.startswith(at):
            raise InterruptedError(at)

    for at in ("realisation 1", "realisation 3", "writing realisation 1", "writing realisation 3"):
        with pytest.raises(InterruptedError, match=at):
            gb.simulate_to(case, path, progress=partial(stop, at), workers=1)
        assert [one.name for one in tmp_path.iterdir()] == ["record.nc.part"]
    gb.simulate_to(case, path)
    assert path.read_bytes() == whole


@pytest.mark.usefixtures("_pieces")
def test_a_lost_part_is_told(tmp_path: Path) -> None:
    case, path = case_of("linear"), tmp_path / "record.nc"

    def lose(fraction: float, note: str) -> None:
        if note.startswith("writing"):
            for end in (tmp_path / "record.nc.part").glob("end-2.npz"):
                end.unlink()

    with pytest.raises(FileError, match=r"record\.nc\.part has lost a realisation"):
        gb.simulate_to(case, path, progress=lose)
    assert not path.exists()
    gb.simulate_to(case, path)
    assert gb.read_record(path).sizes["realisation"] == 3


@pytest.mark.validation
@pytest.mark.parametrize("name", ["non-linear", "filtered", "reduced"])
def test_memory_does_not_grow_with_the_record(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Four times the realisations, and of a model whose periods are run one by one, four times the periods."""
    monkeypatch.setattr(realisations, "PIECE", 1024)
    monkeypatch.setattr(stored, "LONG", 2**18)
    monkeypatch.setattr(experiment, "Shelf", partial(Shelf, waiting=2**18))
    peaks = []
    longer = "experiment.periods" if name == "reduced" else "experiment.realisations"
    for count in (8, 8, 32):
        tracemalloc.start()
        gb.simulate_to(case_of(name, "experiment.realisations=1", f"{longer}={count}"), tmp_path / "r.nc", workers=1)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 1.1 * peaks[1]


def test_what_does_not_fit_while_it_runs_is_refused_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "memory_free", lambda: 10_000_000)
    words = r"^a realisation of 4096 samples in \d+ steps each, 2048 of them in an excitation period, takes about"
    words += r" 0\.\d+ GB of memory while it runs, 2 at a time 0\.\d+ GB, and 0\.01 GB are free: lower"
    words += r" experiment\.samples_per_period or experiment\.periods, leave out rig\.sensors\.filter_hz and delays,"
    words += r" which need the whole record at once, or run fewer than 2 at a time \(--workers\)$"
    stopped = pytest.fail
    monkeypatch.setattr(memory, "NUMBER", 1000)  # of bytes
    with pytest.raises(gb.bench.BenchError, match=words):
        gb.simulate_to(case_of("filtered"), tmp_path / "r.nc", workers=2, progress=lambda f, n: f and stopped(n))
    assert not list(tmp_path.iterdir())


def test_a_disk_that_is_too_small_is_told_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory.shutil, "disk_usage", lambda path: memory.shutil._ntuple_diskusage(1, 1, 1000))
    with pytest.raises(gb.bench.BenchError, match=r"r\.nc takes about 0\.000983 GB, and with .* 1e-06 GB are free on"):
        gb.simulate_to(case_of("non-linear"), tmp_path / "r.nc")


def test_stretches_of_noise_are_those_of_the_whole() -> None:
    from gearbench.bench.record.sensors import Noise

    whole = Noise(3, 1000).take(2, (2, 3500))
    parts = Noise(3, 1000, realisation=1)
    found = [parts.take(2, (1, count), at) for at, count in ((0, 700), (700, 700), (1400, 100), (1500, 2000))]
    np.testing.assert_array_equal(np.concatenate(found, axis=1)[0], whole[1])
    np.testing.assert_array_equal(Noise(3, 1000, realisation=1).take(2, (1, 50), 1234)[0], whole[1, 1234:1284])

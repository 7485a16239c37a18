"""Gears with errors through the commands' functions: static and transient agree, periods that repeat or do not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gearbench.bench import BenchError
from gearbench.bench.experiment import simulate
from gearbench.bench.plan.schedule import cycles_to_repeat, schedule
from gearbench.bench.statics import static
from gearbench.figures.gears.static import plot_static
from gearbench.geometry import GeometryError
from gearbench.rig import Case, read_case

TEETH = 12
ERRORS = [3.0, -2.0, 0.0, 5.0, 1.0, -4.0, 2.0, 0.0, -1.0, 4.0, -3.0, -5.0]
CASE = """
name = "errors"
[rig.driver]
teeth = 12
module_mm = 3.0
profile_shift = 0.4
face_width_mm = 20.0
hub_radius_mm = 12.0
thinning_um = 60.0
[rig.driven]
teeth = 12
module_mm = 3.0
profile_shift = 0.4
face_width_mm = 20.0
hub_radius_mm = 12.0
thinning_um = 60.0
[rig.support]
stiffness_n_per_m = 1e9
damping_n_s_per_m = 2e4
[experiment]
mesh_frequency_hz = 4.0
torque_mean_nm = 60.0
sampling_rate_hz = 400.0
samples_per_period = 600
periods = 2
settling_periods_max = 4
[simulation]
model = "reduced"
element_size_um = 600.0
modes = 2
[identification]
band_hz = [1.0, 100.0]
"""
PITCH = f"rig.driver.pitch_error_um={ERRORS}"
RELIEF = ["rig.driver.tip_relief_um=10", "rig.driver.tip_relief_start_diameter_mm=43"]
RUNOUT = ["rig.driven.runout_um=12", "rig.driven.runout_phase_deg=50"]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("case") / "errors.toml"
    path.write_text(CASE, encoding="utf-8")
    return path


def make(file: Path, *settings: str) -> Case:
    return read_case(file, settings)


@pytest.fixture(scope="module")
def at_rest(file: Path) -> xr.Dataset:
    return static(make(file, PITCH, *RELIEF, *RUNOUT), positions=50, cycles=TEETH)


@pytest.mark.validation
def test_the_slow_transient_is_the_static_response(file: Path, at_rest: xr.Dataset) -> None:
    """Both periods of six mesh cycles make one turn of both gears, which is what repeats."""
    record = simulate(make(file, PITCH, *RELIEF, *RUNOUT))
    assert record.attrs["repeats_after_mesh_cycles"] == TEETH
    assert record.attrs["hunting_period"] == pytest.approx(TEETH / 4.0)
    assert "repeats after 12 mesh periods" in record.attrs["warnings"]
    phase, te = at_rest["phase"].values, at_rest["transmission_error"].values[0]
    found = np.interp(record["mesh_phase"].values[0] % TEETH, phase, te)
    swing = np.ptp(te)
    # Corners of the TE are rounded by a sample and by the supports' own motion.
    assert np.std(record["dte"].values[0] - found) < 0.01 * swing
    assert np.abs(record["dte"].values[0] - found).max() < 0.08 * swing


def test_errors_of_every_tooth_show_in_the_static_te(file: Path, at_rest: xr.Dataset) -> None:
    """At the pitch point one pair carries: the TE without load is minus its excess."""
    turn = 2 * np.pi * np.arange(TEETH) / TEETH - np.radians(50)
    expected = -1e-6 * (np.array(ERRORS) + 6 * np.cos(turn))
    unloaded = at_rest["transmission_error_unloaded"].values[::50]
    np.testing.assert_allclose(unloaded, expected, atol=2e-8)
    sound = static(make(file), positions=50)["transmission_error"].values[0, 0]
    np.testing.assert_allclose(at_rest["transmission_error"].values[0, ::50], sound + expected, atol=1e-7)
    assert at_rest.sizes["phase"] == 600 and at_rest.attrs["repeats_after_mesh_cycles"] == TEETH


def test_a_record_shorter_than_what_repeats_says_so(file: Path, at_rest: xr.Dataset) -> None:
    record = simulate(make(file, PITCH, *RELIEF, *RUNOUT, "experiment.periods=1"))
    assert record.sizes["time"] == 600
    assert "longer than the record" in record.attrs["warnings"]
    assert record.attrs["settling_residual"] <= 1e-3 and record.attrs["settling_periods"] == 2
    phase, te = at_rest["phase"].values, at_rest["transmission_error"].values[0]
    assert record["mesh_phase"].values[0, 0] == 0.0
    found = np.interp(record["mesh_phase"].values[0], phase, te)
    assert np.std(record["dte"].values[0] - found) < 0.01 * np.ptp(te)


def test_what_repeats(file: Path) -> None:
    assert cycles_to_repeat(make(file).rig) == 1
    assert cycles_to_repeat(make(file, *RELIEF).rig) == 1
    assert cycles_to_repeat(make(file, PITCH).rig) == TEETH
    wheel = make(file, PITCH, "rig.driven.teeth=18", "rig.driven.hub_radius_mm=18")
    assert cycles_to_repeat(wheel.rig) == TEETH
    assert cycles_to_repeat(make(file, "rig.driven.runout_um=1", "rig.driven.teeth=18", PITCH).rig) == 36
    assert cycles_to_repeat(make(file, "rig.driven.iso_grade=6").rig) == TEETH


def test_schedule_of_what_repeats(file: Path) -> None:
    def plan(*settings: str) -> tuple[int, int, bool]:
        case = make(file, *settings)
        found = schedule(case.experiment, case.rig)
        return found.block_periods, found.blocks, found.repeats

    assert plan() == (1, 2, True)
    assert plan(PITCH) == (2, 1, True)
    assert plan(PITCH, "experiment.periods=1") == (1, 1, False)
    # A record need not hold whole repetitions.
    assert plan(PITCH, "experiment.periods=3") == (2, 2, True)


def test_a_grade_is_drawn_the_same_way_again(file: Path) -> None:
    graded = make(file, "rig.driver.iso_grade=7", "rig.driver.iso_seed=4")
    one, two = (static(graded, positions=4, cycles=TEETH) for _ in range(2))
    np.testing.assert_array_equal(one["transmission_error"], two["transmission_error"])
    unloaded = one["transmission_error_unloaded"].values
    assert 2e-6 < np.ptp(unloaded) < 60e-6


def test_harris_map(file: Path, tmp_path: Path) -> None:
    """Load x phase, with its picture."""
    loads = np.linspace(10.0, 240.0, 12)
    case = make(file, *RELIEF, "rig.driven.tip_relief_um=10", "rig.driven.tip_relief_start_diameter_mm=43")
    found = static(case, torque=loads.tolist(), positions=64)
    assert found["transmission_error"].shape == (12, 64)
    assert np.all(np.diff(found["transmission_error"].values.mean(axis=1)) > 0)
    np.testing.assert_allclose(found["load_share"].sum("pair"), 1.0, atol=1e-9)
    for suffix in (".png", ".svg"):
        plot_static(found, tmp_path / f"map{suffix}")
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    text = (tmp_path / "map.svg").read_text(encoding="utf-8")
    assert "without load" in text and "driver torque [N m]" in text


@pytest.mark.parametrize(
    ("settings", "model", "error", "words"),
    [
        (["rig.driver.profile_slope_tooth_um=[1,0,0,0,0,0,0,0,0,0,0,0]"], "lumped", BenchError, "slope_tooth_um"),
        (["rig.driven.iso_grade=6"], "lumped", BenchError, r"rig\.driven\.iso_grade"),
        (["rig.driver.crack={tooth=1, stiffness_loss=0.2}"], "reduced", BenchError, r"represent rig\.driver\.crack"),
        (["rig.mesh.error_mean_um=1"], "reduced", BenchError, r"represent rig\.mesh\.error_mean_um"),
        ([RELIEF[0], "rig.driver.tip_relief_start_diameter_mm=60"], "reduced", GeometryError, "must lie on the invo"),
    ],
)
def test_what_a_model_cannot_represent(
    file: Path, settings: list[str], model: str, error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=words):
        static(make(file, *settings), model, positions=4)


def test_cycles_belong_to_teeth(file: Path) -> None:
    with pytest.raises(BenchError, match="cycles = 2 must be 1 for the model lumped"):
        static(make(file), "lumped", positions=4, cycles=2)
    with pytest.raises(BenchError, match="cycles = 0 must be at least 1"):
        static(make(file), positions=4, cycles=0)
    with pytest.raises(BenchError, match="x cycles = 1000 must be at most"):
        static(make(file), positions=100, cycles=1000)

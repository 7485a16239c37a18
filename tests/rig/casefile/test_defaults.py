"""What a case may leave unsaid: the values taken, the sentences on them, and what then is still refused."""

from __future__ import annotations

from pathlib import Path

import pytest

import gearbench as gb
from gearbench.bench.errors import BenchError
from gearbench.bench.plan.schedule import schedule
from gearbench.rig import CaseError

GEARS = """
[rig.driver]
teeth = 24
module_mm = 3
face_width_mm = 20
bore_radius_mm = 12
[rig.driven]
teeth = 37
module_mm = 3
face_width_mm = 18
profile_shift = 0.2
[rig.support]
stiffness_n_per_m = 1e8
"""
EXPERIMENT = """
[experiment]
mesh_frequency_hz = {mesh}
torque_mean_nm = 50
[experiment.multisine]
rms_nm = 3
band_hz = [5, 2000]
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "pair of mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_gears_alone_make_a_case(tmp_path: Path) -> None:
    case = gb.read_case(written(tmp_path, GEARS))
    assert case.name == "pair of mine" and not case.stated
    assert case.rig.driver.hub_radius == 0.012
    # Root radius of the driven gear: 3 mm (37/2 + 0.2 - 1.25).
    assert case.rig.driven.hub_radius == pytest.approx(0.6 * 3e-3 * 17.45, abs=1e-7)
    assert [line.partition(" = ")[0] for line in case.assumed] == [
        "rig.driver.hub_radius_mm",
        "rig.driven.hub_radius_mm",
    ]


@pytest.mark.parametrize(
    ("support", "said"),
    [
        ("", ["rig.support: rigid, as no stiffness_n_per_m is given"]),
        ("[rig.support]\nstiffness_n_per_m = 1e8\n", []),
        ("[rig.support.driver]\nstiffness_n_per_m = 1e8\n",
         ["rig.support.driven: rigid, as no stiffness_n_per_m is given"]),
    ],
)  # fmt: skip
def test_supports_that_are_not_given_are_said_to_be_rigid(tmp_path: Path, support: str, said: list[str]) -> None:
    gears = GEARS.partition("[rig.support]")[0]
    case = gb.read_case(written(tmp_path, f"{gears}{support}{EXPERIMENT.format(mesh=50)}"))
    assert [line for line in case.assumed if line.startswith("rig.support")] == said


def test_what_is_said_is_not_assumed(tmp_path: Path) -> None:
    text = GEARS.replace("bore_radius_mm = 12", "hub_radius_mm = 15").replace("profile_shift", "hub_radius_mm = 20\n#")
    case = gb.read_case(written(tmp_path, text))
    assert case.assumed == () and case.rig.driver.hub_radius == 0.015


def test_without_an_experiment_loads_are_asked_for_and_simulations_refused(tmp_path: Path) -> None:
    case = gb.read_case(written(tmp_path, GEARS))
    with pytest.raises(BenchError, match=r"torque_mean_nm is missing: give the load itself"):
        gb.static(case, "lumped")
    assert gb.static(case, "lumped", torque=[50.0], positions=8).sizes["phase"] == 8
    for what in (lambda: gb.simulate(case, "lumped"), lambda: gb.run(case, tmp_path / "out")):
        with pytest.raises(BenchError, match=r"experiment is missing"):
            what()
    assert not (tmp_path / "out").exists()


def test_a_dumped_case_without_an_experiment_stays_one(tmp_path: Path) -> None:
    case = gb.read_case(written(tmp_path, GEARS))
    again = tmp_path / "again.toml"
    again.write_text(gb.dump_case(case), encoding="utf-8")
    assert "[experiment]" not in again.read_text(encoding="utf-8")
    assert gb.read_case(again) == case.model_copy(update={"assumed": ()})


@pytest.mark.parametrize("mesh", [0.37, 2.0, 100.0, 333.3])
def test_sampling_follows_the_band(tmp_path: Path, mesh: float) -> None:
    case = gb.read_case(written(tmp_path, GEARS + EXPERIMENT.format(mesh=mesh)))
    plan = schedule(case.experiment, case.rig)  # refuses what holds no whole number of mesh periods
    assert plan.mesh_frequency == pytest.approx(mesh, rel=1e-9)
    assert 0.5 < plan.samples_per_period / plan.sampling_rate < 2.8
    # A quarter above twice the band, and room for 24 branches of the response above it; at most twice as much.
    least = max(2.56 * 2000, 2 * (2000 + 24 * mesh))
    assert 0.999 * least <= plan.sampling_rate < 2 * least * 1.001
    assert any("experiment.sampling_rate_hz" in line for line in case.assumed)
    assert case.experiment.realisations == 4 and any("experiment.realisations = 4" in line for line in case.assumed)


def test_realisations_are_left_alone_where_the_period_or_they_are_given(tmp_path: Path) -> None:
    text = written(tmp_path, GEARS + EXPERIMENT.format(mesh=20))
    assert gb.read_case(text, ["experiment.realisations=1"]).experiment.realisations == 1
    given = ["experiment.sampling_rate_hz=8192", "experiment.samples_per_period=8192"]
    assert gb.read_case(text, given).experiment.realisations == 1


def test_one_of_rate_and_samples_gives_the_other(tmp_path: Path) -> None:
    text = written(tmp_path, GEARS + EXPERIMENT.format(mesh=20))
    by_rate = gb.read_case(text, ["experiment.sampling_rate_hz=8192"]).experiment
    assert by_rate.samples_per_period == 8192
    by_samples = gb.read_case(text, ["experiment.samples_per_period=16384"]).experiment
    assert by_samples.sampling_rate == 16384.0


def test_speed_in_revolutions_per_minute_serves_as_well(tmp_path: Path) -> None:
    text = GEARS + EXPERIMENT.format(mesh=1).replace("mesh_frequency_hz = 1", "speed_driver_rpm = 1000")
    case = gb.read_case(written(tmp_path, text))
    assert schedule(case.experiment, case.rig).mesh_frequency == pytest.approx(400.0, rel=1e-9)


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ('rig.driver.module_mm="3"', r"rig\.driver\.module_mm"),
        ("rig.driven.teeth=0", r"rig\.driven"),
        ("experiment.mesh_frequency_hz=-1", r"experiment\.mesh_frequency_hz"),
        ("experiment.mesh_frequency_hz=nan", r"experiment\.mesh_frequency_hz"),
        ("experiment.multisine=3", r"experiment\.(sampling_rate_hz|multisine)"),
        ("experiment.multisine.band_hz=[1]", r"experiment\.(sampling_rate_hz|multisine)"),
    ],
)
def test_what_is_wrong_is_still_refused(tmp_path: Path, setting: str, words: str) -> None:
    with pytest.raises(CaseError, match=words):
        gb.read_case(written(tmp_path, GEARS + EXPERIMENT.format(mesh=20)), [setting])


def test_without_supports_the_centres_are_held(tmp_path: Path) -> None:
    text = GEARS.partition("[rig.support]")[0] + EXPERIMENT.format(mesh=100).replace("2000", "900")
    quick = ["simulation.model=lumped", "experiment.realisations=1"]
    case = gb.read_case(written(tmp_path, text), quick)
    rigid = gb.simulate(case)
    for name in ("y_driver", "y_driven"):
        assert abs(rigid[name]).max() < 1e-11
    # Springs that are a million times as stiff as teeth do the same, as far as such springs let one see.
    stiff = gb.read_case(written(tmp_path, text), [*quick, "rig.support.stiffness_n_per_m=1e12"])
    difference = (gb.simulate(stiff)["dte"] - rigid["dte"]).std() / rigid["dte"].std()
    assert difference < 1e-3


@pytest.mark.parametrize("key", ["damping_n_s_per_m=1e3", "driver.exponent=0.5", "driver.across.stiffness_n_per_m=1e8"])
def test_a_rigid_support_has_nothing_else(tmp_path: Path, key: str) -> None:
    text = GEARS.partition("[rig.support]")[0]
    with pytest.raises(CaseError, match="without it is rigid, and has no"):
        gb.read_case(written(tmp_path, text), [f"rig.support.{key}"])


def test_few_samples_shorten_the_period_rather_than_coarsen_it(tmp_path: Path) -> None:
    """At 315 Hz mesh the response reaches 24 branches above the band of 2 kHz: 8192 samples do for 0.4 s of that."""
    text = written(tmp_path, GEARS + EXPERIMENT.format(mesh=315))
    case = gb.read_case(text, ["experiment.samples_per_period=8192"])
    assert case.experiment.sampling_rate >= 2 * (2000 + 24 * 315)
    assert schedule(case.experiment, case.rig).samples_per_period == 8192
    assert any("for a band up to 2000 Hz" in line for line in case.assumed)
    # Too few for any, or a rate that was given: nothing is claimed of the band.
    for setting in ("experiment.samples_per_period=32", "experiment.sampling_rate_hz=8190"):
        assert not any("for a band" in line for line in gb.read_case(text, [setting]).assumed)

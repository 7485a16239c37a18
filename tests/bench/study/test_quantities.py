"""What a study measures of a member, against closed forms."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
import xarray as xr

from gearbench.bench import BenchError
from gearbench.bench.study import quantities
from gearbench.bench.study.quantities import QUANTITIES, Ask, at_loads, check_quantities, measure, single_column
from gearbench.cases import read_case
from gearbench.rig import Case


def static_result(cycles: int = 1, positions: int = 64) -> xr.Dataset:
    """TE 10 + 3 cos(2 pi x) + 1 cos(4 pi x + 1) um + a cycle-long wave of 5 um; stiffness 300 +- 40 N/um."""
    phase = np.arange(cycles * positions) / positions
    slow = 5 * np.cos(2 * pi * phase / cycles) if cycles > 1 else 0.0
    te = 10 + 3 * np.cos(2 * pi * phase) + np.cos(4 * pi * phase + 1) + slow
    share = np.stack([0.5 + 0.5 * (phase % 1 < 0.25), 0.5 - 0.5 * (phase % 1 < 0.25)], axis=1)
    values = {
        "transmission_error": (("load", "phase"), 1e-6 * te[None]),
        "stiffness_tangent": (("load", "phase"), 1e6 * (300 + 40 * np.sin(2 * pi * phase))[None]),
        "load_share": (("load", "phase", "pair"), share[None]),
    }
    return xr.Dataset(values, attrs={"mesh_cycles": cycles, "warnings": "teeth touch behind"})


def case(*settings: str) -> Case:
    return read_case("quick_lumped", settings)


@pytest.mark.parametrize("cycles", [1, 4])
def test_static_numbers_of_known_waves(cycles: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(quantities._STAGES, "static", lambda case, ask: static_result(cycles))
    names = ("te-mean", "te-orders", "stiffness-mean", "stiffness-amplitude", "load-share")
    numbers, warnings = measure(case(), Ask(names))
    assert numbers == pytest.approx(
        {
            "te_mean_um": 10.0,
            "te_order_1_um": 3.0,
            "te_order_2_um": 1.0,
            "te_order_3_um": 0.0,
            "stiffness_mean_n_per_um": 300.0,
            "stiffness_amplitude_n_per_um": 40.0,
            "load_share": 0.625,
        },
        abs=1e-9,
    )
    assert warnings == ["teeth touch behind"]


def test_one_solution_serves_all_that_need_it(monkeypatch: pytest.MonkeyPatch) -> None:
    solved = []
    monkeypatch.setitem(quantities._STAGES, "static", lambda case, ask: solved.append(1) or static_result())
    measure(case(), Ask(("te-mean", "te-peak-to-peak", "stiffness-mean")))
    assert solved == [1]


def test_the_first_mode_of_one_inertia_on_one_spring() -> None:
    """Both gears turn freely on supports that hardly give: f = sqrt(k / m) / 2 pi, 1 / m = r^2 / J1 + r^2 / J2."""
    stiff = ["rig.support.stiffness_n_per_m=1e14", "rig.support.damping_n_s_per_m=0", "rig.damping.mesh_ratio=0"]
    steps = ["simulation.stiffness_single_n_per_m=2e8", "simulation.stiffness_double_n_per_m=3e8"]
    one = case(*stiff, "simulation.mesh_stiffness=rectangular", *steps)
    from gearbench.bench.record.attributes import turning_inertias
    from gearbench.geometry import pair

    meshing = pair(one.rig)
    inertias = turning_inertias(one.rig, meshing)
    radii = meshing.driver.base_radius, meshing.driven.base_radius
    flexible = sum(r**2 / j for r, j in zip(radii, inertias, strict=True))
    numbers, _ = measure(one, Ask(("first-mode",)))
    assert list(numbers.values()) == pytest.approx([np.sqrt(k * flexible) / (2 * pi) for k in (2e8, 3e8)], rel=1e-4)


def test_iso_numbers_are_those_of_the_standard() -> None:
    """c_gamma = c' (0.75 eps + 0.25) (ISO 6336-1, 9.3.3); K_v = 1 + N K below resonance is near 1 at 20 Hz mesh."""
    from gearbench.geometry import pair
    from gearbench.lumped.stiffness.iso6336 import iso_stiffness

    one = case()
    numbers, _ = measure(one, Ask(("iso-c-gamma", "iso-kv"), torque=200.0))
    meshing = pair(one.rig)
    single = iso_stiffness(one.rig, meshing, 200.0 / meshing.driver.base_radius).single
    assert numbers["iso_c_gamma_n_per_mm_um"] == pytest.approx(single * (0.75 * meshing.contact_ratio + 0.25))
    assert 1.0 < numbers["iso_dynamic_factor"] < 1.01


def test_errors_that_a_grade_draws_raise_kv() -> None:
    fast = "experiment.mesh_frequency_hz=2000"
    exact, coarse = (measure(case(fast, *more), Ask(("iso-kv",)))[0] for more in ([], ["rig.driver.iso_grade=9"]))
    assert coarse["iso_dynamic_factor"] > exact["iso_dynamic_factor"] + 0.02


def test_a_sweep_draws_the_same_errors() -> None:
    """What a grade draws, written into the case key by key, gives the same K_v."""
    from gearbench.bench.sweep import iso_factors
    from gearbench.geometry.tooth.iso1328 import drawn_gear

    graded = case("rig.driver.iso_grade=9")
    driver = drawn_gear(graded.rig.driver)
    assert driver.iso_grade is None and driver.profile_form
    given = graded.model_copy(update={"rig": graded.rig.model_copy(update={"driver": driver})})
    speeds = np.array([100.0, 200.0])
    assert iso_factors(graded, speeds)[0] == pytest.approx(iso_factors(given, speeds)[0], rel=1e-12)
    assert iso_factors(graded, speeds)[0][1] > iso_factors(case(), speeds)[0][1] + 1e-4


def test_static_loads_are_solved_together_and_alike() -> None:
    loads = (50.0, 100.0, 200.0)
    together = at_loads(case(), loads, "te-mean", "te_mean_um", Ask(()))
    alone = [measure(case(), Ask(("te-mean",), torque=load))[0]["te_mean_um"] for load in loads]
    assert together == pytest.approx(alone, rel=1e-12)
    assert together[2] == pytest.approx(4 * together[0])  # a linear mesh


def test_the_simulated_record_is_the_cases_own() -> None:
    from gearbench.bench import simulate

    short = ["experiment.realisations=1", "experiment.samples_per_period=2048", "experiment.sampling_rate_hz=8192"]
    one = case(*short, "experiment.multisine.band_hz=[4,2500]", "identification.band_hz=[4,2500]")
    numbers, _ = measure(one, Ask(("dte-rms", "dte-peak-to-peak")))
    dte = 1e6 * simulate(one)["dte"].values
    assert numbers == {"dte_rms_um": float(dte.std()), "dte_peak_to_peak_um": float(np.ptp(dte))}


def test_what_a_model_lacks_is_said() -> None:
    with pytest.raises(BenchError, match="load-share needs tooth pairs"):
        measure(case(), Ask(("load-share",)))
    with pytest.raises(BenchError, match="cannot be swept"):
        measure(case(), Ask(("dynamic-factor",)))


def test_names_are_known_or_refused() -> None:
    assert check_quantities([]) == ("te-peak-to-peak",)
    assert check_quantities(["te-mean", "te-mean"]) == ("te-mean",)
    with pytest.raises(BenchError, match="did you mean te-mean"):
        check_quantities(["te-meen"])
    assert single_column("te_order_2_um")[0] == "te-orders"
    with pytest.raises(BenchError, match="name one of te_order_1_um"):
        single_column("te-orders")


def test_every_column_has_one_name_and_carries_its_unit() -> None:
    columns = [column for quantity in QUANTITIES.values() for column in quantity.columns]
    assert len({column.name for column in columns}) == len(columns)
    suffix = {"um": "_um", "Hz": "_hz", "N/um": "_n_per_um", "N/(mm um)": "_n_per_mm_um", "1": "", "%": "_percent"}
    assert all(column.name.endswith(suffix[column.unit]) for column in columns)

"""Simulated records against harmonic balance, the definitions of their channels and the refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from gearbench.bench import BenchError, simulate
from gearbench.bench.plan.excitation import torque_realisation
from gearbench.bench.results.exact import lumped_periodic_system
from gearbench.geometry import pair
from gearbench.identification.truth.harmonic_balance import harmonic_balance_itf
from gearbench.identification.truth.monodromy import exact_itf
from gearbench.identification.truth.periodic import frozen_itf
from gearbench.lumped import LumpedError, lumped_model
from gearbench.records import read_record, validate_record, write_record
from gearbench.rig import Case, Damping, Experiment, Gear, Load, Multisine, Rig, Simulation, Support, Supports


def make_case(boundary: str = "torque", simulation: dict[str, Any] | None = None, **experiment: Any) -> Case:
    gear = {"module": 2e-3, "face_width": 0.02, "hub_radius": 0.015}
    values: dict[str, Any] = {
        "mesh_frequency": 64.0,
        "torque_mean": 100.0,
        "sampling_rate": 8192.0,
        "samples_per_period": 1024,
        "periods": 2,
        "realisations": 2,
        "seed": 11,
        "settling_tolerance": 1e-6,
        "settling_periods_max": 8,
        "multisine": Multisine(amplitude=20.0, band=(8.0, 2500.0), crest=2.2),
    }
    supports = Supports(
        driver=Support(stiffness=3e8, damping=2e3), driven=Support(stiffness=5e8, damping=3e3)
    )
    return Case(
        name="test",
        rig=Rig(
            driver=Gear(teeth=62, mass=3.0, inertia=6e-3, **gear),
            driven=Gear(teeth=40, mass=2.0, inertia=3e-3, **gear),
            support=supports,
            load=Load(boundary=boundary),
            damping=Damping(mesh_ratio=0.06),
        ),
        experiment=Experiment(**{**values, **experiment}),
        simulation=Simulation(model="lumped", **{"stiffness_edge": 0.1, **(simulation or {})}),
    )


@pytest.fixture(scope="module")
def case() -> Case:
    return make_case()


@pytest.fixture(scope="module")
def record(case: Case) -> xr.Dataset:
    return simulate(case)


def steady_response(case: Case, realisation: int) -> np.ndarray:
    """DTE over one period in the frequency domain: every line of the force times its exact ITF."""
    plan = case.experiment
    samples = plan.samples_per_period
    cycles = round(plan.mesh_frequency_for(62) * samples / plan.sampling_rate)
    number = np.arange(samples)
    kept, place = np.unique(number * cycles % samples, return_inverse=True)
    torque = torque_realisation(plan, realisation, case.rig)
    assert torque.signal is not None
    lines = np.array([0, *torque.signal.lines])
    force = np.array([torque.mean, *torque.signal.spectrum]) / pair(case.rig).driver.base_radius
    system = lumped_periodic_system(case)
    itf = exact_itf(system, lines / torque.signal.period, kept / samples, steps=system.phases)
    turn = np.exp(2j * np.pi * np.outer(lines, number) / samples)
    return np.einsum("k,kn,kn->n", force, itf[:, place], turn).real


def test_record_agrees_with_the_exact_transfer_function(case: Case, record: xr.Dataset) -> None:
    expected = steady_response(case, 1)
    found = record["dte"].values[1]
    assert np.linalg.norm(found - expected) < 2e-4 * np.linalg.norm(expected - expected.mean())


def test_more_substeps_converge_to_the_exact_response() -> None:
    case = make_case(simulation={"substeps": 24}, realisations=1)
    expected = steady_response(case, 0)
    found = simulate(case)["dte"].values[0]
    assert np.linalg.norm(found - expected) < 3e-6 * np.linalg.norm(expected - expected.mean())


def test_exact_transfer_function_is_confirmed_by_harmonic_balance_and_is_not_the_frozen_one(
    case: Case,
) -> None:
    # At 64 Hz mesh frequency the frozen transfer function is far off: the tests above can tell.
    frequency, phase = np.linspace(200, 2500, 12), np.arange(64) / 64
    system = lumped_periodic_system(case)
    # The default step follows the fastest mode alone; a fast mesh would have it stride over the switches.
    exact = exact_itf(system, frequency, phase, steps=system.phases)
    frozen = frozen_itf(system, frequency, phase)
    other = harmonic_balance_itf(system, frequency, phase, harmonics=160)
    assert np.linalg.norm(exact - other) < 1e-5 * np.linalg.norm(exact)
    assert np.linalg.norm(frozen - exact) > 0.05 * np.linalg.norm(exact)


def test_record_is_complete_and_survives_a_file(record: xr.Dataset, tmp_path: Any) -> None:
    validate_record(record)
    wanted = {"torque_driver", "torque_driven", "angle_driver", "angle_driven", "y_driver", "y_driven"}
    assert wanted | {"mesh_phase", "dte", "force"} == set(record.data_vars)
    assert record.sizes == {"realisation": 2, "time": 1024}
    assert (record.attrs["periods"], record.attrs["periods_averaged"]) == (1, 2)
    assert record.attrs["settling_residual"] <= 1e-6
    assert record.attrs["mesh_period"] == pytest.approx(1 / 64)
    write_record(record, tmp_path / "record.nc")
    xr.testing.assert_identical(read_record(tmp_path / "record.nc"), record)


@pytest.mark.parametrize("boundary", ["torque", "speed"])
@pytest.mark.parametrize("direction", ["tangential", "line-of-action"])
def test_dte_and_force_follow_from_the_other_channels(boundary: str, direction: str) -> None:
    """The definitions of dte and F, from angles, torques and attributes alone."""
    base = make_case(boundary, realisations=1)
    support = base.rig.support.model_copy(update={"direction": direction})
    case = base.model_copy(update={"rig": base.rig.model_copy(update={"support": support})})
    record = simulate(case)
    about = record.attrs
    r1, r2 = about["base_radius_driver"], about["base_radius_driven"]
    j1, j2 = about["inertia_driver"], about["inertia_driven"]
    factor = np.cos(about["working_pressure_angle"]) if direction == "tangential" else 1.0
    dte = r1 * record["angle_driver"] - r2 * record["angle_driven"]
    dte = dte + factor * (record["y_driver"] - record["y_driven"])
    np.testing.assert_allclose(record["dte"], dte, atol=1e-14)
    force = record["torque_driver"] / r1
    if boundary == "torque":
        mass = j1 * j2 / (j1 * r2**2 + j2 * r1**2)
        force = mass * (r1 * record["torque_driver"] / j1 + r2 * record["torque_driven"] / j2)
    np.testing.assert_allclose(record["force"], force, rtol=1e-12)


def test_prescribed_speed_holds_and_takes_the_reaction_moment() -> None:
    case = make_case("speed", realisations=1)
    record = simulate(case)
    time = record["time"].values
    speed = 2 * np.pi * 64.0 / 40
    np.testing.assert_allclose(record["angle_driven"].values[0], speed * time, atol=1e-12)
    torque = record["torque_driven"].values[0]
    ratio = record.attrs["base_radius_driven"] / record.attrs["base_radius_driver"]
    assert torque.mean() == pytest.approx(100.0 * ratio, rel=1e-4)
    # The driver's own balance: J1 theta1'' = T1 - rb1 Fm, and Fm = torque_driven / rb2.
    lines = 2j * np.pi * np.fft.fftfreq(1024, 1 / 8192.0)
    departure = record["angle_driver"].values[0] - 2 * np.pi * 64.0 / 62 * time
    acceleration = np.fft.ifft(lines**2 * np.fft.fft(departure)).real
    balance = record["torque_driver"].values[0] - torque / ratio - 6e-3 * acceleration
    assert np.abs(balance).max() < 0.02 * np.abs(torque / ratio - 100.0).max()


def test_balancing_torques_keep_the_mean_speed(record: xr.Dataset) -> None:
    np.testing.assert_allclose(record["torque_driven"], record["torque_driver"] * 40 / 62, rtol=1e-12)
    time = record["time"].values
    swing = [
        record[f"angle_{side}"].values - 2 * np.pi * 64.0 / teeth * time
        for side, teeth in (("driver", 62), ("driven", 40))
    ]
    # With T1/r1 = T2/r2 nothing turns both gears the same way: J1 theta1/r1 + J2 theta2/r2 is steady.
    r1, r2 = record.attrs["base_radius_driver"], record.attrs["base_radius_driven"]
    np.testing.assert_allclose(6e-3 * swing[0] / r1, -3e-3 * swing[1] / r2, rtol=1e-6, atol=1e-12)
    assert swing[0].mean() > 0


def test_mesh_phase_is_that_of_the_geometry(record: xr.Dataset, case: Case) -> None:
    phase = record["mesh_phase"].values
    np.testing.assert_allclose(phase[0], 64.0 * record["time"].values, atol=1e-12)
    np.testing.assert_array_equal(phase[0], phase[1])
    assert record.attrs["mesh_phase_origin"] == "geometry"
    # The record shows k(phase) of the geometry: at constant torque and low speed dte = F / k.
    slow = make_case(multisine=None, realisations=1, mesh_frequency=2.0, samples_per_period=4096, periods=1)
    still = simulate(slow)
    model = lumped_model(slow.rig, pair(slow.rig), slow.simulation)
    expected = still["force"].values[0] / model.stiffness.at(still["mesh_phase"].values[0])
    dte = still["dte"].values[0]
    assert np.abs(dte - expected).max() < 0.05 * np.ptp(expected)


def test_result_does_not_depend_on_the_number_of_realisations(record: xr.Dataset) -> None:
    alone = simulate(make_case(realisations=1))
    np.testing.assert_array_equal(alone["dte"].values[0], record["dte"].values[0])


def test_mesh_and_excitation_that_repeat_together_after_two_periods() -> None:
    # 64.0 -> 60 Hz: 7.5 mesh periods a period of 1/8 s, so blocks of two periods and two of them.
    case = make_case(mesh_frequency=60.0, periods=4, realisations=1)
    record = simulate(case)
    assert (record.attrs["periods"], record.attrs["periods_averaged"]) == (2, 2)
    torque = record["torque_driver"].values[0]
    np.testing.assert_allclose(torque[:1024], torque[1024:], rtol=1e-12)
    dte = record["dte"].values[0]
    assert np.abs(dte[:1024] - dte[1024:]).max() > 0.05 * dte.std()


def test_scatter_of_the_periods_is_reported() -> None:
    # A loose tolerance accepts a run that has not settled: its periods differ, the record says how much.
    loose = {"settling_tolerance": 0.9, "samples_per_period": 128, "mesh_frequency": 64.0, "periods": 4}
    case = make_case(
        realisations=1, **{**loose, "multisine": Multisine(rms=8.0, band=(64.0, 2500.0), crest=2.2)}
    )
    record = simulate(case)
    assert record["y_driver"].attrs["period_scatter"] > 1e-6 * record["y_driver"].values.std()
    settled = simulate(make_case(realisations=1))
    assert settled["y_driver"].attrs["period_scatter"] < 1e-6 * settled["y_driver"].values.std()


def test_failing_to_settle_is_one_sentence() -> None:
    with pytest.raises(BenchError, match=r"no steady state: after 2 excitation periods .* limits to 1e-12"):
        simulate(
            make_case(
                settling_tolerance=1e-12, settling_periods_max=1, samples_per_period=128, mesh_frequency=64.0
            )
        )


def test_bad_requests_are_refused() -> None:
    with pytest.raises(BenchError, match=r"mesh periods at 63\.7 Hz, which must be a whole number"):
        simulate(make_case(mesh_frequency=63.7))
    with pytest.raises(LumpedError, match=r"substeps = 1 is too coarse .*: at least"):
        simulate(make_case(simulation={"substeps": 1}))
    with pytest.raises(BenchError, match=r"simulation\.model = 'magic' is not one of lumped"):
        simulate(make_case(), "magic")


def test_progress_runs_from_the_first_to_the_last_realisation() -> None:
    seen: list[float] = []
    simulate(make_case(samples_per_period=128, realisations=5), progress=lambda part, _: seen.append(part))
    assert seen == sorted(seen)
    assert seen[0] == 0.0 and seen[-1] == 1.0
    assert len(set(seen)) > 5  # within the realisations too

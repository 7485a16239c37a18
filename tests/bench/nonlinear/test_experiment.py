"""Whole experiments on the non-linear model: neutral effects change no byte, others change what they should."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from shared.small_case import small_case

from gearbench.bench import BenchError, simulate
from gearbench.bench.nonlinear.law_table import mesh_law
from gearbench.bench.plan.schedule import cycles_to_repeat
from gearbench.bench.statics import static
from gearbench.rig import (
    Across,
    Case,
    Coupling,
    Crack,
    Damping,
    Drive,
    Friction,
    Housing,
    Load,
    MeshCorrection,
    OutputShaft,
    Ripple,
    Sensors,
    Support,
    Supports,
)

SAMPLES = 1536
RATE = 5120.0


def make_case(
    driver: dict[str, Any] | None = None,
    driven: dict[str, Any] | None = None,
    experiment: dict[str, Any] | None = None,
    simulation: dict[str, Any] | None = None,
    **rig: Any,
) -> Case:
    values: dict[str, Any] = {"damping": Damping(mesh_ratio=0.06), **rig}
    return small_case({"inertia": 1.5e-3} | (driver or {}), driven, experiment, simulation, **values)


def supports(**driver: Any) -> Supports:
    plain = {"stiffness": 1e8, "damping": 3e3}
    return Supports(driver=Support(**plain, **driver), driven=Support(**plain))


# Every effect at its neutral value, given explicitly.
NEUTRAL: dict[str, dict[str, Any]] = {
    "pitch error": {"driver": {"pitch_error": (0.0,) * 20}, "driven": {"pitch_error": (0.0,) * 30}},
    "run-out": {"driver": {"runout": 0.0, "runout_phase": 1.0}, "driven": {"runout": 0.0, "runout_phase": 2.0}},
    "crack": {"driver": {"crack": Crack(tooth=3, stiffness_loss=0.0)}},
    "support": {"support": supports(exponent=0.0, reference_deflection=3e-6)},
    "coupling": {"drive": Drive(coupling=None)},
    "ripple": {"drive": Drive(ripple=Ripple(orders=(6, 12), amplitude=(0.0, 0.0), phase=(1.0, 2.0)))},
    "friction": {"friction": Friction(coefficient=0.0, transition_speed=1e-3)},
    "delay": {"sensors": Sensors(delay_angle_driver=0.0, delay_torque_driven=0.0)},
    "noise": {"sensors": Sensors(noise_angle=0.0, noise_displacement=0.0, noise_torque=0.0)},
    "mesh scale": {"mesh": MeshCorrection(stiffness_scale=1.0, stiffness_cos=(0.0, 0.0), stiffness_sin=(0.0, 0.0))},
    "mesh error": {"mesh": MeshCorrection(error_mean=0.0, error_cos=(0.0,), error_sin=(0.0,))},
    "drift": {"mesh": MeshCorrection(stiffness_drift=0.0)},
    "exponent": {"mesh": MeshCorrection(exponent=0.0, reference_force=123.0)},
    "load shaft": {"load": Load(coupling=OutputShaft(inertia=0.02))},
    "across and housing": {"support": supports(across=None), "housing": None},
    "gain": {"sensors": Sensors(gain_torque_driver=1.0, gain_torque_driven=1.0)},
    "filter": {"sensors": Sensors(filter=None)},
    "encoder run-out": {"sensors": Sensors(encoder_runout_driver=0.0, encoder_runout_driver_phase=1.0)},
    "quantisation": {
        "sensors": Sensors(quantisation_angle=0.0, quantisation_displacement=0.0, quantisation_torque=0.0)
    },
}

# Every effect at work, and the smallest relative change of the DTE that it makes here.
EFFECTS: dict[str, tuple[dict[str, Any], float]] = {
    "pitch error": ({"driver": {"pitch_error": (3e-6, *(0.0,) * 19)}}, 0.02),
    "run-out": ({"driven": {"runout": 5e-6}}, 0.1),
    "crack": ({"driver": {"crack": Crack(tooth=3, stiffness_loss=0.4)}}, 0.005),
    "support": ({"support": supports(exponent=0.35)}, 0.005),
    "elastic coupling": ({"drive": Drive(coupling=Coupling(inertia=2e-3, stiffness=1e5))}, 0.02),
    "rigid coupling": ({"drive": Drive(coupling=Coupling(inertia=2e-3))}, 0.02),
    "ripple": ({"drive": Drive(ripple=Ripple(orders=(6,), amplitude=(1.0,), phase=(0.0,)))}, 0.01),
    "friction": ({"friction": Friction(coefficient=0.06)}, 0.01),
    "delay": ({"sensors": Sensors(delay_angle_driver=50e-6)}, 1e-3),
    "noise": ({"sensors": Sensors(noise_angle=1e-6)}, 1e-3),
    "mesh scale": ({"mesh": MeshCorrection(stiffness_scale=1.05)}, 0.02),
    "mesh shape": ({"mesh": MeshCorrection(stiffness_cos=(0.05,), stiffness_sin=(0.0,))}, 0.005),
    "mesh error": ({"mesh": MeshCorrection(error_mean=1e-6)}, 0.02),
    "drift": ({"mesh": MeshCorrection(stiffness_drift=0.05)}, 0.01),
    "exponent": ({"mesh": MeshCorrection(exponent=0.1, reference_force=123.0)}, 0.01),
    "load shaft": ({"load": Load(coupling=OutputShaft(stiffness=1e5))}, 0.05),
    "housing": ({"housing": Housing(mass=20.0, stiffness=1e9, damping=1e3)}, 0.002),
    "rocking housing": ({"housing": Housing(mass=20.0, stiffness=1e9, damping=1e3, driven_share=-1.0)}, 0.05),
    "across": ({"support": supports(across=Across(stiffness=1e8, damping=1e3))}, 0.02),
    "free load": ({"load": Load(boundary="inertia")}, 0.02),
    "filter delay": ({"sensors": Sensors(filter=2000.0)}, 1e-3),
    "encoder run-out": ({"sensors": Sensors(encoder_runout_driven=20e-6)}, 0.05),
    "quantisation noise": ({"sensors": Sensors(quantisation_angle=1e-5)}, 1e-3),
}


def same(one: xr.Dataset, other: xr.Dataset) -> bool:
    """Whether two records agree byte for byte, provenance (which quotes the case) apart."""
    if set(one.data_vars) != set(other.data_vars):
        return False
    attributes = [{k: v for k, v in record.attrs.items() if k != "provenance"} for record in (one, other)]
    channels = all(one[name].values.tobytes() == other[name].values.tobytes() for name in one.data_vars)
    return channels and attributes[0] == attributes[1]


@pytest.fixture(scope="module")
def linear() -> xr.Dataset:
    return simulate(make_case())


# A rig that has one effect runs on the non-linear model: another neutral one must not be seen there either.
SCALED = {"mesh": MeshCorrection(stiffness_scale=1.05)}
NOISY = {"sensors": Sensors(noise_angle=1e-6)}


@pytest.fixture(scope="module")
def scaled() -> xr.Dataset:
    return simulate(make_case(**SCALED))


@pytest.fixture(scope="module")
def noisy() -> xr.Dataset:
    return simulate(make_case(**NOISY))


@pytest.mark.parametrize("effect", NEUTRAL)
def test_a_neutral_effect_changes_no_byte(
    effect: str, linear: xr.Dataset, scaled: xr.Dataset, noisy: xr.Dataset
) -> None:
    values = NEUTRAL[effect]
    found = simulate(make_case(**values))
    assert "mesh" not in found.attrs
    assert same(found, linear)
    base, expected = (NOISY, noisy) if "mesh" in values else (SCALED, scaled)
    assert expected.attrs["mesh"] == "non-linear"
    assert same(simulate(make_case(**{**base, **values})), expected)


@pytest.mark.parametrize("effect", EFFECTS)
def test_every_effect_changes_the_record(effect: str, linear: xr.Dataset) -> None:
    values, least = EFFECTS[effect]
    found = simulate(make_case(**values))
    assert found.attrs["mesh"] == "non-linear"
    before = np.tile(linear["dte"].values[0], 2)[: found.sizes["time"]]
    assert (
        np.std(found["dte"].values[0] - before) + abs(found["dte"].values.mean() - before.mean()) > least * before.std()
    )
    if "delay" not in effect and "noise" not in effect:
        # What is commanded does not depend on the rig.
        np.testing.assert_allclose(
            found["torque_driver"].values[0, :SAMPLES], linear["torque_driver"].values[0, :SAMPLES]
        )


def test_with_hardly_any_effect_it_is_the_linear_experiment() -> None:
    # Along the line of action: there the linear model's fixed phase is that of the mesh.
    support = Support(stiffness=1e8, damping=3e3)
    held = Supports(driver=support, driven=support, direction="line-of-action")
    linear = simulate(make_case(support=held))
    nearly = simulate(make_case(support=held, mesh=MeshCorrection(stiffness_scale=1.0 + 1e-12)))
    for name in ("dte", "y_driver", "y_driven", "torque_driven"):
        before = linear[name].values[0]
        after = nearly[name].values[0].reshape(-1, before.size)
        assert np.abs(after - before).max() < 5e-3 * np.ptp(before), name
    np.testing.assert_allclose(nearly["angle_driven"].values[0][:SAMPLES], linear["angle_driven"].values[0][:SAMPLES])


def test_a_record_keeps_all_periods_and_its_noise_differs_between_them() -> None:
    record = simulate(make_case(sensors=Sensors(noise_displacement=1e-8)))
    assert (record.attrs["periods"], record.sizes["time"]) == (2, 2 * SAMPLES)
    assert "periods_averaged" not in record.attrs
    y = record["y_driver"].values.reshape(2, SAMPLES)
    assert (y[0] - y[1]).std() == pytest.approx(np.sqrt(2) * 1e-8, rel=0.1)
    angle = record["angle_driven"].values[0]
    np.testing.assert_allclose(angle, 2 * np.pi * 200 / 30 * record["time"].values, rtol=1e-12)
    np.testing.assert_allclose(record["mesh_phase"].values[0], 200.0 * record["time"].values, atol=1e-9)


def test_dte_and_force_are_those_of_the_measured_channels() -> None:
    sensors = Sensors(noise_angle=1e-6, noise_displacement=1e-8, noise_torque=0.1, delay_y_driver=40e-6)
    record = simulate(make_case(sensors=sensors))
    r1, r2 = record.attrs["base_radius_driver"], record.attrs["base_radius_driven"]
    turned = r1 * record["angle_driver"].values - r2 * record["angle_driven"].values
    y = record["y_driver"].values - record["y_driven"].values
    expected = turned + np.cos(record.attrs["working_pressure_angle"]) * y
    np.testing.assert_allclose(record["dte"].values, expected, atol=1e-12)
    np.testing.assert_allclose(record["force"].values, record["torque_driver"].values / r1, rtol=1e-14)


def test_ripple_is_not_in_the_torque_channel_but_in_the_reaction() -> None:
    ripple = Drive(ripple=Ripple(orders=(6,), amplitude=(2.0,), phase=(0.0,)))
    constant = {"multisine": None}
    record = simulate(make_case(drive=ripple, experiment=constant))
    np.testing.assert_array_equal(record["torque_driver"].values, 100.0)
    spectrum = np.abs(np.fft.rfft(record["torque_driven"].values[0])) * 2 / record.sizes["time"]
    line = 6 * 3 * 2  # of the shaft's order 6 in two hunting periods of three rotations: 60 Hz
    assert spectrum[line] == pytest.approx(3.0, rel=0.05)
    assert np.argmax(spectrum[1:200]) + 1 == line


def test_delayed_angle_is_the_angle_before() -> None:
    plain, late = (simulate(make_case(sensors=Sensors(delay_angle_driver=d, noise_torque=1e-9))) for d in (0.0, 60e-6))
    change = late["angle_driver"].values[0] - plain["angle_driver"].values[0]
    speed = 2 * np.pi * 200 / 20
    assert change.mean() == pytest.approx(-speed * 60e-6, rel=1e-6)
    swing = plain["angle_driver"].values[0] - speed * plain["time"].values
    ratio = np.fft.rfft(change + swing - change.mean())[1:-1] / np.fft.rfft(swing)[1:-1]
    strong = np.abs(np.fft.rfft(swing)[1:-1]) > 1e-9 * swing.size * np.ptp(swing)
    frequency = np.fft.rfftfreq(swing.size, 1 / RATE)[1:-1]
    np.testing.assert_allclose(ratio[strong], np.exp(-2j * np.pi * frequency * 60e-6)[strong], atol=1e-4)
    np.testing.assert_array_equal(late["y_driver"].values, plain["y_driver"].values)


def test_lost_contact_is_said() -> None:
    record = simulate(
        make_case(
            mesh=MeshCorrection(stiffness_scale=1.01), experiment={"torque_mean": 15.0, "settling_periods_max": 9}
        )
    )
    assert record.attrs["contact_lost_samples"] > 0
    assert "out of contact" in record.attrs["warnings"]
    assert record["torque_driven"].values.min() <= 0.0


@pytest.mark.parametrize(
    ("values", "cycles"),
    [
        ({}, 1),
        ({"driver": {"runout": 1e-6}}, 20),
        ({"driven": {"runout": 1e-6}}, 30),
        ({"driver": {"pitch_error": (1e-6,) * 20}}, 1),
        ({"driver": {"pitch_error": (1e-6, *(0.0,) * 19)}, "driven": {"runout": 1e-6}}, 60),
        ({"driven": {"crack": Crack(tooth=2, stiffness_loss=0.1)}}, 30),
        ({"drive": Drive(ripple=Ripple(orders=(1,), amplitude=(1.0,), phase=(0.0,)))}, 20),
        ({"sensors": Sensors(encoder_runout_driven=1e-6)}, 30),
    ],
)
def test_after_how_many_teeth_a_rig_repeats(values: dict[str, Any], cycles: int) -> None:
    assert cycles_to_repeat(make_case(**values).rig) == cycles


def test_records_longer_and_shorter_than_what_repeats() -> None:
    # 8 teeth a period: the driver's 20 take five periods of two.
    short = {"samples_per_period": 1024, "sampling_rate": 25600.0, "multisine": None, "settling_periods_max": 100}
    long = simulate(make_case(driver={"runout": 6e-6}, experiment={**short, "periods": 10}))
    part = simulate(make_case(driver={"runout": 6e-6}, experiment={**short, "periods": 2}))
    assert long.attrs["settling_residual"] < 1e-3
    np.testing.assert_allclose(part["dte"].values[0], long["dte"].values[0, :2048], atol=1e-3 * 6e-6)
    turned = long["dte"].values[0].reshape(2, -1)
    assert np.abs(turned[0] - turned[1]).max() < 1e-3 * np.ptp(turned)
    with pytest.raises(BenchError, match=r"no steady state: free vibrations take \d+ excitation periods"):
        hasty = {"settling_periods_max": 1, "settling_tolerance": 1e-12}
        simulate(make_case(driver={"runout": 6e-6}, experiment={**short, "periods": 2, **hasty}))
    with pytest.raises(BenchError, match="needs a record that repeats"):
        sensors = Sensors(delay_y_driver=1e-5)
        simulate(make_case(driver={"runout": 6e-6}, sensors=sensors, experiment=short))


def test_many_realisations_are_those_of_one() -> None:
    rig = {"sensors": Sensors(noise_torque=0.1)}
    both = simulate(make_case(**rig, experiment={"realisations": 2}))
    alone = simulate(make_case(**rig))
    np.testing.assert_array_equal(both["dte"].values[0], alone["dte"].values[0])
    assert not np.array_equal(both["torque_driver"].values[0], both["torque_driver"].values[1])


def test_a_rig_at_rest_shows_its_errors() -> None:
    plain = static(make_case(), torque=[100.0], positions=32)
    rig = make_case(mesh=MeshCorrection(error_mean=3e-6, stiffness_scale=0.8))
    found = static(rig, torque=[100.0], positions=32)
    expected = plain["transmission_error"].values / 0.8 - 3e-6
    np.testing.assert_allclose(found["transmission_error"].values, expected, atol=2e-8)
    again = static(rig, dte=[5e-6], positions=32)
    stiffness = 0.8 * plain["stiffness_tangent"].values
    np.testing.assert_allclose(again["stiffness_tangent"].values, stiffness, rtol=5e-3)
    np.testing.assert_allclose(again["torque"].values, stiffness * 8e-6 * found.attrs["base_radius_driver"], rtol=5e-3)


SEEN = {name for name, (fields, _) in EFFECTS.items() if "sensors" in fields}


@pytest.mark.parametrize("effect", sorted(EFFECTS.keys() - {"pitch error", "run-out"} - SEEN))
def test_finite_elements_refuse_what_they_do_not_represent(effect: str) -> None:
    """In motion only a crack that is a number, at rest also the corrections of the mesh."""
    case = make_case(**EFFECTS[effect][0])
    if {"driver", "driven"} & set(EFFECTS[effect][0]):
        with pytest.raises(BenchError, match=r"element model does not represent rig\.[a-z_.]+: (leave|give)"):
            simulate(case, "reduced")
    if {"driver", "driven", "mesh"} & set(EFFECTS[effect][0]):
        with pytest.raises(BenchError, match="static finite-element solution does not represent"):
            static(case, "reduced")


def test_an_effect_that_no_lumped_model_knows_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    found = ("rig.friction.coefficient", "rig.driver.new_um")
    monkeypatch.setattr("gearbench.bench.refusals.effects.effects_in", lambda rig: found)
    with pytest.raises(BenchError, match=r"the lumped model does not represent rig\.driver\.new_um: leave"):
        simulate(make_case())
    with pytest.raises(BenchError, match=r"the lumped model does not represent rig\.driver\.new_um: leave"):
        static(make_case())


def test_tables_made_in_pieces_give_the_same_record(monkeypatch: pytest.MonkeyPatch) -> None:
    case = make_case(driver={"runout": 5e-6, "crack": Crack(tooth=3, stiffness_loss=0.4)})
    whole = simulate(case)
    monkeypatch.setattr("gearbench.bench.nonlinear.run.MOST_ENTRIES", 5000)
    pieces = simulate(case)
    for name in ("dte", "y_driver", "torque_driven"):
        scale = np.ptp(whole[name].values)
        np.testing.assert_allclose(pieces[name].values, whole[name].values, atol=1e-6 * scale, err_msg=name)


@pytest.mark.parametrize("transition", [1e-3, 0.2])
def test_friction_is_paid_for_in_the_reaction(transition: float) -> None:
    mu = 0.06
    case = make_case(friction=Friction(coefficient=mu, transition_speed=transition), experiment={"multisine": None})
    record = simulate(case)
    r1, r2 = record.attrs["base_radius_driver"], record.attrs["base_radius_driven"]
    lost = 1 - record["torque_driven"].values.mean() * r1 / r2 / 100.0
    law = mesh_law(case.rig, case.simulation, 300.0)
    phase = np.arange(2000) / 2000
    numbers, share = law.pairs(phase)
    path = (phase[:, None] - numbers) * law.base_pitch
    speeds = 2 * np.pi * (1 / case.rig.driver.teeth + 1 / case.rig.driven.teeth) / record.attrs["mesh_period"]
    slid = (share * path * np.tanh(path * speeds / transition)).sum(axis=1).mean()
    assert lost == pytest.approx(mu * slid * (1 / r1 + 1 / r2), rel=0.05)

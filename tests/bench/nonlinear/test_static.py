"""Small vibrations of the non-linear model against its own time integration, and motions that nothing holds back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.bench import simulate
from gearbench.bench.plan.excitation import torque_realisation
from gearbench.bench.results.exact import lumped_periodic_system
from gearbench.bench.statics import static
from gearbench.geometry import pair
from gearbench.identification.truth.monodromy import exact_itf
from gearbench.rig import (
    Across,
    Case,
    Coupling,
    Drive,
    Experiment,
    Gear,
    Housing,
    Load,
    MeshCorrection,
    Multisine,
    OutputShaft,
    Rig,
    Ripple,
    Simulation,
    Support,
    Supports,
)

SAMPLES, RATE = 1024, 10240.0


ACROSS = Across(stiffness=7e7, damping=2e3, coupling=1e7)
LONG = pytest.mark.validation
HOUSING = Housing(mass=12.0, stiffness=4e8, damping=5e3)
SHAFT = OutputShaft(inertia=4e-3, stiffness=3e4, damping=1.0)


def make_case(
    boundary: str,
    drive: Drive,
    shaft: OutputShaft | None = None,
    housing: Housing | None = None,
    across: Across | None = None,
    **experiment: Any,
) -> Case:
    gear = {"module": 3e-3, "face_width": 0.02, "thinning": 30e-6}
    support = Support(stiffness=1e8, damping=3e3, exponent=0.3, reference_deflection=20e-6, across=across)
    rig = Rig(
        driver=Gear(teeth=20, hub_radius=15e-3, inertia=5e-4, mass=2.0, **gear),
        driven=Gear(teeth=30, hub_radius=25e-3, inertia=3e-3, mass=3.0, **gear),
        support=Supports(driver=support, driven=support),
        drive=drive,
        load=Load(boundary=boundary, coupling=shaft),
        housing=housing,
        mesh=MeshCorrection(stiffness_scale=0.9),
    )
    run: dict[str, Any] = {
        "mesh_frequency": 200.0,
        "torque_mean": 100.0,
        "sampling_rate": RATE,
        "samples_per_period": SAMPLES,
        "seed": 3,
        "settling_tolerance": 1e-5,
        "settling_periods_max": 20,
        **experiment,
    }
    simulation = Simulation(model="lumped", stiffness_edge=0.2)
    return Case(name="test", rig=rig, experiment=Experiment(**run), simulation=simulation)


@pytest.mark.parametrize(
    ("boundary", "stiffness", "structure", "states"),
    [
        ("speed", None, {}, 6),
        pytest.param("speed", 2e4, {}, 8, marks=LONG),
        pytest.param("torque", 2e4, {}, 8, marks=LONG),
        ("speed", 2e4, {"shaft": SHAFT, "housing": HOUSING, "across": ACROSS}, 16),
        pytest.param("torque", 2e4, {"shaft": SHAFT, "housing": HOUSING}, 12, marks=LONG),
        ("inertia", None, {"across": ACROSS}, 10),
        pytest.param("inertia", 2e4, {"shaft": SHAFT, "across": ACROSS}, 14, marks=LONG),
    ],
)
def test_linearised_response_is_what_a_small_multisine_excites(
    boundary: str, stiffness: float | None, structure: dict[str, Any], states: int
) -> None:
    drive = Drive(coupling=Coupling(inertia=2e-3, stiffness=stiffness))
    # Supports stiffen with load: only a small excitation sees the tangent at the mean torque.
    small = make_case(boundary, drive, **structure, multisine=Multisine(amplitude=0.02, band=(10.0, 3000.0), crest=2.5))
    still = make_case(boundary, drive, **structure)
    found = simulate(small)["dte"].values[0] - simulate(still)["dte"].values[0]
    system = lumped_periodic_system(small)
    assert system.states == states
    signal = torque_realisation(small.experiment, 0, small.rig).signal
    assert signal is not None
    number = np.arange(SAMPLES)
    kept, place = np.unique(number * 20 % SAMPLES, return_inverse=True)
    itf = exact_itf(system, signal.lines / signal.period, kept / SAMPLES, steps=system.phases)
    turn = np.exp(2j * np.pi * np.outer(signal.lines, number) / SAMPLES)
    force = signal.spectrum / pair(small.rig).driver.base_radius
    if boundary == "inertia":
        # The load's torque stays, and only a part of the driver's acts on the mesh.
        force *= force_part(small)
    expected = np.einsum("k,kn,kn->n", force, itf[:, place], turn).real
    assert np.linalg.norm(found - expected) < 0.02 * np.linalg.norm(expected)


def force_part(case: Case) -> float:
    """What 1 N on the driver's base circle is as a generalised force, by the record of a larger multisine."""
    loud = case.experiment.model_copy(update={"multisine": Multisine(amplitude=10.0, band=(10.0, 3000.0), crest=2.5)})
    record = simulate(case.model_copy(update={"experiment": loud}))
    alone = record["torque_driver"].values / record.attrs["base_radius_driver"]
    j1, j2 = record.attrs["inertia_driver"], record.attrs["inertia_driven"]
    r1, r2 = record.attrs["base_radius_driver"], record.attrs["base_radius_driven"]
    part = (r1**2 / j1) / (r1**2 / j1 + r2**2 / j2)
    assert np.ptp(record["force"].values) == pytest.approx(part * np.ptp(alone), rel=1e-9)
    assert record["force"].values.mean() == pytest.approx(alone.mean(), rel=1e-9)
    return part


def test_ripple_moves_free_gears_together_without_drift() -> None:
    ripple = Drive(ripple=Ripple(orders=(1,), amplitude=(2.0,), phase=(0.9,)))
    case = make_case("torque", ripple)
    record = simulate(case)
    r1, r2 = record.attrs["base_radius_driver"], record.attrs["base_radius_driven"]
    speed = 2 * np.pi * 10
    time = record["time"].values
    swing = record["angle_driven"].values[0] - 2 * np.pi * 200 / 30 * time
    # Both gears as one inertia at the driver's shaft, under 2 N m at 10 Hz.
    inertia = 5e-4 + 3e-3 * (r1 / r2) ** 2
    expected = -2.0 / inertia / speed**2 * np.cos(speed * time + 0.9) * r1 / r2
    assert np.ptp(swing - swing.mean() - expected) < 0.02 * np.ptp(expected)


def test_static_response_knows_shape_of_the_load() -> None:
    case = make_case("speed", Drive())
    loads = [40.0, 120.0]
    found = static(case, torque=loads, positions=16)
    np.testing.assert_allclose(found["torque"].values, np.repeat([loads], 16, axis=0).T, rtol=1e-12)
    np.testing.assert_allclose(
        found["transmission_error"].values[1], 3 * found["transmission_error"].values[0], rtol=1e-9
    )
    secant = found["torque"].values / found.attrs["base_radius_driver"] / found["transmission_error"].values
    np.testing.assert_allclose(found["stiffness_secant"].values, secant, rtol=1e-12)

"""Equations of motion against a textbook transfer function, energies and hand values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.geometry import pair
from gearbench.lumped import (
    Lumped,
    LumpedError,
    PairStiffness,
    choose_substeps,
    equivalent_mass,
    lumped_model,
    periodic_matrices,
    tabulated_stiffness,
)
from gearbench.rig import Gear, Load, Rig, Simulation, Support, Supports


def make_model(**changes: Any) -> Lumped:
    values: dict[str, Any] = {
        "mesh_mass": 1.3,
        "support_factor": 0.94,
        "masses": (2.0, 2.6),
        "support_stiffness": (3.2e8, 4.5e8),
        "support_damping": (900.0, 1500.0),
        "damping_ratio": 0.05,
        "stiffness": tabulated_stiffness([0.6e8, 1.2e8]),
    }
    return Lumped(**{**values, **changes})


def make_rig(**changes: Any) -> Rig:
    gear = {"module": 2e-3, "face_width": 0.02, "hub_radius": 0.0175}
    values: dict[str, Any] = {
        "driver": Gear(teeth=62, mass=3.0, inertia=5e-3, **gear),
        "driven": Gear(teeth=40, mass=2.0, inertia=1.5e-3, **{**gear, "hub_radius": 0.015}),
        "support": Supports(driver=Support(stiffness=1e8, damping=100), driven=Support(stiffness=2e8)),
    }
    return Rig(**{**values, **changes})


@pytest.mark.parametrize("factor", [1.0, 0.94])
def test_transfer_function_is_that_of_three_receptances_in_series(factor: float) -> None:
    """dte = Yx (F - Fm) - (Y1 + Y2) Fm with Fm = Z dte: receptances seen along the line of action."""
    model = make_model(support_factor=factor)
    k = 0.9e8
    a, b, c = model.state_matrix(k), model.input_vector, model.output_vector
    for frequency in (10.0, 700.0, 1300.0, 2500.0):
        s = 2j * np.pi * frequency
        z = k + s * 2 * 0.05 * np.sqrt(k * model.mesh_mass)
        yx = 1 / (s**2 * model.mesh_mass)
        supports = zip(model.masses, model.support_stiffness, model.support_damping, strict=True)
        ys = sum(factor**2 / (m * s**2 + d * s + p) for m, p, d in supports)
        expected = yx / (1 + z * (yx + ys))
        found = c @ np.linalg.solve(s * np.eye(6) - a, b)
        assert found == pytest.approx(expected, rel=1e-10)


def test_mesh_force_pushes_the_driver_back_and_the_driven_gear_on() -> None:
    # At rest: the driver's centre gives way against +y, the driven centre along +y, the mesh is compressed.
    model = make_model()
    x, y1, y2, *rates = model.equilibrium(1000.0)
    assert y1 == pytest.approx(-0.94 * 1000 / 3.2e8)
    assert y2 == pytest.approx(0.94 * 1000 / 4.5e8)
    assert x + 0.94 * (y1 - y2) == pytest.approx(1000 / 0.6e8)
    assert rates == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("phase", [0.0, 0.3])
def test_equilibrium_is_a_fixed_point_of_the_state_equation(phase: float) -> None:
    model = make_model()
    state = model.equilibrium(1234.0, phase)
    rate = model.state_matrix(float(model.stiffness.at(phase))) @ state + model.input_vector * 1234.0
    np.testing.assert_allclose(rate, 0.0, atol=1e-9 * 1234 / model.mesh_mass)


def test_static_transmission_error_offsets_the_equilibrium() -> None:
    model = make_model(error=(2e-6 - 1e-6j, 3e-6))
    plain = make_model()
    for phase in (0.0, 0.2, 0.7):
        angle = 2 * np.pi * phase
        error = 2e-6 * np.cos(angle) + 1e-6 * np.sin(angle) + 3e-6 * np.cos(2 * angle)
        shift = model.equilibrium(500.0, phase) - plain.equilibrium(500.0, phase)
        np.testing.assert_allclose(shift, [error, 0, 0, 0, 0, 0], atol=1e-15)


def test_derivative_of_the_transmission_error() -> None:
    model = make_model(error=(2e-6 - 1e-6j, 3e-6))
    phase, step = np.linspace(0, 1, 7), 1e-6
    above, below = model.transmission_error(phase + step)[0], model.transmission_error(phase - step)[0]
    np.testing.assert_allclose(model.transmission_error(phase)[1], (above - below) / (2 * step), rtol=1e-6)


def test_damping_gives_the_mesh_its_ratio() -> None:
    # With rigid supports the mesh is one oscillator: its eigenvalue shows zeta and omega = sqrt(k / m_e).
    model = make_model(support_stiffness=(1e15, 1e15))
    values = np.linalg.eigvals(model.state_matrix(1e8))
    mesh = values[np.argmin(np.abs(values))]
    assert abs(mesh) == pytest.approx(np.sqrt(1e8 / 1.3), rel=1e-5)
    assert -mesh.real / abs(mesh) == pytest.approx(0.05, rel=1e-4)


def test_equivalent_masses_by_hand() -> None:
    assert equivalent_mass((0.05, 0.1), (0.01, 0.02), "speed") == pytest.approx(4.0)
    # Masses J/r^2 of 4 kg and 2 kg in series: 8/6.
    assert equivalent_mass((0.05, 0.1), (0.01, 0.02), "torque") == pytest.approx(8 / 6)


def test_model_of_a_rig_takes_its_values() -> None:
    rig = make_rig()
    meshing = pair(rig)
    model = lumped_model(rig, meshing, Simulation())
    rb = meshing.driver.base_radius, meshing.driven.base_radius
    assert model.mesh_mass == pytest.approx(5e-3 / rb[0] ** 2)
    assert model.masses == (3.0, 2.0)
    assert model.support_stiffness == (1e8, 2e8)
    assert model.support_damping == (100.0, 0.0)
    assert model.support_factor == pytest.approx(np.cos(np.deg2rad(20.0)))
    free = lumped_model(make_rig(load=Load(boundary="torque")), meshing, Simulation())
    assert free.mesh_mass == pytest.approx(1 / (rb[0] ** 2 / 5e-3 + rb[1] ** 2 / 1.5e-3))
    supports = rig.support.model_copy(update={"direction": "line-of-action"})
    assert lumped_model(make_rig(support=supports), meshing, Simulation()).support_factor == 1.0


def test_masses_follow_from_the_geometry_when_absent() -> None:
    gear = {"teeth": 62, "module": 2e-3, "face_width": 0.02, "hub_radius": 0.0175, "bore_radius": 0.0175}
    rig = make_rig(driver=Gear(**gear), driven=Gear(**gear))
    model = lumped_model(rig, pair(rig), Simulation())
    # A plain disc of the reference circle, bore 35 mm: the documented example's 1.736 kg, 3.6025e-3 kg m^2.
    assert model.masses[0] == pytest.approx(1.736, rel=0.03)
    assert model.mesh_mass == pytest.approx(3.6025e-3 / pair(rig).driver.base_radius ** 2, rel=0.05)


def test_periodic_matrices_follow_the_stiffness() -> None:
    model = make_model()
    a, b, c = periodic_matrices(model, 8)
    assert a.shape == (8, 6, 6)
    np.testing.assert_array_equal(b, [0, 0, 0, 1 / 1.3, 0, 0])
    np.testing.assert_array_equal(c, [1, 0.94, -0.94, 0, 0, 0])
    k = -a[:, 3, 0] * model.mesh_mass
    np.testing.assert_allclose(k, [0.6e8, 0.75e8, 0.9e8, 1.05e8, 1.2e8, 1.05e8, 0.9e8, 0.75e8])


def test_periodic_matrices_keep_the_mean_of_a_sharp_stiffness() -> None:
    sharp = PairStiffness(np.array([-0.303, 0.847]), np.array([1e8, 1e8]))
    a, _, _ = periodic_matrices(make_model(stiffness=sharp), 64)
    assert (-a[:, 3, 0] * 1.3).mean() == pytest.approx(1.15e8, rel=2e-3)


def test_fastest_rate_is_that_of_the_stiffest_phase() -> None:
    model = make_model()
    rates = [np.abs(np.linalg.eigvals(model.state_matrix(k))).max() for k in np.linspace(0.6e8, 1.2e8, 9)]
    assert model.fastest_rate() == pytest.approx(max(rates), rel=1e-9)


def test_bad_amplitudes_are_refused() -> None:
    rig = make_rig()
    with pytest.raises(LumpedError, match="amplitudes of the static transmission error"):
        lumped_model(rig, pair(rig), Simulation(), error=[np.nan])


def test_substeps_meet_the_error_bound_or_the_sentence_says_what_is_needed() -> None:
    # (omega h)^4 / 120 <= 5e-4: omega h <= 0.4949.
    assert choose_substeps(10_000.0, 1.0, 10_000.0) == 3
    assert choose_substeps(100.0, 1e-3, 1000.0) == 200
    assert choose_substeps(10_000.0, 1.0, 10_000.0, requested=5) == 5
    with pytest.raises(LumpedError, match=r"substeps = 2 is too coarse.*at least 3"):
        choose_substeps(10_000.0, 1.0, 10_000.0, requested=2)
    with pytest.raises(LumpedError, match="limit 1024"):
        choose_substeps(1e9, 1.0, 1000.0)


def test_runge_kutta_frequency_error_is_what_the_bound_assumes() -> None:
    # One step turns exp(j w h) by 1 + z + z^2/2 + z^3/6 + z^4/24: its angle against w h.
    z = 0.4949j
    amplification = 1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24
    assert 4e-4 < abs(np.angle(amplification) / z.imag - 1) < 5e-4

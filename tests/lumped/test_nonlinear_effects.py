"""Every effect of the non-linear model, one at a time, against its closed form."""

from __future__ import annotations

from math import cos, pi
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from shared.effect_rig import FORCE, GEARS, MASSES, make_model, make_rig, run, steady_dte
from shared.hat_mesh import ALPHA, BACKLASH, BASE_PITCH, BENDING, RADII, hat, hat_law, stiffness

from gearbench.geometry import pair
from gearbench.lumped.nonlinear.model import nonlinear_model
from gearbench.lumped.nonlinear.pressing import alike
from gearbench.lumped.nonlinear.step import columns, integrate
from gearbench.lumped.nonlinear.tables import Motion, Varied, instants, tables
from gearbench.rig import (
    Coupling,
    Crack,
    Damping,
    Drive,
    Friction,
    Load,
    MeshCorrection,
    Ripple,
    Support,
    Supports,
)

Array = NDArray[np.float64]

HUNTING = 60
ALL = Motion(60.0, 60 * 32, 1.0)


def order(dte: Array, number: int) -> complex:
    """Complex amplitude of a line of the hunting period."""
    return complex(2 * np.fft.rfft(dte)[number] / dte.size)


def test_run_out_is_a_transmission_error_of_half_its_size_at_the_shaft_order() -> None:
    _, dte = steady_dte(make_rig(driver={"runout": 12e-6, "runout_phase": 0.7}, driven={"runout": 8e-6}))
    # Most material at rotation 0.7 of the driver: the driver then falls back most.
    assert order(dte, HUNTING // 20) == pytest.approx(-6e-6 * np.exp(-0.7j), rel=2e-3)
    assert order(dte, HUNTING // 30) == pytest.approx(-4e-6, rel=2e-3)
    assert abs(order(dte, 5)) < 1e-9


def test_pitch_error_of_a_tooth_moves_the_gears_while_that_tooth_meshes() -> None:
    errors = [0.0] * 20
    errors[7] = 5e-6
    phase, dte = steady_dte(make_rig(driver={"pitch_error": tuple(errors)}))
    expected = FORCE / 3e8 - 5e-6 * sum(hat(phase - n) for n in (7, 27, 47))
    assert np.abs(dte - expected).max() < 0.05 * 5e-6  # the hat's kinks ring a little


def test_errors_common_to_all_pairs_follow_the_mesh_orders() -> None:
    mesh = MeshCorrection(error_mean=3e-6, error_cos=(1e-6, 0.0), error_sin=(0.0, 0.5e-6))
    _, dte = steady_dte(make_rig(mesh=mesh))
    assert dte.mean() == pytest.approx(FORCE / 3e8 - 3e-6, rel=1e-4)
    assert order(dte, 60) == pytest.approx(-1e-6, rel=2e-2)
    assert order(dte, 120) == pytest.approx(0.5e-6j, rel=2e-2)


def test_a_cracked_tooth_softens_the_mesh_while_it_carries_and_never_else() -> None:
    phase = np.arange(60 * 32) / 32
    pairs = hat_law().pairs(phase)[0]
    for side, teeth in enumerate((20, 30)):
        cracked = {("driver", "driven")[side]: {"crack": Crack(tooth=3, stiffness_loss=0.5)}}
        model = make_model(make_rig(**cracked))
        gain = instants(model, tables(model, ALL), -1).pair_gain
        # Its pair: compliance 1/k grows by its bending part when that doubles.
        np.testing.assert_allclose(gain, np.where(pairs % teeth == 3, 1 / (1 + BENDING[side]), 1.0), rtol=1e-12)
    assert not tables(make_model(make_rig()), ALL).own.size


def test_corrections_scale_and_shape_the_stiffness() -> None:
    mesh = MeshCorrection(stiffness_scale=0.8, stiffness_cos=(0.1, 0.0), stiffness_sin=(0.0, -0.05))
    gain = tables(make_model(make_rig(mesh=mesh)), Motion(2.0, 64, 1.0)).gain[:-1]
    phase = np.arange(64) / 32
    expected = 0.8 * (1 + 0.1 * np.cos(2 * pi * phase) - 0.05 * np.sin(4 * pi * phase))
    np.testing.assert_allclose(gain, expected, rtol=1e-12)


@pytest.mark.parametrize("wander", [0.0, 0.3])
def test_waves_that_are_turned_on_from_step_to_step_stay_what_they_are(wander: float) -> None:
    """Mesh series, run-out and ripple on a grid as fine as a simulation's, at constant speed and in a rotation that
    departs from it, against their own cosines."""
    mesh = MeshCorrection(stiffness_cos=(0.1, 0.0), stiffness_sin=(0.0, -0.05))
    ripple = Ripple(orders=(6, 12, 20), amplitude=(3.0, 2.0, 1.0), phase=(0.4, 1.1, -0.3))
    rig = make_rig(mesh=mesh, driver={"runout": 20e-6, "runout_phase": 0.7}, drive=Drive(ripple=ripple))
    entries, cycles = 6000, 10.0
    phase = 41.37 + np.arange(-1.0, entries + 2) * cycles / entries
    phase += wander * np.sin(2 * pi * phase / 7)
    varied = Varied(phase, np.ones(entries + 1), np.zeros(entries + 1)) if wander else None
    table = tables(make_model(rig), Motion(cycles, entries, 1e-5, 41.37, varied))
    at = phase[1:-1]
    series = 1 + 0.1 * np.cos(2 * pi * at) - 0.05 * np.sin(4 * pi * at)
    np.testing.assert_allclose(table.gain, series, rtol=1e-12)
    aside = -10e-6 * np.sin(2 * pi * at / 20 - 0.7) / RADII[0]
    np.testing.assert_allclose(table.levers[:, 0], aside, atol=1e-12 * np.abs(aside).max())
    waves = sum(
        a * np.cos(2 * pi * order * at / 20 + start)
        for order, a, start in zip(ripple.orders, ripple.amplitude, ripple.phase, strict=True)
    )
    np.testing.assert_allclose(table.ripple * RADII[0], waves, atol=1e-11)


@pytest.mark.parametrize("boundary", ["speed", "torque"])
def test_a_coupling_swings_at_the_frequency_of_both_inertias(boundary: str) -> None:
    spring, rotor = 8e3, 2e-3
    drive = Drive(coupling=Coupling(inertia=rotor, stiffness=spring))
    model = make_model(make_rig(drive=drive, load=Load(boundary=boundary)))
    loose = model.linearised(0.0, FORCE)  # gears apart: driver and rotor are alone
    found = np.abs(np.linalg.eigvals(loose).imag)
    expected = np.sqrt(spring * (1 / GEARS[0] + 1 / rotor))
    assert np.abs(found - expected).min() < 1e-9 * expected
    # Ever stiffer it becomes the rigid one.
    rigid = make_model(make_rig(drive=Drive(coupling=Coupling(inertia=rotor)), load=Load(boundary=boundary)))
    stiff = make_model(
        make_rig(drive=Drive(coupling=Coupling(inertia=rotor, stiffness=1e10)), load=Load(boundary=boundary))
    )
    one, other = (np.sort(np.abs(np.linalg.eigvals(m.linearised(3e8, FORCE)))) for m in (rigid, stiff))
    moving = one[one > 1.0]
    np.testing.assert_allclose(other[other > 1.0][: moving.size], moving, rtol=1e-4)


def test_ripple_has_its_orders_and_is_no_part_of_the_reaction_to_the_commanded_torque() -> None:
    ripple = Ripple(orders=(6,), amplitude=(2.0,), phase=(0.8,))
    _, dte = steady_dte(make_rig(drive=Drive(ripple=ripple)))
    assert order(dte, 18) == pytest.approx(2.0 / RADII[0] / 3e8 * np.exp(0.8j), rel=2e-3)
    assert abs(order(dte, 7)) < 1e-3 * abs(order(dte, 18))


def test_gears_that_come_apart_fly_freely_until_the_back_flanks_touch() -> None:
    model = make_model(make_rig())
    # Driver thrown back from first contact against the torque: a parabola, no force while it lasts.
    state = np.zeros(10)
    state[5] = -0.02
    push = 100.0
    time, out = run(model, lambda t: np.full(t.shape, push), state, mesh_frequency=50.0, cycles=0.5, steps=20000)
    rise = push / model.masses[0]
    flight = time < 2 * 0.02 / rise
    np.testing.assert_allclose(out.u1[flight], (-0.02 * time + 0.5 * rise * time**2)[flight], atol=1e-15)
    assert not out.mesh_force[flight].any()
    assert out.u1[flight].min() == pytest.approx(-(0.02**2) / (2 * rise), rel=1e-3)
    # Faster, it reaches the other side of the backlash.
    state[5] = -0.2
    _, out = run(model, lambda t: np.full(t.shape, push), state, mesh_frequency=50.0, cycles=0.05, steps=20000)
    hit = int(np.argmax(out.mesh_force < 0))
    dte = out.u1 + cos(ALPHA) * (out.y1 - out.y2)
    assert hit > 0
    assert dte[hit] == pytest.approx(-BACKLASH, rel=1e-3)
    assert not out.mesh_force[:hit].any()


@pytest.mark.parametrize("exponent", [-0.4, 0.0, 0.6])
def test_a_support_deflects_by_its_power_law(exponent: float) -> None:
    support = Support(stiffness=1e8, damping=3e3, exponent=exponent, reference_deflection=5e-6)
    rig = make_rig(support=Supports(driver=support, driven=support))
    model = make_model(rig, hat_law(swing=0.0))
    state = 0.0 * model.equilibrium(FORCE, alike(0.0))
    _, out = run(model, lambda t: np.full(t.shape, FORCE), state, mesh_frequency=10.0, cycles=8.0, steps=80000)
    expected = 5e-6 * (FORCE * cos(ALPHA) / (1e8 * 5e-6)) ** (1 / (1 + exponent))
    assert out.y2[-1] == pytest.approx(expected, rel=1e-4)
    assert out.y1[-1] == pytest.approx(-expected, rel=1e-4)
    (y1, x1), (y2, x2) = model.centres(FORCE)
    assert (y1, y2) == pytest.approx((-expected, expected), rel=1e-12)
    assert x1 == x2 == 0.0
    # Small vibrations see the slope of the force, whose stiffness per deflection grows with its exponent.
    slope = (1 + exponent) * FORCE * cos(ALPHA) / expected
    found = np.linalg.eigvals(model.linearised(0.0, FORCE))
    wanted = np.roots([MASSES[1], 3e3, slope])
    assert np.abs(found[:, None] - wanted).min(axis=0) == pytest.approx([0.0, 0.0], abs=1e-6 * np.abs(wanted[0]))


def moved(rotation: Array, gear: int, flank: int) -> Array:
    """How far a gear whose centre runs round at 1 m pushes its working (0) or back flank (1) towards the mate [m].

    The driver lies left and turns anti-clockwise. Outward normals of its flanks lean up (working) and down (back) from
    the line of centres; those of the driven gear point against them. At rotation 0 the working flank is pushed most.
    """
    side = 1 - 2 * gear
    normals = [side * np.array([np.sin(ALPHA), lean * np.cos(ALPHA)]) for lean in (1, -1)]
    c, s = np.cos(side * rotation), np.sin(side * rotation)
    offset = np.array([c * normals[0][0] - s * normals[0][1], s * normals[0][0] + c * normals[0][1]])
    return np.asarray(normals[flank] @ offset)


def test_run_out_moves_whole_gears_so_that_back_flanks_feel_it_at_another_angle() -> None:
    phase = np.arange(60 * 8) / 8
    for gear, (name, teeth) in enumerate((("driver", 20), ("driven", 30))):
        table = tables(make_model(make_rig(**{name: {"runout": 20e-6, "runout_phase": 0.7}})), Motion(60.0, 480, 1.0))
        rotation = 2 * pi * phase / teeth - 0.7
        for flank, column in enumerate((table.excess, table.back)):
            np.testing.assert_allclose(column[:-1], 10e-6 * moved(rotation, gear, flank), atol=1e-18)


def test_run_out_opens_and_closes_the_back_flanks_too() -> None:
    model = make_model(make_rig(driver={"runout": 20e-6}))
    state = np.zeros(10)
    excess = 10e-6 * float(moved(np.zeros(1), 0, 1)[0])
    assert excess < -7e-6

    # Driver pressed backwards onto the back flanks at rotation 0, where run-out gives the working ones most.
    def force(t: Array) -> Array:
        return np.full(t.shape, -50.0)

    state[0] = -BACKLASH + excess
    _, out = run(model, force, state, mesh_frequency=1e-3, cycles=1e-4, steps=20000)
    dte = out.u1[-1] + cos(ALPHA) * (out.y1[-1] - out.y2[-1])
    assert dte == pytest.approx(-BACKLASH + excess - 50.0 / float(stiffness(0.5)), rel=1e-3)


@pytest.mark.parametrize(
    "values",
    [
        {"driver": {"pitch_error": (0.0,) * 20, "runout": 0.0, "runout_phase": 2.0}},
        {"driven": {"crack": Crack(tooth=4, stiffness_loss=0.0)}},
        {"drive": Drive(ripple=Ripple(orders=(3,), amplitude=(0.0,), phase=(1.0,)))},
        {"friction": Friction(coefficient=0.0, transition_speed=1.0)},
        {"mesh": MeshCorrection(stiffness_cos=(0.0,), stiffness_sin=(0.0,), error_cos=(0.0,), error_sin=(0.0,))},
    ],
)
def test_a_neutral_effect_leaves_every_table_as_it_was(values: dict[str, Any]) -> None:
    motion = Motion(60.0, 7680, 1e-5, 0.3)
    plain, neutral = (tables(make_model(rig), motion) for rig in (make_rig(), make_rig(**values)))
    assert [column.tobytes() for column in plain] == [column.tobytes() for column in neutral]


def test_damping_never_holds_the_flanks_together() -> None:
    rig = make_rig().model_copy(update={"damping": Damping(mesh_ratio=0.4)})
    model = make_model(rig, hat_law(swing=0.0, bend=0.0))
    state = np.zeros(10)
    state[0], state[5] = 0.2e-6, -0.05  # barely touching and leaving fast: the damper alone would pull
    time, out = run(model, lambda t: np.zeros(t.shape), state, mesh_frequency=50.0, cycles=0.01, steps=20000)
    dte = out.u1 + cos(ALPHA) * (out.y1 - out.y2)
    assert dte[-1] < -5e-6
    assert out.mesh_force.min() == 0.0
    np.testing.assert_allclose(out.u1, 0.2e-6 - 0.05 * time, atol=1e-15)


@pytest.mark.parametrize("cycle", [0.1, 0.45, 0.8])
def test_back_flanks_carry_with_the_stiffness_of_their_own_phase(cycle: float) -> None:
    law = hat_law(mirror=0.3, bend=0.0)
    model = make_model(make_rig(), law)
    push = 2000.0
    # Turning imperceptibly, pressed backwards: the mesh rests at the phase of the last sample.
    motion = Motion(cycles=1e-6, entries=80000, step=5e-6, first_phase=cycle)
    state = np.r_[-BACKLASH, np.zeros(9)]
    table = tables(model, motion)
    _, samples = integrate(model, table, np.full(2, -push), state, step=5e-6, substeps=1, mesh_frequency=5e-6)
    out = columns(samples)
    dte = out.u1[-1] + cos(ALPHA) * (out.y1[-1] - out.y2[-1])
    assert out.mesh_force[-1] == pytest.approx(-push, rel=1e-6)
    cycle -= RADII[1] / sum(RADII) * cos(ALPHA) * (out.y1[-1] - out.y2[-1]) / BASE_PITCH  # by the centres' motion
    assert dte == pytest.approx(-BACKLASH - push / float(stiffness(0.3 - cycle)), rel=1e-6)


@pytest.mark.parametrize("boundary", ["speed", "torque"])
def test_the_rotor_counts_in_the_mass_of_the_mesh_and_turns_with_the_gear_or_alone(boundary: str) -> None:
    masses = {"driver": {"inertia": 3e-4, "mass": 2.0}, "driven": {"inertia": 2e-3, "mass": 3.0}}
    meshing = pair(make_rig(**masses))
    r1, r2 = meshing.driver.base_radius, meshing.driven.base_radius
    for spring, own, rotor in ((None, 2.3e-3, 0.0), (1e4, 3e-4, 2e-3)):
        drive = Drive(coupling=Coupling(inertia=2e-3, stiffness=spring))
        model = nonlinear_model(make_rig(**masses, drive=drive, load=Load(boundary=boundary)), meshing, hat_law())
        assert model.masses == pytest.approx((own / r1**2, 2e-3 / r2**2, rotor / r1**2, 2.0, 3.0), rel=1e-12)
        reduced = 2.3e-3 / r1**2
        if boundary == "torque":
            reduced = 1 / (1 / reduced + r2**2 / 2e-3)
        assert model.mesh_mass == pytest.approx(reduced, rel=1e-12)
        assert model.constants().rigid == (0.0 if spring else 1.0)

"""Shafts on both sides, housing, supports across and boundaries against equations in vectors, limits and energy."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from shared.effect_rig import FORCE, GEARS, MASSES, make_model, make_rig, run
from shared.hat_mesh import ALPHA, RADII, hat_law
from shared.plain_structure import UNKNOWNS, plain_rates, shares

from gearbench.lumped import LumpedError
from gearbench.lumped.nonlinear.coordinates import NAMES
from gearbench.lumped.nonlinear.pressing import alike
from gearbench.lumped.nonlinear.rest import centre_at_rest
from gearbench.lumped.nonlinear.step import Outputs
from gearbench.rig import (
    Across,
    Coupling,
    Damping,
    Drive,
    Friction,
    Housing,
    Load,
    MeshCorrection,
    OutputShaft,
    Rig,
    Rocking,
    Support,
    Supports,
)

Array = NDArray[np.float64]

FREQUENCY, SWING = 100.0, (25.0, 700.0)  # of the mesh [Hz]; amplitude [N m] and frequency [Hz] of the torque
TORQUE = FORCE * RADII[0]


def torque(t: Any) -> Any:
    return TORQUE + SWING[0] * np.sin(2 * pi * SWING[1] * t)


def supports(across: float | None = 1.0, direction: str = "tangential", exponent: float = 0.3) -> Supports:
    """Supports of both gears, across them `across` times as stiff as written here."""
    one = two = None
    if across is not None:
        one = Across(stiffness=0.8e8 * across, damping=2e3, coupling=1.5e7)
        two = Across(stiffness=1.6e8 * across, damping=1e3, coupling=-2e7)
    return Supports(
        driver=Support(stiffness=1e8, damping=3e3, exponent=exponent, reference_deflection=8e-6, across=one),
        driven=Support(stiffness=1.4e8, damping=2e3, across=two),
        direction=direction,
    )


ROTOR = Coupling(inertia=2e-3, stiffness=9e3, damping=0.6)
SHAFT = OutputShaft(inertia=6e-3, stiffness=2e4, damping=1.1)
STRAIGHT = Housing(
    mass=25.0, stiffness=6e8, damping=4e3, driven_share=0.7,
    rocking=Rocking(mass=12.0, stiffness=9e8, damping=3e3, driven_share=-0.8),
)  # fmt: skip
HOUSING = STRAIGHT.model_copy(update={
    "driver_share_across": 0.4, "driven_share_across": -0.6,
    "rocking": STRAIGHT.rocking.model_copy(update={"driver_share_across": -0.3, "driven_share_across": 0.9}),
})  # fmt: skip


def full_rig(**fields: Any) -> Rig:
    """A rig with all structure and friction, shafts elastic, the driven speed prescribed."""
    values: dict[str, Any] = {
        "support": supports(),
        "housing": HOUSING,
        "drive": Drive(coupling=ROTOR),
        "load": Load(coupling=SHAFT),
        "friction": Friction(coefficient=0.06, transition_speed=20e-3),
        "mesh": MeshCorrection(stiffness_scale=1.1),
        **fields,
    }
    return make_rig(**values)


def in_radians(state: Array) -> Array:
    """A state of the model in the unknowns of the plain equations."""
    place = dict(zip((*NAMES, *(f"{name}'" for name in NAMES)), state, strict=True))
    (r1, r2), out = RADII, []
    for end in ("", "'"):
        turns = (place[f"w{end}"] / r1, place[f"u1{end}"] / r1, place[f"u2{end}"] / r2, place[f"load{end}"] / r2)
        out += [*turns, *(place[f"{name}{end}"] for name in ("housing", "y1", "x1", "y2", "x2", "rocking"))]
    return np.array(out)


def motions(out: Outputs) -> Array:
    """Outputs (samples, unknowns) in the unknowns of the plain equations."""
    (r1, r2) = RADII
    turns = (out.w / r1, out.u1 / r1, out.u2 / r2, out.load / r2)
    return np.stack([*turns, out.housing, out.y1, out.x1, out.y2, out.x2, out.rocking], axis=1)


def excited(rig: Rig, constant: bool = False, steps: int = 9600, cycles: int = 2) -> tuple[Array, Outputs, Array]:
    """Time, outputs of some mesh cycles and the state at rest from which they begin."""
    model = make_model(rig)
    state = model.equilibrium(FORCE, alike(0.0, gain=rig.mesh.stiffness_scale))
    push = (lambda t: np.full(t.shape, FORCE)) if constant else (lambda t: torque(t) / RADII[0])
    time, out = run(model, push, state, mesh_frequency=FREQUENCY, cycles=float(cycles), steps=cycles * steps)
    assert out.mesh_force.min() > 0
    return time, out, state


CENTRES = {"y1", "x1", "y2", "x2"}
EVERY = set(UNKNOWNS)


@pytest.mark.parametrize(
    ("fields", "moving"),
    [
        ({}, EVERY - {"load"}),
        ({"load": Load(boundary="torque", coupling=SHAFT), "support": supports(direction="line-of-action")}, EVERY),
        pytest.param({"load": Load(boundary="inertia", coupling=SHAFT)}, EVERY, marks=pytest.mark.validation),
        pytest.param(
            {"load": Load(boundary="inertia", coupling=SHAFT), "housing": None},
            EVERY - {"housing", "rocking"},
            marks=pytest.mark.validation,
        ),
        (
            {"drive": Drive(), "load": Load(boundary="inertia", coupling=OutputShaft(inertia=6e-3))},
            {"driver", "driven", "housing", "rocking", *CENTRES},
        ),
        (
            {"drive": Drive(boundary="speed", coupling=ROTOR), "load": Load(boundary="torque", coupling=SHAFT)},
            EVERY - {"rotor"},
        ),
        (
            {"drive": Drive(boundary="speed"), "load": Load(boundary="torque"), "support": supports(None),
             "housing": STRAIGHT},
            {"driven", "housing", "rocking", "y1", "y2"},
        ),
    ],
)
def test_all_structure_follows_equations_in_vectors(fields: dict[str, Any], moving: set[str]) -> None:
    rig = full_rig(**fields)
    constant = rig.drive.boundary == "speed"
    time, out, state = excited(rig, constant, cycles=1)
    place, found = in_radians(state), motions(out)
    assert {name for name, swing in zip(UNKNOWNS, np.ptp(found, axis=0), strict=True) if swing > 0} - {"rotor"} == (
        moving - {"rotor"}
    )
    plain = plain_rates(rig, FREQUENCY, (lambda t: TORQUE) if constant else torque, TORQUE)
    span = (0.0, 0.5 / FREQUENCY)  # with a handover
    time, found = time[: time.size // 2], found[: time.size // 2]
    solved = solve_ivp(plain, span, place, "DOP853", dense_output=True, rtol=1e-9, atol=1e-14, max_step=2e-4)
    for number, name in enumerate(UNKNOWNS):
        if name in moving:
            error = np.abs(solved.sol(time)[number] - found[:, number]).max()
            assert error <= 2e-6 * np.ptp(found[:, number]), (name, error / np.ptp(found[:, number]))


def dte(rig: Rig) -> Array:
    """DTE [m] of two mesh cycles, its transient included."""
    _, out, _ = excited(rig, steps=25600)
    across = out.x1 - out.x2 if out.x1.size else 0.0
    return np.asarray(out.u1 - out.u2 + cos(ALPHA) * (out.y1 - out.y2) + sin(ALPHA) * across)


@pytest.mark.parametrize(
    ("nearly", "plain"),
    [
        ({"housing": Housing(mass=20.0, stiffness=1e13, damping=1e5)}, {"housing": None}),
        ({"housing": Housing(mass=1e7, stiffness=1e8)}, {"housing": None}),
        ({"support": supports(1e4), "housing": STRAIGHT}, {"support": supports(None), "housing": STRAIGHT}),
        (
            {"load": Load(boundary="torque", coupling=OutputShaft(inertia=6e-3, stiffness=3e8))},
            {"load": Load(boundary="torque", coupling=OutputShaft(inertia=6e-3))},
        ),
        ({"load": Load(coupling=OutputShaft(stiffness=3e8))}, {"load": Load()}),
        (
            {"drive": Drive(coupling=Coupling(inertia=2e-3, stiffness=3e8))},
            {"drive": Drive(coupling=Coupling(inertia=2e-3))},
        ),
        # So heavy an end turns steadily, whatever pushes it.
        ({"load": Load(boundary="inertia", coupling=OutputShaft(inertia=1e5))}, {"load": Load()}),
    ],
)
def test_structure_tends_to_what_it_replaces(nearly: dict[str, Any], plain: dict[str, Any]) -> None:
    without, still = dte(full_rig(**plain)), dte(full_rig(**{**plain, "friction": Friction()}))
    close = np.abs(dte(full_rig(**nearly)) - without).max() / np.ptp(without)
    assert close < 1e-3
    assert np.abs(still - without).max() / np.ptp(without) > 10 * close


@pytest.mark.parametrize("load", ["speed", "torque"])
def test_a_rigid_rotor_beyond_the_driven_gear_is_inertia_of_the_gear(load: str) -> None:
    bare, laden = (
        make_model(make_rig(load=Load(boundary=load, coupling=OutputShaft(inertia=inertia)))) for inertia in (0.0, 5e-3)
    )
    assert bare.structure is None and laden.structure is None
    assert laden.masses[1] - bare.masses[1] == pytest.approx(5e-3 / RADII[1] ** 2)
    expected = [GEARS[0] / RADII[0] ** 2] if load == "speed" else []
    if load == "torque":
        expected = [1 / (RADII[0] ** 2 / GEARS[0] + RADII[1] ** 2 / (GEARS[1] + 5e-3))]
    assert [laden.mesh_mass] == pytest.approx(expected)


@pytest.mark.parametrize("load", ["speed", "torque", "inertia"])
def test_energy_is_balanced(load: str) -> None:
    # A mesh of constant stiffness does no work of its own; what is put in is kept, passed on or lost in dampers.
    rig = full_rig(load=Load(boundary=load, coupling=SHAFT), friction=Friction(), support=supports(exponent=0.0))
    rig = rig.model_copy(update={"damping": Damping(mesh_ratio=0.0)})
    model = make_model(rig, hat_law(swing=0.0, bend=0.0))
    state = model.equilibrium(FORCE, alike(0.0, gain=1.1))
    steps, cycles = 60000, 1.0
    time, out = run(
        model, lambda t: torque(t) / RADII[0], state, mesh_frequency=FREQUENCY, cycles=cycles, steps=steps
    )
    step = time[1]
    place = dict(zip(UNKNOWNS, motions(out).T, strict=True))
    rate = {name: np.gradient(values, step) for name, values in place.items()}
    one, two, house = rig.support.driver, rig.support.driven, HOUSING
    assert one.across is not None and two.across is not None
    bodies = (("rotor", ROTOR.inertia), ("driver", GEARS[0]), ("driven", GEARS[1]), ("housing", house.mass))
    bodies += (("y1", MASSES[0]), ("x1", MASSES[0]), ("y2", MASSES[1]), ("x2", MASSES[1]), ("load", SHAFT.inertia))
    rocks = house.rocking
    assert rocks is not None
    bodies += (("rocking", rocks.mass),)
    feet = place["housing"] * shares(house)[..., None] + place["rocking"] * shares(rocks)[..., None]
    along = {"y1": place["y1"] - feet[0, 0], "y2": place["y2"] - feet[1, 0]}
    across = {"x1": place["x1"] - feet[0, 1], "x2": place["x2"] - feet[1, 1]}
    kinetic = sum(0.5 * mass * rate[name] ** 2 for name, mass in bodies)
    deflection = RADII[0] * place["driver"] - RADII[1] * place["driven"]
    deflection = deflection + cos(ALPHA) * (place["y1"] - place["y2"]) + sin(ALPHA) * (place["x1"] - place["x2"])
    springs: list[tuple[Array, float, float]] = [
        (deflection, 1.1 * 3e8, 0.0),
        (place["rotor"] - place["driver"], 9e3, ROTOR.damping),
        (place["driven"] - place["load"], 2e4, SHAFT.damping),
        (place["housing"], house.stiffness, house.damping),
        (place["rocking"], rocks.stiffness, rocks.damping),
        (along["y1"], one.stiffness, one.damping),
        (along["y2"], two.stiffness, two.damping),
        (across["x1"], one.across.stiffness, one.across.damping),
        (across["x2"], two.across.stiffness, two.across.damping),
    ]
    potential = sum(0.5 * k * d**2 for d, k, _ in springs)
    for name, support in (("1", one), ("2", two)):
        assert support.across is not None
        potential = potential + support.across.coupling * along[f"y{name}"] * across[f"x{name}"]
    lost = sum(c * np.gradient(d, step) ** 2 for d, _, c in springs)
    power = torque(time) * rate["rotor"] - out.load_force * RADII[1] * rate["load"]
    stored = kinetic + potential
    inside = slice(10, -10)  # gradients are one-sided at the ends
    passed = np.cumsum((power - lost)[inside]) * step
    error = stored[inside] - stored[inside][0] - passed
    assert np.abs(error).max() < 2e-3 * np.ptp(stored[inside])
    assert float((lost[inside] * step).sum()) > 25 * np.abs(error).max()


def test_a_mode_that_no_sample_shows_counts_by_half() -> None:
    model = make_model(full_rig(friction=Friction()))
    rates = np.abs(np.linalg.eigvals(model.linearised(1.1 * 1.3 * 3e8 * 1.25, FORCE)))
    fastest = model.fastest_rate(FORCE)
    assert fastest == pytest.approx(rates.max(), rel=1e-6)
    assert model.fastest_rate(FORCE, fastest) == fastest
    below = np.sort(rates)[-3]  # the fastest come as a conjugate pair
    assert below < 0.5 * fastest
    assert model.fastest_rate(FORCE, 0.9 * fastest) == 0.5 * fastest
    heavier = make_model(full_rig(friction=Friction(), mesh=MeshCorrection(stiffness_scale=1.1, stiffness_drift=0.44)))
    assert heavier.fastest_rate(FORCE) == pytest.approx(1.2 * fastest, rel=0.02)


def test_a_soft_support_gives_way_under_its_cross_coupling() -> None:
    soft = Support(stiffness=1e8, exponent=-0.6, across=Across(stiffness=1e8, coupling=0.9e8))
    model = make_model(make_rig(support=Supports(driver=soft, driven=soft)))
    with pytest.raises(LumpedError, match=r"gives way under its across\.coupling_n_per_m"):
        model.equilibrium(FORCE, alike(0.0))


@pytest.mark.parametrize("exponent", [0.0, 0.4])
def test_a_coupled_support_rests_where_its_forces_balance(exponent: float) -> None:
    support = supports(exponent=exponent).driver
    assert support.across is not None
    for push, aside in ((3000.0, 1200.0), (-3000.0, -1200.0), (2000.0, 0.0)):
        y, x = centre_at_rest(support, push, aside)
        own = support.stiffness * y * (abs(y) / support.reference_deflection) ** exponent
        assert own + support.across.coupling * x == pytest.approx(push, rel=1e-9)
        assert support.across.coupling * y + support.across.stiffness * x == pytest.approx(aside, rel=1e-9, abs=1e-6)

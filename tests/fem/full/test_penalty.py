"""Contact of the meshes' own surfaces: its balance, its energy, its limits, and what it tends to on fine meshes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.fem.contact.static import static_cycle
from gearbench.fem.full.energy import ledger
from gearbench.fem.full.gear import FullGear, make_gear
from gearbench.fem.full.machine import Angles, Machine
from gearbench.fem.full.penalty import at_rest, closed_points, near_surfaces, softness
from gearbench.fem.full.start import initial_state
from gearbench.fem.full.surface import outwards, project, runs_clockwise, sides_of
from gearbench.fem.full.transient import make_integrator, take_step
from gearbench.fem.motion.scheme import make_scheme

Array = NDArray[np.float64]
TORQUE = 100.0


@pytest.fixture(scope="module")
def surfaces(build: Callable[..., Machine]) -> Callable[..., Machine]:
    return lambda *given, **named: replace(build(*given, **named), surfaces=True)


@pytest.fixture(scope="module")
def fine_gear(twins: Any) -> FullGear:
    return make_gear(twins.rig.driver, twins.rig.material, 0.25e-3)


def in_space(gear: FullGear, force: Array, turned: float, centre: Array) -> tuple[Array, float]:
    """Resultant (2,) and moment about the origin of nodal forces (m, teeth) of a gear's outlines."""
    total, moment = np.zeros(2), 0.0
    for sector in range(gear.teeth):
        angle = turned + 2 * np.pi * sector / gear.teeth
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        at = gear.sector.points[gear.outline.nodes] @ turn.T + centre
        each = force[:, sector].reshape(-1, 2) @ turn.T
        total, moment = total + each.sum(axis=0), moment + float((at[:, 0] * each[:, 1] - at[:, 1] * each[:, 0]).sum())
    return total, moment


@pytest.mark.parametrize("phase", [-0.3, 0.0, 0.45])
def test_what_presses_on_one_gear_presses_on_the_other(surfaces: Callable[..., Machine], phase: float) -> None:
    """Nodal forces of both meshes balance as forces and as moments about any point, and the driver's carry the torque:
    the element's own surfaces against plain statics."""
    machine = surfaces(1.0, stiffness=1e12)
    rest = at_rest(machine, TORQUE, phase)
    law, met = machine.law, rest.touching.met
    at = Angles(phase * law.driver.pitch + rest.angle, phase * law.driven.pitch)
    turned = at.driver + law.driver.zero, law.driven.zero - at.driven + np.pi
    centres = machine.axis * rest.y[0], machine.axis * rest.y[1] + np.array([law.centre, 0.0])
    found = [
        in_space(gear, on.field(gear.teeth, rest.force), chi, centre)
        for gear, on, chi, centre in zip(machine.gears, met.pressed, turned, centres, strict=True)
    ]
    size = np.linalg.norm(found[0][0])
    assert size == pytest.approx(TORQUE / law.driver.rb, rel=0.02)
    assert np.abs(found[0][0] + found[1][0]).max() < 1e-9 * size
    assert found[0][1] + found[1][1] == pytest.approx(0.0, abs=1e-4 * TORQUE)  # the gap's width under the points
    assert found[0][1] == pytest.approx(-TORQUE, rel=1e-4)


def test_fine_surfaces_tend_to_the_contact_law(
    twins: Any, surfaces: Callable[..., Machine], fine_gear: FullGear, coarse_gear: FullGear
) -> None:
    """Elements as wide as the contact: within 3 % rms of the law's static transmission error, off by far on coarse
    ones."""
    phases = np.linspace(-0.5, 0.5, 11)
    truth = static_cycle(twins.law, phases, torque=[TORQUE]).transmission_error[0]
    off = []
    for gear in (coarse_gear, fine_gear):
        machine = replace(surfaces(1.0, stiffness=1e14), gears=(gear, gear))
        found = [machine.law.driver.rb * at_rest(machine, TORQUE, float(phase)).angle for phase in phases]
        off.append(np.sqrt(np.mean((np.array(found) / truth - 1) ** 2)))
    assert off[1] < 0.03 and off[0] > 0.1


def test_the_static_start_stays(surfaces: Callable[..., Machine]) -> None:
    machine = surfaces(damping=1e4, beta=1e-5)
    integrator, state = make_integrator(machine, make_scheme(2e-5, 0.9)), initial_state(machine, TORQUE)
    first = state.d
    for _ in range(5):
        step = take_step(integrator, state, TORQUE)
        assert step.converged
        state = step.state
    for one, two in zip(first, state.d, strict=True):
        assert np.abs(two - one).max() < 1e-5 * np.abs(one).max()  # what the augmentation leaves


def test_every_step_solves_its_equations(surfaces: Callable[..., Machine]) -> None:
    """The identity of works holds to rounding, through a loss of contact and an impact; flanks never overlap."""
    machine = surfaces(300.0, beta=2e-6, damping=3e3, boundary="torque")
    integrator, state = make_integrator(machine, make_scheme(1e-5, 0.8)), initial_state(machine, TORQUE)
    error, size, carried = 0.0, 0.0, []
    for number in range(40):
        new = take_step(integrator, state, TORQUE * (-4.0 if number < 12 else 1.0))
        assert new.converged
        book = ledger(integrator, state, new.state)
        error, size = max(error, abs(book.error)), max(size, *(abs(value) for value in book))
        state = new.state
        carried.append(float(state.force.sum()))
        assert state.force.min(initial=0.0) >= 0.0
    assert error < 1e-9 * size
    assert min(carried) == 0.0 and carried[-1] > 0.0


def test_multipliers_take_over_from_the_penalty() -> None:
    """Four points on springs that know each other: no overlap is left, forces push only, whatever the penalty."""
    rng = np.random.default_rng(3)
    half = rng.standard_normal((4, 4))
    flexibility = half @ half.T + 0.1 * np.eye(4)
    over = np.array([1.0, -0.5, 0.8, 0.3])
    found = [closed_points(flexibility, over, soft, np.zeros(4), np.full(4, 1e-10)) for soft in (0.01, 0.3)]
    for closed in found:
        left = over - flexibility @ closed.force
        assert closed.found and np.all(closed.force >= 0) and left.max() < 1e-9
        assert np.abs(left[closed.force > 0]).max() < 1e-9
    assert found[0].force == pytest.approx(found[1].force, abs=1e-8)


def test_points_that_the_mesh_hardly_tells_apart_are_found() -> None:
    """Two points whose difference moves a thousandth as far as the penalty gives way: the forces are those of the two
    equations, solved by hand."""
    soft, apart, over = 1.0, 1e-3, np.array([1.0, 1.0 - 2e-4])
    flexibility = np.array([[2.0, 2.0 - apart], [2.0 - apart, 2.0]])
    found = closed_points(flexibility, over, soft, np.zeros(2), np.full(2, 1e-9))
    total, difference = over.sum() / (4.0 - apart), (over[0] - over[1]) / apart
    assert found.found
    assert found.force == pytest.approx([(total + difference) / 2, (total - difference) / 2], rel=1e-5)


def test_projection_finds_the_nearest_place(coarse_gear: FullGear) -> None:
    """Points off the outline against a search among ten thousand places on it; normals point out of the tooth."""
    sides = sides_of(coarse_gear, 3, 0.4, np.array([0.01, -0.02]))
    xi = np.tile(np.linspace(-1, 1, 201), len(sides.nodes))
    number = np.repeat(np.arange(len(sides.nodes)), 201)
    shape = np.stack([xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2], axis=-1)
    every = np.einsum("na,nac->nc", shape, sides.nodes[number])
    points = every[150:-150:97] + 2e-5 * np.random.default_rng(1).standard_normal((len(every[150:-150:97]), 2))
    side, place = project(sides, points)
    shape = np.stack([place * (place - 1) / 2, 1 - place**2, place * (place + 1) / 2], axis=-1)
    found = np.einsum("na,nac->nc", shape, sides.nodes[side])
    distance = np.linalg.norm(found - points, axis=1)
    nearest = np.linalg.norm(every[:, None] - points, axis=2).min(axis=0)
    assert np.all(distance < nearest + 1e-7)
    shape = coarse_gear.outline.shape
    own = sides_of(coarse_gear, 0, 0.0, np.zeros(2))
    s = 0.5 * (shape.s_form + shape.s_end)
    side, place = project(own, shape.points(np.array([s])))
    out = outwards(own, side, place, runs_clockwise(coarse_gear))[0]
    assert out == pytest.approx(-coarse_gear.outline.inward(s, 0), abs=2e-2)


def test_gaps_open_with_the_supports(surfaces: Callable[..., Machine]) -> None:
    """Rows are derivatives of the points' gaps: by central differences of the projection itself."""
    machine = surfaces(1.0, boundary="torque")
    step = 1e-7

    def gaps(d: Array) -> Array:
        return -near_surfaces(machine, Angles(1e-4 + d[0], d[1]), d[2:]).met.over

    rows = near_surfaces(machine, Angles(1e-4, 0.0), np.zeros(2)).met.rows
    for number, scale in enumerate((1 / 0.03, 1 / 0.03, 1.0, 1.0)):
        ahead = np.zeros(4)
        ahead[number] = step * scale
        slope = (gaps(ahead) - gaps(-ahead)) / (2 * step * scale)
        assert slope == pytest.approx(rows[:, number], abs=2e-3 / scale)
    assert softness(machine) > 0

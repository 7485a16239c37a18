"""What accelerates leaves the gears' own bodies behind their hubs: by the torsion of a ring that its own inertia loads,
and in the reduced model by what balances the motion of each mode."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.fem.full.machine import Machine
from gearbench.fem.full.transient import lag
from gearbench.fem.motion import machine as small
from gearbench.fem.motion.scheme import make_scheme
from gearbench.fem.motion.start import initial_state
from gearbench.fem.motion.transient import advance
from gearbench.geometry.tooth.body import body
from gearbench.rig import Damping, Load, Support, Supports

Array = NDArray[np.float64]
FREQUENCY = 40.0  # mesh frequency before the run-up [Hz]
PULL = 4e4  # acceleration of the driver [rad/s^2]
TIME = np.array([0.0, 1.0])
SPEED = 2 * pi * FREQUENCY / 20 + PULL * TIME
COURSE = small.STEADY._replace(time=TIME, speed=SPEED, angle=np.array([0.0, SPEED.mean()]))


def twist(gear: Any, material: Any, inertia: float, radius: Array) -> Array:
    """Angle [rad] by which a ring at these radii [m] lags behind the hub that turns it, per acceleration: the moment
    J(beyond r) shears it by moment/(2 pi G b r^2), whatever stands on its rim."""
    b, held = gear.face_width, gear.hub_radius
    shear = material.youngs_modulus / (2 * (1 + material.poisson))
    of_all = inertia * (1 / held**2 - 1 / radius**2) / 2
    of_disc = material.density * pi * b * (radius**2 - held**2) / 4
    return np.asarray((of_all - of_disc) / (2 * pi * shear * b))


def test_a_body_twists_as_a_ring_that_its_inertia_loads(twins: Any, build: Callable[..., Machine]) -> None:
    machine = replace(build(FREQUENCY), course=COURSE)
    found = lag(machine, 1e-4)
    assert found is not None
    rig = twins.rig
    whole = body(twins.pair.driver, rig.driver, rig.material.density).inertia
    # The driven gear turns the other way round.
    for gear, force, way in zip(machine.gears, (found.driver, found.driven), (1.0, -1.0), strict=True):
        field = gear.static.solve(force)
        points = gear.sector.points
        radius = np.hypot(*points.T)
        # Well below the roots, where the pull of single teeth is left as one harmonic of their number.
        ring = (radius > 1.001 * rig.driver.hub_radius) & (radius < 1.12 * rig.driver.hub_radius)
        assert np.count_nonzero(ring) > 20
        x, y = points[ring].T
        for sector in (0, 7):
            moved = field[:, sector].reshape(-1, 2)[ring]
            turned = (x * moved[:, 1] - y * moved[:, 0]) / radius[ring] ** 2
            expected = -way * PULL * twist(rig.driver, rig.material, whole, radius[ring])
            around = gear.teeth * np.arctan2(y, x)
            shapes = np.column_stack([np.ones_like(around), np.cos(around), np.sin(around)])
            mean, *waves = np.linalg.lstsq(shapes, turned / expected, rcond=None)[0]
            assert mean == pytest.approx(1.0, abs=2e-3) and np.abs(waves).max() < 0.05


@pytest.mark.parametrize("boundary", ["speed", "torque"])
def test_modes_balance_what_the_acceleration_takes(twins: Any, boundary: str) -> None:
    held = Support(stiffness=2e7, damping=2e4)
    changes = {
        "support": Supports(driver=held, driven=held),
        "load": Load(boundary=boundary),
        "damping": Damping(material_ratio=1e-5 * pi * 1250.0),
    }
    rig = twins.rig.model_copy(update=changes)
    one = body(twins.pair.driver, rig.driver, rig.material.density)
    machine = small.make_machine(rig, twins.pair, twins.law, twins.gears, (one, one), FREQUENCY, course=COURSE)
    rate = 1e6
    state, _, run = advance(machine, make_scheme(1 / rate, 0.9), initial_state(machine, 100.0), np.full(400, 100.0), 1)
    assert run.failed < 0
    mass = small.mass_matrix(machine, *small.angles(machine, state.d, state.t))
    moving = mass @ state.a + small.damping_matrix(machine) @ state.v + small.stiffness_matrix(machine) @ state.d
    pressed = state.force @ small.contact_rows(machine, state.pairs)
    left = (moving - pressed)[machine.hubs :]
    expected = np.concatenate([-machine.hub1[2] * PULL, machine.hub2[2] * PULL])
    assert np.abs(left - expected).max() < 1e-4 * np.abs(expected).max()

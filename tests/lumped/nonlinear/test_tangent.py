"""Small departures from a motion: against the closed form of a damped oscillator."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.lumped.nonlinear.coordinates import IN_MESH, Acting
from gearbench.lumped.nonlinear.tangent import OVER_STEP, Tangent, departures

MASS, STIFFNESS, DAMPING = 2.0, 3e6, 400.0  # of the oscillator; the mesh has a third of the stiffness
SUBSTEPS, SAMPLES = 4, 512


def oscillator(on_mesh: float) -> tuple[Tangent, float]:
    """One mass between the ground and the mesh, which has `on_mesh` of stiffness and damping, and its rate [rad/s]."""
    duration = 4 * 2 * np.pi / 900.0
    entries = 2 * SUBSTEPS * SAMPLES
    tangent = Tangent(
        springs=np.array([[STIFFNESS * (1 - on_mesh)]]),
        dampers=np.array([[DAMPING * (1 - on_mesh)]]),
        inverse=np.array([1 / MASS]),
        mesh=np.array([1.0]),
        stiffness=np.full(entries, STIFFNESS * on_mesh),
        damping=np.full(entries, DAMPING * on_mesh),
        step=duration / (SUBSTEPS * SAMPLES),
        bearings=np.empty((0, 1)),
        stiffer=np.empty((entries, 0)),
        turned_on=np.zeros(1),
        turning=np.zeros(entries),
        rubbed=np.zeros((entries, 1)),
    )
    return tangent, 900.0


@pytest.mark.parametrize("on_drive", [False, True])
def test_an_oscillator_answers_as_its_receptance_says(on_drive: bool) -> None:
    tangent, rate = oscillator(1 / 3)
    time = np.arange(2 * SUBSTEPS * SAMPLES) * tangent.step / 2
    forces = np.stack([np.cos(rate * time), 5.0 * np.sin(rate * time)], axis=1)
    on = np.full(2, 0 if on_drive else IN_MESH)
    places, pushes = departures(tangent, Acting(forces, on, np.arange(2)), SUBSTEPS, 5 * SUBSTEPS * SAMPLES)
    receptance = 1 / (STIFFNESS - rate**2 * MASS + 1j * rate * DAMPING)
    sign = 1.0 if on_drive else -1.0
    at, steps = time[:: 2 * SUBSTEPS], time[::2]
    for column, amplitude in enumerate((1.0, -5.0j)):
        motion = sign * receptance * amplitude * np.exp(1j * rate * at)
        assert places[:, 0, column] == pytest.approx(motion.real, abs=2e-5 * abs(receptance * amplitude))
        push = (STIFFNESS + 1j * rate * DAMPING) / 3 * sign * receptance + (0.0 if on_drive else 1.0)
        mesh = push * amplitude * np.exp(1j * rate * steps)
        assert pushes[:, column] == pytest.approx(mesh.real, abs=1e-4 * np.abs(mesh).max())


def test_a_mode_too_stiff_for_a_step_is_carried_in_finer_ones() -> None:
    """A rate of six over the step, where Runge-Kutta bears 2.8; the force, far slower, is read between entries."""
    tangent, rate = oscillator(1 / 3)
    stiffness = MASS * (6.0 / tangent.step) ** 2
    damping = 0.2 * np.sqrt(stiffness * MASS)
    stiff = tangent._replace(springs=np.array([[stiffness]]), dampers=np.array([[damping]]))
    force = np.cos(rate * np.arange(2 * SUBSTEPS * SAMPLES) * tangent.step / 2)[:, None]
    acting, early = Acting(force, np.array([0]), np.array([0])), 200
    whole = STIFFNESS / 3 + stiffness - rate**2 * MASS + 1j * rate * (DAMPING / 3 + damping)
    motion = (np.exp(1j * rate * np.arange(SAMPLES) * SUBSTEPS * tangent.step) / whole).real
    places, pushes = departures(stiff._replace(finer=4), acting, SUBSTEPS, early)
    assert places[:, 0, 0] == pytest.approx(motion, abs=1e-4 / abs(whole))
    push = (STIFFNESS + 1j * rate * DAMPING) / 3 / whole
    steps = (push * np.exp(1j * rate * np.arange(SAMPLES * SUBSTEPS) * tangent.step)).real
    assert pushes[:, 0] == pytest.approx(steps, abs=1e-4 * abs(push))
    meant = departures(stiff._replace(finer=4), acting, SUBSTEPS, early, OVER_STEP)[1][:, 0]
    middle = push * np.exp(1j * rate * (np.arange(SAMPLES * SUBSTEPS) + 0.5) * tangent.step)
    assert meant == pytest.approx(middle.real, abs=1e-4 * abs(push))
    assert not np.isfinite(departures(stiff, acting, SUBSTEPS, early)[0]).all()


def test_forces_of_one_departure_add_up() -> None:
    """One on the mass, one in the mesh, which pushes the other way: half of what it does is left."""
    tangent, rate = oscillator(1 / 3)
    wave = np.cos(rate * np.arange(2 * SUBSTEPS * SAMPLES) * tangent.step / 2)
    forces = np.stack([wave, 0.5 * wave, wave], axis=1)
    on, early = np.array([0, IN_MESH, 0]), 5 * SUBSTEPS * SAMPLES
    places, pushes = departures(tangent, Acting(forces, on, np.array([1, 1, 0])), SUBSTEPS, early)
    assert places[:, 0, 1] == pytest.approx(0.5 * places[:, 0, 0], abs=2e-5 * float(np.abs(places).max()))
    assert pushes[:, 1] == pytest.approx(0.5 * pushes[:, 0] + 0.5 * wave[::2], abs=2e-5 * float(np.abs(pushes).max()))

"""Frames of an animation: forces that carry the torque, gears that turn together, instants of a record."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
import xarray as xr

from gearbench.bench.elastic.rig import elastic_rig
from gearbench.bench.errors import BenchError
from gearbench.bench.stress.motion import TEETH, Instant, moving_frames, quarters, recorded_instants
from gearbench.rig import Gear, Material, Rig, Simulation


def small_rig() -> Rig:
    """Two unequal gears of few teeth, coarsely meshed."""
    common = {"module": 3e-3, "face_width": 0.02, "hub_radius": 0.018, "tip_edge_radius": 1e-4, "thinning": 2e-5}
    return Rig(
        driver=Gear(teeth=20, **common), driven=Gear(teeth=30, **common), material=Material(), centre_distance=0.075
    )


@pytest.mark.validation
def test_the_forces_on_the_driver_carry_the_torque() -> None:
    """Moment of the arrows about the driver's axis, against the torque that was asked for."""
    simulation = Simulation(model="reduced", element_size=1e-3, modes=4)
    elastic = elastic_rig(small_rig(), simulation)
    instants = [Instant(0.0, 80.0, 0.0), Instant(0.5, 120.0, 0.0), Instant(0.5, 0.0, 0.0)]
    heard: list[float] = []
    frames = moving_frames(elastic, instants, 1e-3, lambda fraction, note: heard.append(fraction))
    for frame, torque in zip(frames[:2], (80.0, 120.0), strict=True):
        moment = sum(c.middle[0] * c.force[1] - c.middle[1] * c.force[0] for c in frame.contacts)
        assert -moment == pytest.approx(torque, rel=1e-6)
        assert frame.von_mises.shape == (len(frame.points),) and frame.triangles.max() < len(frame.points)
    assert len(frames[0].contacts) == 1 and len(frames[1].contacts) == 2  # at the pitch point, and between two
    assert frames[2].contacts == () and len(frames[2].points) == 0  # nothing carries
    # Half a tooth: both gears have turned by half of their pitch, the driver also by its DTE.
    turned = np.subtract(frames[2].turns, frames[0].turns)
    assert turned[1] == pytest.approx(-pi / 30)
    assert turned[0] == pytest.approx(pi / 20, abs=1e-3)
    assert heard == pytest.approx([1 / 3, 2 / 3, 1.0])


def a_record(**left_out: bool) -> xr.Dataset:
    phase = 2.25 + np.linspace(0.0, 3.0, 301)
    held = {"mesh_phase": phase, "dte": 1e-6 * phase, **{name: 100.0 * (1 + n) + phase for n, name in enumerate(TEETH)}}
    variables = {name: (("realisation", "time"), values[None]) for name, values in held.items() if name not in left_out}
    return xr.Dataset(variables)


def test_instants_of_a_record_have_its_phase_dte_and_tooth_forces() -> None:
    found = recorded_instants(a_record(), 8, 2.0, 0.05)
    assert [one.phase for one in found] == pytest.approx(2.25 + np.arange(8) / 4, abs=0.01)
    for one in found:
        assert one.dte == pytest.approx(1e-6 * one.phase)
        assert one.torque == pytest.approx(0.05 * (600.0 + 3 * one.phase))


def test_a_record_without_tooth_forces_is_refused_with_what_to_do() -> None:
    with pytest.raises(BenchError, match=r'tooth_force_leaving: an animation needs .* simulation.outputs = "teeth"'):
        recorded_instants(a_record(tooth_force_leaving=True), 8, 1.0, 0.05)
    with pytest.raises(BenchError, match="has 3 mesh periods and cycles = 4"):
        recorded_instants(a_record(), 8, 4.0, 0.05)


def test_quarters_cover_the_triangle_once() -> None:
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]])
    points = np.concatenate([corners, (corners + np.roll(corners, -1, axis=0)) / 2])
    small = points[quarters(np.arange(6)[None])]
    sides = small[:, 1:] - small[:, :1]
    areas = 0.5 * (sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    assert areas == pytest.approx([0.5] * 4)

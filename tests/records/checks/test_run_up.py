"""Checks of a run-up: spectra of what does not repeat say nothing of delays and units."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.records.checks.angles import angles_keep_mesh_period
from gearbench.records.checks.contradictions import clocks_agree
from gearbench.records.checks.look import Look
from gearbench.records.checks.mesh_force import accounts_of
from gearbench.records.checks.periods import periods_repeat
from gearbench.records.record import make_record

RATE, SAMPLES, TEETH, RADIUS, INERTIA = 4096.0, 8192, 20, 0.05, 0.01


def look(rise: float) -> Look:
    """Two equal gears that swing against each other at 300 Hz, and ever further the faster they turn; their torques are
    those that Newton's second law asks for at every instant. rise: part of the mesh frequency gained in the record."""
    time = np.arange(SAMPLES) / RATE
    mesh = 50.0 * (time + 0.5 * rise * time**2 * RATE / SAMPLES)
    omega = 2 * np.pi * 300.5
    size = 1e-5 * (1.0 + rise * time)
    swing = size * np.sin(omega * time)
    rate = -size * omega**2 * np.sin(omega * time) + 2e-5 * rise * omega * np.cos(omega * time)
    torque = 100.0 + 5.0 * np.sin(2 * np.pi * 310 * time)
    force = (torque - INERTIA * rate) / RADIUS
    turned = 2 * np.pi / TEETH * mesh
    channels = {
        "angle_driver": turned + swing,
        "angle_driven": turned - swing,
        "torque_driver": torque,
        "torque_driven": force * RADIUS + INERTIA * rate,
        "mesh_phase": mesh,
    }
    gears = {f"{name}_{gear}": value for gear in ("driver", "driven") for name, value in
             (("teeth", TEETH), ("base_radius", RADIUS), ("inertia", INERTIA))}  # fmt: skip
    about = {"sampling_rate": RATE, "samples_per_period": SAMPLES // 2, "periods": 2, "driven_boundary": "torque"}
    attributes = {**gears, **about, "working_pressure_angle": np.pi / 9, "settling_residual": 0.0}
    return Look(make_record({name: values[None] for name, values in channels.items()}, attributes))


@pytest.mark.parametrize("rise", [0.0, 1.0])
def test_only_a_constant_speed_has_accounts(rise: float) -> None:
    found = look(rise)
    assert found.steady == (rise == 0.0)
    assert (accounts_of(found) is None) == (rise > 0.0)
    if rise:
        assert not clocks_agree(found) and not periods_repeat(found)


@pytest.mark.parametrize(("teeth", "refused"), [(TEETH, 0), (TEETH + 1, 1)])
def test_a_speed_that_wanders_by_part_of_a_cycle_has_the_mesh_frequency_of_its_phase(
    teeth: int, refused: int
) -> None:
    """Its ends say another mean than a straight line, by 5 % here."""
    time = np.arange(SAMPLES) / RATE
    mesh = 50.0 * (time - 0.2 / (2 * np.pi * 0.65) * (np.cos(2 * np.pi * 0.65 * time + 0.4) - np.cos(0.4)))
    record = look(0.0).record.copy(deep=True)
    record["mesh_phase"].values[0] = mesh
    for gear in ("driver", "driven"):
        record[f"angle_{gear}"].values[0] = 2 * np.pi / TEETH * mesh
    record.attrs.update(teeth_driver=teeth, periods=1, samples_per_period=SAMPLES)
    assert len(angles_keep_mesh_period(Look(record))) == refused

"""Checks of a run-up: what contradicts itself is found where nothing repeats."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.records.checks.angles import angles_follow_mesh_phase, angles_keep_mesh_period
from gearbench.records.checks.boundary import inertias_as_declared
from gearbench.records.checks.contradictions import gears_not_swapped
from gearbench.records.checks.periods import periods_repeat
from gearbench.records.clocks.late import clocks_agree
from gearbench.records.record import make_record
from gearbench.records.seen.look import GEARS, Look
from gearbench.records.seen.mesh_force import accounts_of

Array = NDArray[np.float64]

RATE, SAMPLES, TEETH, RADIUS = 4096.0, 8192, 20, 0.05
INERTIA = {"driver": 0.01, "driven": 0.03}


def look(rise: float, late: float = 0.0) -> Look:
    """Two gears of one size that swing at three frequencies, and ever further the faster they turn; their torques are
    those that Newton's second law asks for at every instant. rise: part of the mesh frequency gained in the record;
    late: samples by which angle_driver is."""
    time = np.arange(SAMPLES) / RATE
    mesh, _, rate = motion(time, rise, (1.0, 1.0, 1.0))
    _, second, other = motion(time, rise, (-1.0, -0.3, 0.5))
    torque = 100.0 + 5.0 * np.sin(2 * np.pi * 310 * time) + 4.0 * np.sin(2 * np.pi * 430 * time)
    force = (torque - INERTIA["driver"] * rate) / RADIUS
    seen = motion(time - late / RATE, rise, (1.0, 1.0, 1.0))
    channels = {
        "angle_driver": 2 * np.pi / TEETH * seen[0] + seen[1],
        "angle_driven": 2 * np.pi / TEETH * mesh + second,
        "torque_driver": torque,
        "torque_driven": force * RADIUS - INERTIA["driven"] * other,
        "mesh_phase": mesh,
    }
    gears = {f"{name}_{gear}": value for gear in ("driver", "driven") for name, value in
             (("teeth", TEETH), ("base_radius", RADIUS), ("inertia", INERTIA[gear]))}  # fmt: skip
    about = {"sampling_rate": RATE, "samples_per_period": SAMPLES // 2, "periods": 2, "driven_boundary": "torque"}
    attributes = {**gears, **about, "working_pressure_angle": np.pi / 9, "settling_residual": 0.0}
    return Look(make_record({name: values[None] for name, values in channels.items()}, attributes))


def motion(time: Array, rise: float, sizes: tuple[float, float, float]) -> tuple[Array, Array, Array]:
    """Mesh phase [cycles], swing [rad] of a gear and its second derivative [rad/s^2] at times (n,) [s]."""
    mesh = 50.0 * (time + 0.5 * rise * time**2 * RATE / SAMPLES)
    size, swing, rate = 4e-5 * (1.0 + rise * time), np.zeros_like(time), np.zeros_like(time)
    for frequency, part in zip((300.5, 410.5, 520.5), sizes, strict=True):
        omega = 2 * np.pi * frequency
        swing += part * size * np.sin(omega * time)
        rate -= part * (size * omega**2 * np.sin(omega * time) - 8e-5 * rise * omega * np.cos(omega * time))
    return mesh, swing, rate


def test_accounts_of_a_run_up_balance_as_those_of_a_constant_speed() -> None:
    """Both gears' forces are one by Newton's law at every instant, for derivatives taken by hand."""
    for rise in (0.0, 0.05, 1.0):
        found = look(rise)
        accounts = accounts_of(found)
        assert found.tapered == (rise > 0) and accounts is not None
        assert float(accounts.misfit(GEARS)[0]) < 1e-6
        assert not clocks_agree(found) and (found.steady or not periods_repeat(found))


@pytest.mark.parametrize("rise", [0.0, 1.0])
def test_what_contradicts_itself_in_a_run_up_is_found(rise: float) -> None:
    """Driver and driven exchanged, an angle two samples late, a straight mesh phase, another gear's inertia."""
    swapped = look(rise).record.copy(deep=True)
    for name in ("angle", "torque"):
        for gear, other in (GEARS, GEARS[::-1]):
            swapped[f"{name}_{gear}"].values[:] = look(rise).record[f"{name}_{other}"].values
    swapped.attrs.update(inertia_driver=INERTIA["driven"], inertia_driven=INERTIA["driver"])
    (finding,) = gears_not_swapped(Look(swapped))
    assert finding.refused

    late = look(rise, late=2).record
    (finding,) = clocks_agree(Look(late))
    assert finding.sentence.startswith("angle_driver lags behind the other channels by")
    assert float(finding.sentence.split("(")[1].split(" samples")[0]) == pytest.approx(2.0, abs=0.05)

    if rise:
        straight = look(rise).record.copy(deep=True)
        phase = straight.mesh_phase.values[0]
        phase[:] = np.linspace(phase[0], phase[-1], phase.size)
        (finding,) = angles_follow_mesh_phase(Look(straight))
        assert finding.refused and "departs from mesh_phase by" in finding.sentence
    assert angles_follow_mesh_phase(look(rise)) == []

    heavy = look(rise).record.assign_attrs(inertia_driver=2 * INERTIA["driver"])
    (finding,) = inertias_as_declared(Look(heavy))
    assert "balance with 0.01 kg m^2" in finding.sentence


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

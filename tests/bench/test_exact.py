"""The exact response of a lumped rig: whichever of the two models stands for it, and however sharp its switches are."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.bench import simulate
from gearbench.bench.nonlinear.static import linearised_matrices
from gearbench.bench.refusals.effects import is_nonlinear
from gearbench.bench.results import exact
from gearbench.bench.results.exact import lumped_periodic_system
from gearbench.cases import case_path
from gearbench.geometry import pair
from gearbench.identification.truth.monodromy import exact_itf
from gearbench.identification.truth.periodic import PeriodicSystem
from gearbench.lumped import lumped_model, periodic_matrices
from gearbench.rig import Case, read_case

FREQUENCY, PHASE = np.linspace(800.0, 2000.0, 7), np.arange(64) / 64
NOISE = "rig.sensors.noise_torque_nm=0.01"


def rig(*changes: str) -> Case:
    return read_case(case_path("quick_lumped"), list(changes))


def test_noise_of_a_sensor_changes_no_exact_response() -> None:
    """It takes the non-linear model, whose linearised mesh must have its switches where the linear one's are: half a
    piece of 1024 later they cost 0.5 to 2 %."""
    plain, noisy = rig(), rig(NOISE)
    assert is_nonlinear(noisy) and not is_nonlinear(plain)
    one, other = (exact_itf(lumped_periodic_system(case), FREQUENCY, PHASE) for case in (plain, noisy))
    assert np.linalg.norm(other - one) < 5e-4 * np.linalg.norm(one)


@pytest.mark.parametrize("more", [(), (NOISE,)])
def test_sharp_switches_are_where_far_finer_pieces_have_them(
    more: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    case = rig("simulation.stiffness_edge=0", *more)
    monkeypatch.setattr(exact, "MOST_PHASES", 2048)
    meshing, fine = pair(case.rig), 32768
    if more:
        matrices = linearised_matrices(case, meshing, fine)
    else:
        model = lumped_model(case.rig, meshing, case.simulation)
        _, b, c = periodic_matrices(model, fine)
        # As wide as two pieces of the coarse grid.
        matrices = (model.state_matrix(model.stiffness.at(np.arange(fine) / fine, finest=2.0 / 2048)), b, c)
    system = lumped_periodic_system(case)
    assert (system.phases, system.interpolation) == (2048, "piecewise")
    one, other = (exact_itf(s, FREQUENCY, PHASE) for s in (PeriodicSystem(system.period, *matrices), system))
    assert np.linalg.norm(other - one) < 1e-3 * np.linalg.norm(one)


@pytest.mark.parametrize("direction", ["tangential", "line-of-action"])
def test_small_vibrations_of_the_nonlinear_rig_are_those_of_the_exact_response(direction: str) -> None:
    """What two records differ by whose torques differ by little. Gears whose centres move across the line between them
    turn the mesh, at rest and as they vibrate."""
    case = rig(
        f"rig.support.direction={direction}", "rig.support.stiffness_n_per_m=2e8", "experiment.mesh_frequency_hz=16",
        "experiment.multisine.amplitude_nm=0.5", "experiment.multisine.band_hz=[600, 1400]", "experiment.periods=1",
        "experiment.realisations=2", "experiment.settling_tolerance=1e-9", "rig.sensors.noise_torque_nm=1e-12",
        "simulation.substeps=16",
    )  # fmt: skip
    record = simulate(case)
    samples, cycle = record.sizes["time"], 1024
    force, dte = (np.diff(record[name].values, axis=0)[0] for name in ("force", "dte"))
    spectrum = np.fft.rfft(force)
    lines = np.flatnonzero(np.abs(spectrum) > 1e-6 * np.abs(spectrum).max())
    time, phase = np.arange(samples), np.arange(cycle) / cycle + record["mesh_phase"].values[0, 0]
    response = exact_itf(lumped_periodic_system(case), lines * 16384.0 / samples, phase % 1.0)
    waves = np.exp(2j * np.pi * np.outer(lines, time) / samples) * spectrum[lines, None] * 2 / samples
    expected = (response[:, time % cycle] * waves).sum(axis=0).real
    assert np.linalg.norm(dte - expected) < 2e-3 * np.linalg.norm(expected)

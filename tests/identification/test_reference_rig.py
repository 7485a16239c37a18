"""The reference rig's time integration against a second integrator and against the exact ITF."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shared.reference_rig import ReferenceRig, integrate, reference_record

from gearbench.identification.excitation.multisine import random_phase_multisine
from gearbench.identification.truth.monodromy import exact_itf


def test_stiffness_law() -> None:
    rig = ReferenceRig()
    assert rig.stiffness(0.3) == pytest.approx(1.2e8)  # middle of the double zone
    assert rig.stiffness(0.8) == pytest.approx(0.6e8)  # middle of the single zone
    assert rig.stiffness(0.05) == pytest.approx(1.2e8 * (1 - 0.06 * (0.25 / 0.3) ** 2))
    assert rig.stiffness(0.985) == pytest.approx(0.6e8 * (1 - 0.06 * (0.185 / 0.2) ** 2))
    assert rig.stiffness(0.6) == pytest.approx(0.94 * (0.6e8 + 1.2e8) / 2)  # half-way through the edge
    assert rig.stiffness([-0.2, 1.8]) == pytest.approx([0.6e8, 0.6e8])


@pytest.mark.validation
def test_integration_against_dop853_in_second_order_form() -> None:
    """Equations of motion typed in again, adaptive Runge-Kutta, settled from rest."""
    rig = ReferenceRig(mesh_frequency=100.0)
    signal = random_phase_multisine(512, 12800.0, (100.0, 3000.0), amplitude=400.0, rng=np.random.default_rng(0))
    found = integrate(rig, [signal], mean=1500.0, start_phase=0.13)[0]

    def slope(t: float, z: np.ndarray) -> list[float]:
        x, y1, y2, vx, v1, v2 = z
        k = float(rig.stiffness(0.13 + 100.0 * t))
        mesh = k * (x + y1 - y2) + 2 * 0.05 * np.sqrt(k * 1.0) * (vx + v1 - v2)
        force = 1500.0 + float((signal.spectrum * np.exp(2j * np.pi * signal.frequency * t)).sum().real)
        return [
            vx,
            v1,
            v2,
            force - mesh,
            (-mesh - 3.2e8 * y1 - 2 * 0.03 * np.sqrt(3.2e8 * 2.0) * v1) / 2.0,
            (mesh - 4.5e8 * y2 - 2 * 0.03 * np.sqrt(4.5e8 * 2.6) * v2) / 2.6,
        ]

    start, end = -3 * signal.period, 0.5 * signal.period
    instants = np.arange(0, 256, 16) / 12800.0
    settled = solve_ivp(slope, (start, end), np.zeros(6), method="DOP853", rtol=1e-8, atol=1e-15, t_eval=instants)
    wanted = settled.y[0] + settled.y[1] - settled.y[2]
    assert found[:256:16] == pytest.approx(wanted, abs=1e-5 * np.abs(wanted).max())


def test_response_has_the_spectrum_that_the_exact_itf_predicts() -> None:
    """One sine in: sidebands G_l at f + l f_mesh."""
    rig = ReferenceRig(mesh_frequency=64.0)
    signal = random_phase_multisine(1024, 16384.0, (1008.0, 1008.0), amplitude=1.0, rng=np.random.default_rng(1))
    spectrum = np.fft.rfft(integrate(rig, [signal], start_phase=0.4)[0]) / 512
    itf = exact_itf(rig.system(1024), 1008.0, np.arange(1024) / 1024, steps=8192)[0]
    htf = np.fft.fft(itf) / 1024
    for branch in range(-6, 7):
        line = 63 + 4 * branch
        # The record begins at phase 0.4.
        wanted = htf[branch] * signal.spectrum[0] * np.exp(2j * np.pi * branch * 0.4)
        assert spectrum[line] == pytest.approx(wanted, abs=2e-6 * np.abs(htf).max())


def test_record_of_the_reference_rig() -> None:
    record = reference_record(
        ReferenceRig(mesh_frequency=64.0), realisations=3, duration=0.125, noise=0.1, start_phase=0.3
    )
    assert record.sizes == {"realisation": 3, "time": 1024}
    assert record.mesh_phase.values[:, 0].tolist() == [0.3, 0.3, 0.3]
    assert record.mesh_phase.values[0, 128] == pytest.approx(1.3)
    clean = reference_record(ReferenceRig(mesh_frequency=64.0), realisations=3, duration=0.125, start_phase=0.3)
    induced = (clean.dte - clean.dte.mean("realisation")).values.std()
    assert (record.dte - clean.dte).values.std() == pytest.approx(0.1 * induced, rel=0.05)
    with pytest.raises(ValueError, match="whole number of mesh periods"):
        reference_record(ReferenceRig(mesh_frequency=3.0), realisations=1, duration=1.1)

"""Driver torque: independent, reproducible realisations on any grid."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.bench.excitation import torque_realisation
from gearbench.rig import Experiment, Gear, Multisine, Rig, Support, Supports


def make_rig(teeth_driver: int = 20, teeth_driven: int = 30) -> Rig:
    gears = [Gear(teeth=z, module=3e-3, face_width=0.023, hub_radius=0.016) for z in (teeth_driver, teeth_driven)]
    support = Support(stiffness=1e8)
    return Rig(driver=gears[0], driven=gears[1], support=Supports(driver=support, driven=support))


def make_experiment(**changes: Any) -> Experiment:
    values: dict[str, Any] = {
        "mesh_frequency": 20.0,
        "torque_mean": 10.0,
        "sampling_rate": 1000.0,
        "samples_per_period": 500,
        "seed": 4,
        "multisine": Multisine(amplitude=2.0, band=(10.0, 300.0)),
    }
    return Experiment(**{**values, **changes})


def test_mean_and_peak_are_those_of_the_experiment() -> None:
    torque = torque_realisation(make_experiment(), 0, make_rig()).sample(50_000)
    assert torque.mean() == pytest.approx(10.0)
    assert np.abs(torque - 10.0).max() == pytest.approx(2.0, rel=0.01)


def test_finer_grids_pass_through_the_coarse_samples() -> None:
    torque = torque_realisation(make_experiment(), 0, make_rig())
    coarse = torque.sample(1000)
    np.testing.assert_allclose(torque.sample(6000)[::6], coarse, atol=1e-12)
    spectrum = np.abs(np.fft.rfft(torque.sample(6000)))
    assert spectrum[151:].max() < 1e-9 * spectrum[5:151].max()


def test_realisations_are_reproducible_and_independent() -> None:
    first, again, second = (torque_realisation(make_experiment(), n, make_rig()).sample(1000) - 10 for n in (0, 0, 1))
    np.testing.assert_array_equal(first, again)
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.25
    other = torque_realisation(make_experiment(seed=5), 0, make_rig()).sample(1000) - 10
    assert abs(np.corrcoef(first, other)[0, 1]) < 0.25


def test_no_multisine_is_a_constant_torque() -> None:
    np.testing.assert_array_equal(
        torque_realisation(make_experiment(multisine=None), 3, make_rig()).sample(7), np.full(7, 10.0)
    )

"""Driver torque: independent, reproducible realisations on any grid."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.bench import BenchError
from gearbench.bench.plan.excitation import Torque, comb_for, torque_realisation
from gearbench.bench.plan.schedule import schedule
from gearbench.cases import case_path
from gearbench.identification.excitation.comb import ranked_residues, residue_of
from gearbench.rig import Experiment, Gear, Multisine, Rig, Support, Supports, read_case


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


def comb_experiment(residue: int | None = None, **changes: Any) -> Experiment:
    """A period of 60 teeth: one hunting period of 20/30 teeth."""
    multisine = Multisine(amplitude=2.0, band=(10.0, 300.0), grid="comb", residue=residue, crest=2.5)
    return make_experiment(**{"samples_per_period": 3000, "multisine": multisine, **changes})


def excited(torque: Torque, samples: int) -> np.ndarray:
    spectrum = np.abs(np.fft.rfft(torque.sample(samples) - torque.mean))
    return np.flatnonzero(spectrum > 1e-6 * spectrum.max())


def test_a_comb_excites_its_residue_modulo_the_hunting_period() -> None:
    for residue in (7, None):
        comb = comb_for(comb_experiment(residue), make_rig())
        assert comb is not None and comb.modulus == 60
        lines = excited(torque_realisation(comb_experiment(residue), 0, make_rig()), 3000)
        expected = residue or ranked_residues(60, 20, 30)[0]
        assert set(lines % 60) == {expected, 60 - expected} == {comb.residue(0), 60 - comb.residue(0)}
        assert lines.min() >= 30 and lines.max() <= 900  # 10 to 300 Hz in steps of 1/3 Hz


def test_two_hunting_periods_double_the_modulus() -> None:
    longer = comb_experiment(samples_per_period=6000)
    comb = comb_for(longer, make_rig())
    assert comb is not None and (comb.modulus, comb.residue(0)) == (120, ranked_residues(120, 20, 30)[0])
    lines = excited(torque_realisation(longer, 0, make_rig()), 6000)
    assert set(lines % 120) == {comb.residue(0), 120 - comb.residue(0)}


def test_realisations_step_through_the_best_residues_unless_one_is_given() -> None:
    best = ranked_residues(60, 20, 30)
    several = comb_experiment(realisations=60)
    comb = comb_for(several, make_rig())
    assert comb is not None and comb.residues == tuple(best)
    for number in (0, 1, 4, best.size):
        lines = excited(torque_realisation(several, number, make_rig()), 3000)
        assert set(lines % 60) >= {best[number % best.size]}
    held = comb_for(comb_experiment(7, realisations=60), make_rig())
    assert held is not None and {held.residue(number) for number in range(60)} == {7}


@pytest.mark.parametrize(
    ("changes", "teeth", "words"),
    [
        ({"samples_per_period": 2000}, (20, 30), ["60 teeth", "20 and 30", "3 s at 20 Hz", "2 s", "= 3000 or a"]),
        ({"samples_per_period": 1500}, (20, 30), ["lasts 1.5 s", "samples_per_period = 3000"]),
        ({"mesh_frequency": 20.01}, (20, 30), ["samples_per_period = 2999", "mesh_frequency_hz = 20.00666"]),
        ({}, (62, 63), ["3906 teeth", "195.3 s", "= 195300", 'grid "full" or "odd"', "one shaft"]),
        ({}, (997, 991), ["988027 teeth", "more than 16777216 samples", "smaller lcm"]),
        ({"residue": 30}, (20, 30), ["residue = 30", "between 1 and 29"]),
    ],
)
def test_combs_that_do_not_fit_are_refused(
    changes: dict[str, Any], teeth: tuple[int, int], words: list[str]
) -> None:
    with pytest.raises(BenchError) as caught:
        torque_realisation(comb_experiment(**changes), 0, make_rig(*teeth))
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_the_suggested_period_fits() -> None:
    advised = comb_experiment(mesh_frequency=60 * 1000.0 / 2999, samples_per_period=2999)
    comb = comb_for(advised, make_rig())
    assert comb is not None and comb.modulus == 60


def test_every_condition_of_the_demonstration_has_its_comb() -> None:
    case = read_case(case_path("gap_demo"))
    found = {}
    for condition in case.conditions:
        experiment = condition.experiment
        lines = excited(torque_realisation(experiment, 0, case.rig), experiment.samples_per_period)
        assert residue_of(lines, 60) == 13
        assert schedule(experiment, case.rig).mesh_cycles == 60
        assert experiment.multisine is not None
        found[condition.name] = (experiment.torque_mean, experiment.multisine.amplitude, lines.size)
    # Two lines to each mesh order from 20 to 3000 Hz.
    assert found == {
        "base": (100.0, 40.0, 119),
        "light": (40.0, 60.0, 119),
        "fast": (90.0, 40.0, 99),
        "held-out": (80.0, 40.0, 119),
    }

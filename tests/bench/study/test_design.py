"""Members of a study: grids, hypercubes and Saltelli's design are what their definitions say."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest, norm

from gearbench.bench import BenchError
from gearbench.bench.study.design import design_of, factor_of
from gearbench.rig import CaseError, Study

RELIEF, SHIFT = "rig.driver.tip_relief_um", "rig.driver.profile_shift"


def study(*vary: str, **options: object) -> Study:
    return Study.model_validate({"vary": vary, **options})


def numbers(one: Study) -> np.ndarray:
    return np.array(design_of(one).members, dtype=float)


def test_a_grid_is_every_combination_in_order() -> None:
    found = design_of(study(f"{RELIEF}=0:10:3", "rig.driver.teeth=20,21"))
    assert found.members == tuple((r, z) for r in ("0.0", "5.0", "10.0") for z in ("20", "21"))
    assert found.settings(3) == [f"{RELIEF}=5.0", "rig.driver.teeth=21"]


def test_keys_that_move_together_get_the_same_value() -> None:
    found = design_of(study(f"{RELIEF}+rig.driven.tip_relief_um=1,2"))
    assert found.settings(1) == [f"{RELIEF}=2", "rig.driven.tip_relief_um=2"]


def test_a_latin_hypercube_has_one_member_in_every_slice() -> None:
    values = numbers(study(f"{RELIEF}=0:40", f"{SHIFT}=-1:1", sample="lhs", size=50, seed=3))
    for column, (low, high) in enumerate(((0.0, 40.0), (-1.0, 1.0))):
        slices = np.floor(50 * (values[:, column] - low) / (high - low)).astype(int)
        assert sorted(slices) == list(range(50))


def test_a_normal_factor_is_normal() -> None:
    values = numbers(study(f"{RELIEF}=normal(20,3)", sample="lhs", size=400))
    assert kstest(values[:, 0], norm(20, 3).cdf).pvalue > 0.9


def test_whole_numbers_and_levels_are_equally_likely() -> None:
    values = numbers(study("rig.driver.iso_seed=0:9", f"{RELIEF}=1,2,4", sample="lhs", size=300))
    assert np.unique(values[:, 0], return_counts=True)[1].tolist() == [30] * 10
    assert np.unique(values[:, 1], return_counts=True)[1].tolist() == [100, 100, 100]


def test_saltellis_design_exchanges_one_factor_at_a_time() -> None:
    values = numbers(study(f"{RELIEF}=0:40", f"{SHIFT}=-1:1", sample="sobol", size=16, seed=1))
    a, b, first, second = values.reshape(4, 16, 2)
    assert (first == np.stack([b[:, 0], a[:, 1]], axis=1)).all()
    assert (second == np.stack([a[:, 0], b[:, 1]], axis=1)).all()
    # A Sobol sequence: each sixteenth of the range holds one point of A and one of B.
    for part in (a, b):
        assert sorted(np.floor(16 * part[:, 0] / 40.0).astype(int)) == list(range(16))


def test_the_seed_decides() -> None:
    draw = {seed: numbers(study(f"{RELIEF}=0:40", sample="lhs", size=9, seed=seed)) for seed in (1, 2)}
    assert (draw[1] != draw[2]).any()
    assert (draw[1] == numbers(study(f"{RELIEF}=0:40", sample="lhs", size=9, seed=1))).all()


@pytest.mark.parametrize(
    ("vary", "sentence"),
    [
        ("rig.driver.tip_relif_um=1,2", "did you mean tip_relief_um"),
        ("rig.driver.teeth=normal(20,2)", "no normal distribution"),
        ("rig.driver.teeth=20:21:3", "20.5 would be among"),
        ("rig.driver.teeth=20.5,21", "20.5 must be a whole number"),
        ("rig.driver.tip_relief_um=a,b", "a must be a number"),
        ("simulation.model=1:2", "is no number"),
        ("rig.driver.tip_relief_um+rig.driver.face_width_mm=1,2", "must have the same unit"),
    ],
)
def test_values_that_a_key_cannot_have_are_refused(vary: str, sentence: str) -> None:
    with pytest.raises(CaseError, match=sentence):
        factor_of(vary)


@pytest.mark.parametrize(
    ("one", "sentence"),
    [
        (study(), "nothing varies"),
        (study(f"{RELIEF}=0:40"), "LOW:HIGH:COUNT, or add --sample"),
        (study(f"{RELIEF}=normal(1,2)"), "has no levels"),
        (study(f"{RELIEF}=0:40", sample="sobol", size=100), "64 or 128"),
        (study(f"{RELIEF}=0:40:2000", f"{SHIFT}=0:1:2000"), "at most 1000000"),
    ],
)
def test_samples_that_do_not_fit_are_refused(one: Study, sentence: str) -> None:
    with pytest.raises(BenchError, match=sentence):
        design_of(one)

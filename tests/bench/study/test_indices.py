"""Sensitivity indices against closed forms: Ishigami's function, an additive linear model, a grid by hand."""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np
import pytest
import xarray as xr
from scipy.stats import sobol_indices

from gearbench.bench.study.design import Design, design_of
from gearbench.bench.study.indices import Effects, between_bins, effects_of, on_grid, saltelli
from gearbench.bench.study.quantities import Column
from gearbench.bench.study.table import study_dataset
from gearbench.rig import Study
from gearbench.words.study import decider

# Any keys that may be negative stand for the variables.
KEYS = ("rig.driver.profile_shift", "rig.driven.profile_shift", "rig.driver.profile_slope_um")


def ishigami(x: np.ndarray) -> np.ndarray:
    return np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


# Ishigami and Homma 1990, a = 7, b = 0.1: variances by hand.
FIRST = 0.5 * (1 + 0.1 * pi**4 / 5) ** 2
SECOND = 7**2 / 8
BOTH = 8 * 0.1**2 * pi**8 / 225
ALL = FIRST + SECOND + BOTH


def table_of(design: Design, values: np.ndarray) -> xr.Dataset:
    rows = [{"y": float(value)} if np.isfinite(value) else {} for value in values]
    return study_dataset(design, [Column("y", "um", "a result")], rows, [""] * len(rows), [[]] * len(rows), {})


def found(
    model: Callable[[np.ndarray], np.ndarray], ranges: list[str], missing: slice | None = None, **options: object
) -> Effects:
    vary = [f"{key}={text}" for key, text in zip(KEYS, ranges, strict=False)]
    design = design_of(Study.model_validate({"vary": vary, **options}))
    values = model(np.array(design.members, dtype=float))
    if missing is not None:
        values[missing] = np.nan
    return effects_of(design, table_of(design, values), "y")


CIRCLE = f"{-pi:.12g}:{pi:.12g}"


def test_sobol_indices_of_ishigamis_function() -> None:
    effects = found(ishigami, [CIRCLE] * 3, sample="sobol", size=2048, seed=1)
    first = [FIRST / ALL, SECOND / ALL, 0.0]
    total = [(FIRST + BOTH) / ALL, SECOND / ALL, BOTH / ALL]
    for one, s, t in zip(effects.each, first, total, strict=True):
        assert one.first == pytest.approx(s, abs=0.02) and one.total == pytest.approx(t, abs=0.02)
        assert one.first_interval[0] <= s <= one.first_interval[1]
        assert one.total_interval[0] <= t <= one.total_interval[1]
        assert one.first_interval[1] - one.first_interval[0] < 0.1


def test_members_that_failed_take_their_base_point_with_them() -> None:
    effects = found(ishigami, [CIRCLE] * 3, missing=slice(0, 300), sample="sobol", size=2048, seed=1)
    assert effects.members == 5 * (2048 - 300)
    assert effects.each[1].first == pytest.approx(SECOND / ALL, abs=0.04)


def test_indices_agree_with_scipys() -> None:
    """Which takes Saltelli's and Jansen's estimators: others, on the same samples."""
    from scipy.stats import qmc

    points = 2 * pi * (qmc.Sobol(6, rng=3).random(4096) - 0.5)
    a, b = points[:, :3], points[:, 3:]
    mixed = [np.where(np.arange(3) == factor, b, a) for factor in range(3)]
    blocks = np.stack([ishigami(one) for one in (a, b, *mixed)])
    theirs = sobol_indices(func={"f_A": blocks[:1], "f_B": blocks[1:2], "f_AB": blocks[2:, None, :]}, n=4096)
    first, total = saltelli(blocks)
    assert first == pytest.approx(theirs.first_order, abs=0.02)
    assert total == pytest.approx(theirs.total_order, abs=0.02)


def test_a_factor_that_decides_alone_shows_so_with_few_points() -> None:
    effects = found(lambda x: np.exp(x[:, 0]), ["0:1"] * 2, sample="sobol", size=8)
    assert effects.each[0].first == pytest.approx(1.0) and effects.each[1].total == pytest.approx(0.0, abs=1e-12)


def test_an_additive_linear_model_has_the_squares_of_its_slopes() -> None:
    slopes = np.array([1.0, 2.0, 3.0])
    expected = slopes**2 / (slopes**2).sum()
    sobol = found(lambda x: x @ slopes, ["0:1"] * 3, sample="sobol", size=512)
    cube = found(lambda x: x @ slopes, ["0:1"] * 3, sample="lhs", size=400, seed=2)
    for one, other, s in zip(sobol.each, cube.each, expected, strict=True):
        assert one.first == pytest.approx(s, abs=0.02) and one.total == pytest.approx(s, abs=0.02)
        # Eight bins lose what varies inside them, a sixty-fourth; r^2 of n points errs by 2 r (1 - r^2) / sqrt(n).
        error = 2 * np.sqrt(s) * (1 - s) / np.sqrt(400)
        assert other.first == pytest.approx(s * (1 - 1 / 64), abs=3 * error)
        assert other.trend == pytest.approx(np.sqrt(s), abs=0.05)
        assert np.isnan(other.total)


def test_chance_decides_nothing() -> None:
    """Without the correction eight bins of 40 members seem to hold a fifth of pure noise."""
    rng = np.random.default_rng(5)
    groups = np.repeat(np.arange(8), 5)
    each = [between_bins(groups, rng.normal(size=40)) for _ in range(200)]
    assert np.mean(each) < 0.08
    everything = between_bins(groups, np.repeat(np.arange(8.0), 5))
    assert everything == pytest.approx(1.0)


def test_a_grid_is_exact() -> None:
    """y = x1 x2 on {-1, 1} x {0, 1, 2}: by hand, variances of the main effects and of the interaction."""
    effects = found(lambda x: x[:, 0] * x[:, 1], ["-1,1", "0,1,2"])
    one, two = effects.each
    everything = 5 / 3  # E[x1^2 x2^2]
    assert (one.first, two.first) == pytest.approx((1 / everything, 0.0))
    assert (one.total, two.total) == pytest.approx((1.0, (2 / 3) / everything))
    assert (one.low, one.high, two.least, two.most) == pytest.approx((-1.0, 1.0, 0.0, 0.0))
    assert np.isnan(one.first_interval[0]) and effects.method.startswith("exact")


def test_a_level_at_which_everything_fails_leaves_a_grid() -> None:
    effects = found(lambda x: np.where(x[:, 1] == 3, np.nan, x[:, 0] * x[:, 1]), ["-1,1", "0,1,2,3"])
    assert effects.each[1].total == pytest.approx(0.4) and effects.method.startswith("exact")
    broken = found(lambda x: x[:, 0] * x[:, 1], ["-1,1", "0,1,2"], missing=slice(1, 2))
    assert "bins" in broken.method and broken.members == 5


def test_what_does_not_vary_has_no_indices() -> None:
    for options in ({}, {"sample": "lhs", "size": 8}, {"sample": "sobol", "size": 8}):
        effects = found(lambda x: np.full(len(x), 2.0), ["-1,1", "0,1"], **options)
        assert all(np.isnan(one.first) for one in effects.each)


def test_a_factor_of_which_one_value_has_results_has_no_indices() -> None:
    effects = found(lambda x: np.where(x[:, 1] > 0, np.nan, x[:, 0]), ["-1,1", "0,1,2"])
    one, two = effects.each
    assert one.first == one.total == 1.0
    assert np.isnan(two.first) and np.isnan(two.total)
    assert decider(effects) == ""


def test_on_grid_of_an_additive_function_sums_to_one() -> None:
    values = np.add.outer(np.array([0.0, 1.0, 4.0]), np.array([0.0, 10.0]))
    first, total = on_grid(values)
    assert first == pytest.approx(total) and first.sum() == pytest.approx(1.0)

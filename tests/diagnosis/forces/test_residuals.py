"""Force residuals: their derivatives against differences, and their covariance against dense linear algebra."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.linalg import norm
from shared.synthetic import measurement

from gearbench.bench import simulate
from gearbench.diagnosis.diagnosis import take_in
from gearbench.diagnosis.effects.library import all_unknowns
from gearbench.diagnosis.evidence.problem import problem_of
from gearbench.diagnosis.forces.condition import Condition, prepare
from gearbench.diagnosis.forces.covariance import Blocks, cost_of, cut, missing, split, whitened
from gearbench.diagnosis.forces.equations import DELAYED, PLACES, Equation
from gearbench.diagnosis.forces.jacobian import linearised
from gearbench.diagnosis.forces.mesh import corrected, mesh
from gearbench.diagnosis.forces.nominal import NominalModel, nominal_model
from gearbench.diagnosis.forces.residuals import Residuals, coupling_compliance, residuals
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.forces.volume import log_volume, log_volume_gradient, stiffening_gradient
from gearbench.rig import read_case

CASE = Path(__file__).resolve().parents[3] / "cases" / "gap_demo.toml"


Prepared = tuple[NominalModel, Condition, Unknowns]


@pytest.fixture(scope="module")
def prepared() -> Prepared:
    made = nominal_model(read_case(CASE), 220.0, 100.0)
    condition = prepare(measurement(), made, 3000.0)
    return made, condition, all_unknowns(made, [condition])


STEP = 1e-6  # prior standard deviations: no sample may cross a node of the mesh law, where its tangent has a kink
EXACT = (
    *("stiffness", "damping", "mass", "inertia", "scale", "mesh-ratio", "dissipation", "friction", "coupling"),
    *("bearing-driver", "bearing-driven", "ripple", *(f"filter-{one.place}" for one in Equation)),
)
# Damping's dependence on the tangent stiffness is left out of the derivatives, and for some their second order.
ROUGH = {"shape": 0.03, "curvature": 0.02, "crack": 0.02, "pitch-driver": 0.02, "pitch-driven": 0.02}
# Over eight draws of the unknowns 0.05 to 0.11 %; 1 to 3 % without what the quadratic damping does.
ROUGH |= {f"delay-{channel}": 0.002 for channel in DELAYED}


def usual(where: Unknowns, seed: int = 2) -> np.ndarray:
    """Unknowns (P,) of the background's size, without what the derivatives leave out on purpose: friction's and the
    filters' modulation of other columns."""
    p = 0.3 * where.prior() * np.random.default_rng(seed).standard_normal(where.size)
    p[where["coupling"]] = abs(p[where["coupling"]])
    for key in ("friction", *(f"filter-{one.place}" for one in Equation)):
        p[where[key]] = 0.0
    return p


def test_the_jacobian_is_that_of_differences(prepared: Prepared) -> None:
    made, condition, where = prepared
    sd, p = where.prior(), usual(where)
    at = linearised(made, condition, where, p, np.arange(condition.bins))
    names = where.names()
    # Of a block of many alike (teeth, orders) every fourth.
    alike = Counter(name.split(".")[0] for name in names)
    for entry, name in enumerate(names):
        if alike[name.split(".")[0]] > 8 and entry % 4:
            continue
        step = np.zeros(where.size)
        step[entry] = STEP * sd[entry]
        above, below = (residuals(made, condition, where.departures(x, condition)) for x in (p + step, p - step))
        difference = (above.left - below.left) / (2 * step[entry])
        if name == "backlash.more":  # these flanks never separate
            assert not difference.any() and not at.jacobian[:, :, entry].any()
            continue
        key = name.split(".")[0]
        limit = 1e-5 if key in EXACT else ROUGH.get(key, 0.01)
        assert norm(difference - at.jacobian[:, :, entry]) < limit * norm(difference), name
        pressed = (above.mesh_force - below.mesh_force) / (2 * step[entry])
        assert norm(pressed - at.mesh_jacobian[:, entry]) <= limit * norm(pressed) + 1e-9 * norm(difference), name


@pytest.mark.parametrize("damping", [0.0, 0.4])
def test_a_stiffer_coupling_does_not_drive(prepared: Prepared, damping: float) -> None:
    """It has the loss factor of the case's, a spring beside a damper."""
    made, condition, where = prepared
    stated = replace(made, compliance=1e-5, coupling_damping=damping)
    p = np.zeros(where.size)
    p[where["coupling"]] = -0.5e-5
    found = coupling_compliance(stated, condition, where.departures(p, condition))
    omega = condition.omega[1 : condition.bins]
    assert found[1:].imag / found[1:].real == pytest.approx(-omega * damping * 1e-5, rel=1e-9)
    below = linearised(stated, condition, where, p, np.arange(condition.bins))
    step = np.zeros(where.size)
    step[where["coupling"]] = 1e-9
    above, under = (residuals(stated, condition, where.departures(x, condition)) for x in (p + step, p - step))
    difference = (above.left - under.left) / 2e-9
    assert norm(difference - below.jacobian[:, :, where["coupling"].start]) < 1e-5 * norm(difference)


ON_BACK_FLANKS = (
    *("backlash.more", "offset.excess", "profile.3", "flanks.barrelling"),
    *("pitch-driven.5", "encoder-driven.cos"),
)


@pytest.mark.parametrize("name", ON_BACK_FLANKS)
def test_columns_where_back_flanks_touch(prepared: Prepared, name: str) -> None:
    """What is on the working flanks alone is not felt there. Left out is what damping changes by with the stiffness."""
    made, condition, where = prepared
    p = usual(where)
    p[where["eccentricity-driver"]] = (80e-6, 0.0)  # the back flanks touch once per turn
    p[where["backlash"]] = -made.law.backlash + 10e-6
    entry = where.names().index(name)
    at = linearised(made, condition, where, p, np.arange(condition.bins))
    step = np.zeros(where.size)
    step[entry] = 1e-12  # no sample may begin or cease to touch
    departures = where.departures(p, condition)
    state = mesh(made, condition, departures, corrected(condition, departures))
    assert 0.05 < np.mean(state.elastic < 0.0) < 0.95
    above, below = (residuals(made, condition, where.departures(x, condition)) for x in (p + step, p - step))
    difference = (above.left - below.left) / 2e-12
    # What damping changes by with the stiffness weighs more where the back flanks feel nothing of it.
    on_working_flanks = name.split(".")[0].split("-")[0] in ("offset", "profile", "flanks", "pitch")
    assert norm(difference - at.jacobian[:, :, entry]) < (0.03 if on_working_flanks else 0.02) * norm(difference)


def test_working_flanks_that_stand_back_leave_the_back_ones_where_they_are() -> None:
    """A simulated rig whose flanks touch on both sides in turn: impacts between samples leave 0.28 of the force, its
    error told or none; 0.57 with an error that the back flanks were to have too."""
    tight = ["experiment.torque_mean_nm=8", *(f"rig.{one}.thinning_um=0" for one in ("driver", "driven"))]
    nominal, real = (read_case(CASE, [*tight, f"rig.mesh.error_mean_um={error}"]) for error in (0, -3))
    problem = problem_of(take_in([simulate(real)], nominal).measurements, nominal)
    condition = problem.conditions[0]

    def left(offset: float) -> float:
        p = np.zeros(problem.unknowns.size)
        p[problem.unknowns["offset"]] = offset
        found = residuals(problem.model, condition, problem.unknowns.departures(p, condition))
        return float(norm(found.left[Equation.DRIVE, 1:]))

    assert left(-3e-6) < 0.5 * left(0.0)


def test_gradient_of_the_volume(prepared: Prepared) -> None:
    made, condition, where = prepared
    relative = np.full((len(PLACES), condition.bins), 0.05)
    level = np.full(relative.shape, 1e3)
    blocks = cut(made, condition, level, relative, separates=False)

    def value(unknowns: np.ndarray) -> float:
        departures = where.departures(unknowns, condition)
        stiffening = residuals(made, condition, departures).stiffening
        return log_volume(made, condition, blocks, departures, stiffening)

    p = usual(where)
    p[where["crack"]] = 0.1
    p[where["shape"]] = 0.0  # of second order in the stiffness, left out
    at = where.departures(p, condition)
    gradient = log_volume_gradient(made, condition, blocks, where, at, stiffening_gradient(condition, where, at))
    keys = ("stiffness", "damping", "mass", "scale", "crack")
    for entry in (number for key in keys for number in range(*where[key].indices(where.size))):
        step = np.zeros(where.size)
        step[entry] = 1e-5
        difference = (value(p + step) - value(p - step)) / 2e-5
        assert gradient[entry] == pytest.approx(difference, rel=1e-4), where.names()[entry]


def test_one_blocks_covariance_is_the_dense_one() -> None:
    rng = np.random.default_rng(3)
    bins, unknown = 5, 3
    r = rng.standard_normal((4, bins)) + 1j * rng.standard_normal((4, bins))
    g = 1 + 0.3 * (rng.standard_normal((4, bins)) + 1j * rng.standard_normal((4, bins)))
    j = rng.standard_normal((4, bins, unknown)) + 1j * rng.standard_normal((4, bins, unknown))
    floor = rng.uniform(0.5, 2.0, (5, bins))
    factor = rng.uniform(1.0, 3.0, (5, 1))
    blocks = Blocks(np.arange(bins), np.zeros(bins, int), np.array([5.0]), floor, np.arange(4))
    force = 3 * rng.standard_normal(bins) + 1j
    found = Residuals(r, g, force, 0.0)
    flat, tall = whitened(blocks, found, j, factor)
    level = np.mean(np.abs(split(blocks, found, factor).force) ** 2)
    square, gram, cost = 0.0, np.zeros((unknown, unknown)), 0.0
    for k in range(bins):
        d = floor[:, k] * factor[:, 0]
        covariance = np.diag(d[:4]) + d[4] * np.outer(g[:, k], g[:, k].conj())
        inverse = np.linalg.inv(covariance)
        square += float((r[:, k].conj() @ inverse @ r[:, k]).real)
        gram += (j[:, k].conj().T @ inverse @ j[:, k]).real
        cost += float(np.linalg.slogdet(covariance)[1])
    assert flat @ flat == pytest.approx(square, rel=1e-12)
    assert tall.T @ tall == pytest.approx(gram, rel=1e-12)
    # log|V| = sum log d + log(1/dm + sum |g|^2/d), with the mesh's own log d counted in the sum.
    wanted = cost + square + 1.5 * float(np.log(factor).sum()) + bins * float(np.log(level))
    assert cost_of(blocks, found, factor) == pytest.approx(wanted, rel=1e-12)


def test_missing_part_is_found_in_the_equation_that_has_it() -> None:
    rng = np.random.default_rng(4)
    bins = 800
    numbers = np.repeat(np.arange(bins // 8), 8)

    def noise(size: float) -> np.ndarray:
        return size * (rng.standard_normal(bins) + 1j * rng.standard_normal(bins)) / np.sqrt(2)

    g = np.ones((4, bins), dtype=complex)
    mesh = noise(1.0)
    r = np.stack([noise(1.0), noise(5.0), noise(1.0), noise(1.0)]) - mesh
    blocks = Blocks(np.arange(bins), numbers, np.full(100, 8.0), np.ones((5, bins)), np.arange(4))
    found = Residuals(r, g, 10 * g[0], 0.0)
    factor, cost = missing(blocks, found, np.ones((5, 100)), 100)
    level = np.median(factor, axis=1)
    assert level[1] == pytest.approx(25.0, rel=0.25)
    assert max(level[[0, 2, 3, 4]]) < 1.7
    assert cost < cost_of(blocks, found, np.ones((5, 100)))

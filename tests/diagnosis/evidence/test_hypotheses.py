"""Layout of the unknowns, the library's names, and which evidence the background's quadratic promises."""

from __future__ import annotations

import numpy as np
import pytest
from shared.measured import nominal
from shared.synthetic import measurement

from gearbench.diagnosis.evidence.fit import Fit
from gearbench.diagnosis.evidence.hypotheses import (
    LIBRARY,
    Hypothesis,
    free_forms,
    library,
    predicted_gains,
    starts,
)
from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.forces.nominal import machine
from gearbench.diagnosis.forces.parameters import NUISANCE, Layout, block, layout
from gearbench.diagnosis.forces.unknowns import unknowns
from gearbench.diagnosis.verdict import PLACES

SMALL = layout(
    [
        block("mass", NUISANCE, "kg", ("a", "b"), 0.1),
        block("runout", "eccentric", "m", 2, 1.0, 10.0, low=-3.0),
        block("tooth", "teeth", "1", 3, 0.5, 5.0, low=0.0, high=0.9),
        block("more", "eccentric", "m", ("x",), 2.0, 20.0),
    ]
)


@pytest.fixture(scope="module")
def where() -> Layout:
    made = machine(nominal(), 220.0, 100.0)
    return unknowns(made, [prepare(measurement(), made, 3000.0)])


def test_layout_by_hand() -> None:
    assert SMALL.size == 8
    assert SMALL["runout"] == slice(2, 4) and SMALL["more"] == slice(7, 8)
    assert SMALL.names() == ("mass.a", "mass.b", "runout.0", "runout.1", "tooth.0", "tooth.1", "tooth.2", "more.x")
    assert SMALL.block("tooth").unit == "1"
    assert list(SMALL.members("eccentric")) == [2, 3, 7]
    assert list(SMALL.prior()) == [0.1, 0.1, 1.0, 1.0, 0.5, 0.5, 0.5, 2.0]
    assert list(SMALL.prior(("eccentric",))) == [0.1, 0.1, 10.0, 10.0, 0.5, 0.5, 0.5, 20.0]
    assert list(SMALL.prior((), (5,))) == [0.1, 0.1, 1.0, 1.0, 0.5, 5.0, 0.5, 2.0]
    low, high = SMALL.bounds()
    assert list(low) == [-np.inf, -np.inf, -3.0, -3.0, 0.0, 0.0, 0.0, -np.inf]
    assert list(high) == [*4 * [np.inf], 0.9, 0.9, 0.9, np.inf]


def test_unknowns_of_the_demonstration(where: Layout) -> None:
    assert len(set(where.names())) == where.size
    narrow, (low, high) = where.prior(), where.bounds()
    wide = where.prior({found.group for found in where.blocks})
    assert np.all(narrow > 0) and np.all(wide >= narrow)
    assert np.all(low <= 0) and np.all(high > 0)
    # What the case states: supports known to 10 and 33 %, the mesh to 6 %, mesh damping to 40 %.
    assert narrow[where["stiffness"]] == pytest.approx(0.1) and narrow[where["damping"]] == pytest.approx(1 / 3)
    assert narrow[where["scale"]] == pytest.approx(0.06) and narrow[where["mesh-ratio"]] == pytest.approx(0.4)
    assert narrow[where["inertia"]] == pytest.approx(0.02)
    assert len(narrow[where["pitch-driven"]]) == 30 and len(narrow[where["crack"]]) == 50
    # Nothing of the nominal rig's own uncertainty grows under a hypothesis.
    nuisance = where.members(NUISANCE)
    assert np.all(wide[nuisance] == narrow[nuisance])


def test_names_and_places_are_the_contract(where: Layout) -> None:
    found = library(where)
    assert {h.effect for h in found} == set(LIBRARY)
    assert set(LIBRARY) <= {
        *("backlash", "friction", "eccentricity", "pitch-error", "tooth-crack", "coupling", "bearing-nonlinearity"),
        *("contact-nonlinearity", "sensor-delay", "torque-ripple", "profile-error", "encoder-runout"),
        *("temperature-drift", "support-stiffness", "mesh-damping"),
    }
    assert len({h.name for h in (*found, *free_forms())}) == len(found) + len(free_forms())
    assert {h.place for h in (*found, *free_forms())} <= set(PLACES)
    places = {h.effect: h.place for h in found}
    assert places["coupling"] == places["torque-ripple"] == "drive"
    assert places["sensor-delay"] == "sensor" and places["backlash"] == "mesh"
    assert {h.place for h in found if h.effect == "bearing-nonlinearity"} == {"driver-support", "driven-support"}
    assert not any(h.effect for h in free_forms())


def test_one_cracked_tooth_of_fifty(where: Layout) -> None:
    cracks = [h for h in library(where) if h.effect == "tooth-crack"]
    names = where.names()
    assert [names[h.entries[0]] for h in cracks] == [f"crack.{tooth}" for tooth in range(50)]
    assert {h.choices for h in cracks} == {50}
    for h in cracks[:3]:
        assert np.count_nonzero(h.prior(where) != where.prior()) == 1


def test_each_hypothesis_widens_what_it_names(where: Layout) -> None:
    for h in (*library(where), *free_forms()):
        widened = np.flatnonzero(h.prior(where) > where.prior())
        wanted = set(h.entries).union(*(where.members(group) for group in h.groups))
        assert set(widened) == wanted and wanted, h.name


@pytest.mark.parametrize("effect", LIBRARY)
def test_an_effect_can_be_left_out(where: Layout, effect: str) -> None:
    left = library(where, (effect,))
    assert {h.effect for h in left} == set(LIBRARY) - {effect}


def test_starts_move_only_what_the_hypothesis_widens(where: Layout) -> None:
    low, high = where.bounds()
    moved = {}
    for h in library(where):
        for move in starts(h, where):
            assert np.all((low <= move) & (move <= high))
            assert np.all(h.prior(where)[move != 0] > where.prior()[move != 0])
            moved[h.effect] = True
    # The rows are far from linear in these two: phases turn by many radians, resonances move through the band.
    assert set(moved) == {"coupling", "sensor-delay"}


def test_predicted_gains_of_a_linear_model() -> None:
    """Evidence of data = columns p + noise, by the dense covariance of the data."""
    turn = np.random.default_rng(7)
    columns = turn.standard_normal((60, SMALL.size))
    p = np.array([0.05, -0.1, 12.0, -9.0, 0.2, 0.1, 0.3, 15.0])
    data = columns @ p + turn.standard_normal(60)

    def evidence(sd: np.ndarray) -> float:
        covariance = np.eye(60) + columns @ np.diag(sd**2) @ columns.T
        return -0.5 * float(data @ np.linalg.solve(covariance, data)) - 0.5 * float(np.linalg.slogdet(covariance)[1])

    sd = SMALL.prior()
    information = columns.T @ columns
    precision = information + np.diag(1 / sd**2)
    best = np.linalg.solve(precision, columns.T @ data)
    fit = Fit(best, sd, precision, information, columns.T @ data, (), 0.0, 0.0, 1)
    tried = (
        Hypothesis("run-out", "eccentricity", "mesh", ("eccentric",)),
        Hypothesis("tooth", "tooth-crack", "mesh", (), (5,), 3),
    )
    found = predicted_gains(fit, SMALL, tried)
    base = evidence(sd)
    assert found[0] == pytest.approx(evidence(tried[0].prior(SMALL)) - base)
    # One tooth is picked out of three.
    assert found[1] == pytest.approx(evidence(tried[1].prior(SMALL)) - base - np.log(3))
    assert found[0] > 10 > 0 > found[1]

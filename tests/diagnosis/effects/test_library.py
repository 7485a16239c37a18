"""Unknowns of all effects, the library's names and places, and what each hypothesis makes wide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.measured import nominal
from shared.synthetic import measurement

from gearbench.diagnosis.effects.background import background
from gearbench.diagnosis.effects.coupling import COUPLING
from gearbench.diagnosis.effects.effect import Effect, Estimate, Hypothesis, Wide
from gearbench.diagnosis.effects.free_forms import free_forms
from gearbench.diagnosis.effects.library import CHANGING, LIBRARY, all_unknowns, hypotheses
from gearbench.diagnosis.evidence.prediction import starts
from gearbench.diagnosis.forces.condition import prepare
from gearbench.diagnosis.forces.nominal import NominalModel, nominal_model
from gearbench.diagnosis.forces.unknowns import Unknowns, group, unknowns_of
from gearbench.rig.contract import EFFECTS, PLACES

SMALL = unknowns_of(
    [
        group("mass", "kg", ("a", "b"), 0.1, slot="mass"),
        group("runout", "m", 2, 1.0, 10.0, slot="offset", low=-3.0),
        group("tooth", "1", 3, 0.5, 5.0, slot="loss", first=2, low=0.0, high=0.9),
        group("more", "m", ("x",), 2.0, 20.0, slot="offset"),
    ],
    teeth=5,
)


@pytest.fixture(scope="module")
def model() -> NominalModel:
    return nominal_model(nominal(), 220.0, 100.0)


@pytest.fixture(scope="module")
def where(model: NominalModel) -> Unknowns:
    return all_unknowns(model, [prepare(measurement(), model, 3000.0)])


def test_unknowns_by_hand() -> None:
    assert SMALL.size == 8
    assert SMALL["runout"] == slice(2, 4) and SMALL["more"] == slice(7, 8)
    assert SMALL.names() == ("mass.a", "mass.b", "runout.0", "runout.1", "tooth.0", "tooth.1", "tooth.2", "more.x")
    assert SMALL.group("tooth").unit == "1"
    assert SMALL.moving[("loss", 3)] == (5,) and SMALL.moving[("offset", 0)] == (2, 7)
    assert list(SMALL.prior()) == [0.1, 0.1, 1.0, 1.0, 0.5, 0.5, 0.5, 2.0]
    both = Hypothesis("", "mesh", (Wide("runout"), Wide("more")))
    assert list(both.prior(SMALL)) == [0.1, 0.1, 10.0, 10.0, 0.5, 0.5, 0.5, 20.0]
    assert list(Hypothesis("", "mesh", (Wide("tooth", 1),)).prior(SMALL)) == [0.1, 0.1, 1.0, 1.0, 0.5, 5.0, 0.5, 2.0]
    assert list(Hypothesis("", "mesh", (Wide("mass", 0, 0.7),)).prior(SMALL))[:2] == [0.7, 0.1]
    low, high = SMALL.bounds()
    assert list(low) == [-np.inf, -np.inf, -3.0, -3.0, 0.0, 0.0, 0.0, -np.inf]
    assert list(high) == [*4 * [np.inf], 0.9, 0.9, 0.9, np.inf]


def test_unknowns_of_the_demonstration(model: NominalModel, where: Unknowns) -> None:
    assert len(set(where.names())) == where.size
    narrow, (low, high) = where.prior(), where.bounds()
    wide = np.concatenate([one.wide for one in where.groups])
    assert np.all(narrow > 0) and np.all(wide >= narrow)
    assert np.all(low <= 0) and np.all(high > 0)
    # What the case states: supports known to 10 and 33 %, the mesh to 6 %, mesh damping to 40 %.
    assert narrow[where["stiffness"]] == pytest.approx(0.1) and narrow[where["damping"]] == pytest.approx(1 / 3)
    assert narrow[where["scale"]] == pytest.approx(0.06) and narrow[where["mesh-ratio"]] == pytest.approx(0.4)
    assert narrow[where["inertia"]] == pytest.approx(0.02)
    assert len(narrow[where["pitch-driven"]]) == 30 and len(narrow[where["crack"]]) == 50
    # The nominal rig's own uncertainty is no group that is ever wide as a whole.
    own = [one.key for one in background(model)]
    assert all(np.all(where.group(key).wide == where.group(key).sd) for key in own)
    assert not {wide.key for h in hypotheses(model) for wide in h.wide if wide.at is None} & set(own)


def test_names_and_places_are_the_contract(model: NominalModel) -> None:
    found = hypotheses(model)
    names = [effect.name for effect in LIBRARY]
    assert {h.effect.name for h in found if h.effect} == set(names) and len(set(names)) == len(names)
    assert {*names, *(effect.name for effect in CHANGING)} == set(EFFECTS) and len(EFFECTS) == 15
    assert len({h.name for h in (*found, *free_forms())}) == len(found) + len(free_forms())
    assert {h.place for h in (*found, *free_forms())} <= set(PLACES)
    places = {h.effect.name: h.place for h in found if h.effect}
    assert places["coupling"] == places["torque-ripple"] == "drive"
    assert places["sensor-delay"] == "sensor" and places["backlash"] == "mesh"
    supports = {h.place for h in found if h.effect and h.effect.name == "bearing-nonlinearity"}
    assert supports == {"driver-support", "driven-support"}
    assert not any(h.effect for h in free_forms())


def test_one_cracked_tooth_of_fifty(model: NominalModel, where: Unknowns) -> None:
    cracks = [h for h in hypotheses(model) if h.effect and h.effect.name == "tooth-crack"]
    names = where.names()
    assert [names[h.entries(where)[0]] for h in cracks] == [f"crack.{tooth}" for tooth in range(50)]
    assert {h.choices for h in cracks} == {50}
    assert [h.name for h in cracks if h.representative] == ["tooth-crack 0", "tooth-crack 20"]
    for h in cracks[:3]:
        assert np.count_nonzero(h.prior(where) != where.prior()) == 1


def test_each_hypothesis_widens_what_it_names(model: NominalModel, where: Unknowns) -> None:
    for h in (*hypotheses(model), *free_forms()):
        widened = np.flatnonzero(h.prior(where) > where.prior())
        assert list(widened) == sorted(h.entries(where)) and len(widened), h.name


@pytest.mark.parametrize("left_out", LIBRARY, ids=lambda effect: effect.name)
def test_an_effect_can_be_left_out(model: NominalModel, left_out: Effect) -> None:
    left = hypotheses(model, (left_out.name,))
    assert {h.effect.name for h in left if h.effect} == {effect.name for effect in LIBRARY} - {left_out.name}


def test_a_stated_coupling_is_as_uncertain_as_the_case_says(model: NominalModel) -> None:
    """3000 N m/rad known to 240: of a sound rig its compliance is off by 8 %, beside what a stiff one yields."""
    case = nominal()
    coupling = case.rig.drive.coupling
    assert coupling is not None
    drive = case.rig.drive.model_copy(update={"coupling": coupling.model_copy(update={"stiffness": 3000.0})})
    uncertain = {**case.uncertainty, "rig.drive.coupling.stiffness": 240.0}
    rig = case.rig.model_copy(update={"drive": drive})
    stated = nominal_model(case.model_copy(update={"rig": rig, "uncertainty": uncertain}), 220.0, 100.0)
    (rigid,), (known,) = (COUPLING.unknowns(one, []) for one in (model, stated))
    assert known.sd[0] ** 2 == pytest.approx(rigid.sd[0] ** 2 + (0.08 / 3000.0) ** 2)
    assert known.wide[0] >= 3.0 * known.sd[0] and known.wide[0] >= rigid.wide[0]
    assert COUPLING.starts is not None
    # Of it some may be missing, of a rigid one nothing.
    assert rigid.low == 0.0 and -1.0 < known.low * 3000.0 <= -5.0 * 0.08
    # The search still begins at a stiff one, not at what the case leaves uncertain.
    assert COUPLING.starts(rigid)[0] <= COUPLING.starts(known)[0] < 2.0 * COUPLING.starts(rigid)[0]


def test_without_a_rotor_there_is_no_coupling(model: NominalModel) -> None:
    alone = replace(model, rotor=0.0)
    assert {h.effect.name for h in hypotheses(alone) if h.effect} == {effect.name for effect in LIBRARY} - {"coupling"}


def test_starts_move_only_what_the_hypothesis_widens(model: NominalModel, where: Unknowns) -> None:
    low, high = where.bounds()
    moved = {}
    for h in hypotheses(model):
        for move in starts(h, where):
            assert np.all((low <= move) & (move <= high))
            assert np.all(h.prior(where)[move != 0] > where.prior()[move != 0])
            assert h.effect is not None
            moved[h.effect.name] = True
    # The residuals are far from linear in these two: phases turn by many radians, resonances move through the band.
    assert set(moved) == {"coupling", "sensor-delay"}


def test_the_models_error_is_added_in_squares_to_sizes() -> None:
    for effect in LIBRARY:
        assert effect.stated(Estimate("a", 0.05, 0.0, "1")) == pytest.approx(0.05 * effect.model_error)
        assert effect.stated(Estimate("a", 0.0, 0.002, "1")) == pytest.approx(0.002)
        assert effect.stated(Estimate("a", 3.0 / effect.model_error, 4.0, "um")) == pytest.approx(5.0)
        by_forces = effect.stated(Estimate("a", 0.05, 0.0, "1"), by_forces=True)
        assert by_forces == pytest.approx(0.05 * max(effect.model_error, effect.force_error))
        # Numbers of teeth and phases keep what the fit says.
        assert effect.stated(Estimate("tooth", 8.0, 0.0, "1", sized=False)) == 0.0


def test_departures_gather_what_moves_a_slot(where: Unknowns, model: NominalModel) -> None:
    condition = prepare(measurement(), model, 3000.0)
    p = np.zeros(where.size)
    p[where["pitch-driven"]] = np.arange(30.0)
    p[where["delay-y_driver"]] = 3e-6
    p[where["eccentricity-driver"]] = (3e-6, 0.0)
    p[where["eccentricity-driven"]] = (0.0, 2e-6)
    p[where["ripple"]][0:2] = (2.0, 1.0)
    got = where.departures(p, condition)
    assert list(got.pitch) == [*np.zeros(20), *np.arange(30.0)]
    assert list(got.delay) == [0.0, 0.0, 3e-6, 0.0]
    turns = 2 * np.pi * measurement().phase
    assert got.closed == pytest.approx(3e-6 * np.cos(turns / 20) + 2e-6 * np.sin(turns / 30))
    # Six times a driver revolution, of which 60 mesh cycles hold three.
    assert np.flatnonzero(got.torque).tolist() == [18] and got.torque[18] == 1.0 - 0.5j
    assert got.friction == 0.0 and not got.filters.any()

"""Plans, draws and families of truth rigs."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from shared.truth_plants import drawn_levels, short_case

from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.making.cases import draw_truth
from gearbench.challenge.making.plan import Mix, Plan, default_mix, make_plan, parse_mix
from gearbench.challenge.truth.effects import EFFECTS, FOREIGN, SEVERITY
from gearbench.challenge.truth.elastic import REPRESENTED
from gearbench.challenge.truth.levels import Levels
from gearbench.challenge.truth.rigs import check_nominal
from gearbench.challenge.truth.scale import scale_of
from gearbench.challenge.truth.structure import FAMILIES, draw_structure, family_named, loosened
from gearbench.rig.contract import EFFECTS as NAMES


def test_default_mix_is_that_of_the_reach() -> None:
    assert default_mix(171) == Mix(60, (*(5,) * 13, 4, 4), 30, 6, 2)
    for cases in (1, 7, 60, 100):
        assert default_mix(cases).cases == cases


def test_mix_is_parsed() -> None:
    assert parse_mix("controls=12, per-effect=4,foreign=12") == Mix(12, (4,) * 15, 12)
    assert parse_mix("pairs=3").cases == 3
    assert parse_mix("triples=3,reduced=2") == Mix(0, (0,) * 15, 0, 0, 3, 2)


@pytest.mark.parametrize("text", ["controls", "effects=3", "controls=-1", "foreign=1e3", "controls=99999"])
def test_bad_mix_is_refused(text: str) -> None:
    with pytest.raises(ChallengeError, match="--mix"):
        parse_mix(text)


def test_plan_holds_the_mix_with_log_uniform_severities() -> None:
    plans = make_plan(Mix(5, (30,) * 15, 12, 4), np.random.default_rng(3))
    counts = Counter(plan.effects for plan in plans)
    assert counts[()] == 5
    assert all(counts[(name,)] == 30 for name in EFFECTS)
    assert {counts[(name,)] for name in FOREIGN} == {3}
    assert set(EFFECTS) == set(NAMES)
    assert sum(len(plan.effects) == 2 for plan in plans) == 4
    for name in EFFECTS:
        logs = np.sort([np.log(plan.severity[0]) for plan in plans if plan.effects == (name,)])
        low, high = np.log(SEVERITY)
        parts = (logs - low) / (high - low)
        assert (np.floor(30 * parts) == np.arange(30)).all()


def test_triples_and_rigs_of_finite_elements_come_after_all_else() -> None:
    """A seed draws the same cases as before, whatever is asked for besides."""
    before = make_plan(Mix(5, (3,) * 15, 12, 4), np.random.default_rng(3))
    plans = make_plan(Mix(5, (3,) * 15, 12, 4, 5, 20), np.random.default_rng(3))
    assert plans[: len(before)] == before and len(plans) == len(before) + 25
    for plan in plans[len(before) : -20]:
        assert plan.kind == "effect" and len(set(plan.effects)) == len(plan.severity) == 3
    elastic = plans[-20:]
    assert all(plan.elastic for plan in elastic) and not any(plan.elastic for plan in plans[:-20])
    assert [plan.kind for plan in elastic] == ["none", "effect"] * 10
    assert {plan.effects[0] for plan in elastic if plan.effects} == set(REPRESENTED) < set(EFFECTS)


def test_three_effects_are_in_the_rig_at_once() -> None:
    plan = Plan("effect", ("bearing-nonlinearity", "friction", "torque-ripple"), (1.0, 0.5, 1.2))
    truth, _ = draw_truth(short_case(), "test", 7, 3, plan)
    levels = truth.drawn.levels
    assert max(levels.exponent) == pytest.approx(0.35) and levels.friction == pytest.approx(0.03)
    assert levels.ripple == pytest.approx(1.2 * 0.006 * np.ones(4))
    assert truth.answer.places[1:] == ("mesh", "drive") and truth.answer.place == truth.answer.places[0]
    assert set(truth.answer.parameters) == set(plan.effects) and truth.answer.everywhere == truth.answer.places


def test_a_loose_housing_changes_nothing_else() -> None:
    nominal, parts = short_case(), []
    for number in range(40):
        tight = draw_structure(nominal, "test", np.random.default_rng(number))
        loose = loosened(tight, np.random.default_rng([number, 1]))
        parts.append(loose.mode_part)
        assert str(replace(loose, mode_part=tight.mode_part)) == str(tight)
    assert np.min(parts) >= 0.005 and np.max(parts) <= 0.1
    assert 0.3 < np.mean(np.array(parts) > 0.0224) < 0.7  # log-uniform


def test_rigs_of_another_size_and_those_around_a_users_have_loose_housings() -> None:
    nominal = short_case()
    found, tame = (
        [draw_truth(nominal, "test", 7, number, Plan("none"), scale)[0].structure.mode_part for number in range(20)]
        for scale in (scale_of(nominal), None)
    )
    assert np.max(found) > 0.05 and np.max(tame) < 0.011


SIZES = {
    "backlash": (lambda level: level.backlash_more, 80e-6),
    "friction": (lambda level: level.friction, 0.06),
    "eccentricity": (lambda level: max(level.runout), 10e-6),
    "pitch-error": (lambda level: max(np.sqrt(np.mean(p**2)) for p in level.pitch), 3e-6),
    "tooth-crack": (lambda level: max(c.max() for c in level.crack), 0.35),
    "bearing-nonlinearity": (lambda level: max(level.exponent), 0.35),
    "sensor-delay": (lambda level: max(np.abs(level.delay)), 50e-6),
    "torque-ripple": (lambda level: max(level.ripple), 0.006),
    "encoder-runout": (lambda level: max(level.encoder), 5e-6),
}
# Of these a good rig has what its structure has of them.
OWN = {
    "contact-nonlinearity": (lambda level: level.contact, 0.35),
    "profile-error": (lambda level: max(2 * abs(level.profile[0]), abs(level.profile[1])), 8e-6),
    "temperature-drift": (lambda level: max(np.abs(level.drift)), 0.06),
}


@pytest.mark.parametrize("name", [*SIZES, *OWN])
def test_effects_have_the_size_of_the_issue_times_their_severity(name: str) -> None:
    size, unit = {**SIZES, **OWN}[name]
    before = drawn_levels(5)
    least, most = (0.0, 0.0) if name in OWN else (0.05 * unit, 0.12 * unit)
    assert least <= abs(size(before)) <= most
    for seed in range(6):
        drawn = EFFECTS[name](before, 1.3, np.random.default_rng(seed))
        assert size(drawn.levels) == pytest.approx(1.3 * unit)
        assert others(drawn.levels, name) == others(before, name)


@pytest.mark.parametrize("severity", SEVERITY)
def test_known_numbers_leave_their_uncertainty_behind(severity: float) -> None:
    """Another stiffness of a support, or damping of the mesh, is one beyond three standard deviations."""
    nominal = short_case()
    sides = set()
    for number in range(20):
        plan = Plan("effect", ("support-stiffness", "mesh-damping"), (severity, severity))
        answer = draw_truth(nominal, "test", 7, number, plan)[0].answer
        ((name, stiffness),) = answer.parameters["support-stiffness"].items()
        side = name.removesuffix(".stiffness")
        known = getattr(nominal.rig.support, side).stiffness, nominal.uncertainty[f"rig.support.{side}.stiffness"]
        assert abs(stiffness["value"] - known[0]) > 3 * known[1] and stiffness["unit"] == "N/m"
        sides.add((answer.places[0], stiffness["value"] > known[0]))
        ratio = answer.parameters["mesh-damping"]["ratio"]["value"]
        assert ratio > 0.05 + 3 * nominal.uncertainty["rig.damping.mesh_ratio"] and ratio < 0.3
    assert sides == {(f"{side}-support", more) for side in ("driver", "driven") for more in (False, True)}


def others(levels: Levels, name: str) -> str:
    """All levels but those of an effect, as text."""
    fields = {
        "backlash": "backlash_more",
        "eccentricity": "runout",
        "pitch-error": "pitch",
        "tooth-crack": "crack",
        "bearing-nonlinearity": "exponent",
        "sensor-delay": "delay",
        "torque-ripple": "ripple",
        "coupling": "coupling_frequency",
        "encoder-runout": "encoder",
        "contact-nonlinearity": "contact",
        "profile-error": "profile",
        "temperature-drift": "drift",
    }
    skipped = fields.get(name, name)
    return str({key: value for key, value in vars(levels).items() if key != skipped})


def test_severest_coupling_is_the_softest() -> None:
    before = drawn_levels()
    assert before.coupling_frequency > 6000.0
    ends = [EFFECTS["coupling"](before, s, np.random.default_rng(0)).levels.coupling_frequency for s in SEVERITY]
    assert ends == pytest.approx([3000.0, 900.0])


@pytest.mark.parametrize("name", [*EFFECTS, *FOREIGN])
def test_places_are_those_of_the_contract(name: str) -> None:
    places = {
        **{key: {"mesh"} for key in ("friction", "eccentricity", "pitch-error", "tooth-crack", "backlash")},
        **{key: {"drive"} for key in ("coupling", "torque-ripple", "slipping-coupling")},
        **{key: {"drive"} for key in ("non-synchronous-torque", "torque-filter")},
        "bearing-nonlinearity": {"driver-support", "driven-support"},
        "sensor-delay": {"sensor"},
        "temperature-drift": {"mesh", "driver-support", "driven-support"},
        **{key: {"mesh"} for key in ("contact-nonlinearity", "profile-error", "mesh-damping")},
        "encoder-runout": {"sensor"},
        "support-stiffness": {"driver-support", "driven-support"},
        "quadratic-mesh-damping": {"mesh"},
    }
    draw = EFFECTS.get(name) or FOREIGN[name]
    seen = {draw(drawn_levels(), 1.0, np.random.default_rng(seed)).place for seed in range(40)}
    assert seen == places[name]


def test_bearing_and_drift_change_the_support_that_they_name() -> None:
    for seed in range(10):
        drawn = EFFECTS["bearing-nonlinearity"](drawn_levels(), 1.0, np.random.default_rng(seed))
        side = drawn.place.removesuffix("-support")
        assert drawn.levels.exponent[("driver", "driven").index(side)] == 0.35
        warm = EFFECTS["temperature-drift"](drawn_levels(), 1.0, np.random.default_rng(seed))
        index = ("mesh", "driver-support", "driven-support").index(warm.place)
        assert abs(warm.levels.drift[index]) == pytest.approx(0.06)
        assert sum(value != 0 for value in warm.levels.drift) == 1


def test_families_share_no_choice_of_the_mesh() -> None:
    families = list(FAMILIES.values())
    for field in ("shape", "housing", "damping_load"):
        assert len({getattr(family, field) for family in families}) == len(families)


@pytest.mark.parametrize("family", FAMILIES)
def test_rigs_stay_near_the_nominal_one(family: str) -> None:
    nominal = short_case()
    rigs = [draw_structure(nominal, family, np.random.default_rng(seed)) for seed in range(60)]
    factors = np.array([rig.stiffness_factor for rig in rigs])
    assert 0.03 < factors.std() < 0.08 and np.abs(factors - 1).max() <= 0.12 + 1e-9
    along = np.array([rig.support[1::2] for rig in rigs])
    assert np.abs(along / 1e8 - 1).max() <= 0.2 + 1e-9
    across = np.array([rig.support[::2] / rig.support[1::2] for rig in rigs])
    assert across.min() >= 3.0 and across.max() <= 10.0
    loads = np.array([rig.inertia[3] / ((rig.inertia[0] + rig.inertia[1]) * 1.5**2) for rig in rigs])
    assert loads.min() >= 20.0 and loads.max() <= 100.0


def test_truth_depends_on_seed_family_and_number_alone() -> None:
    nominal, plan = short_case(), Plan("effect", ("pitch-error",), (0.7,))
    one, again = (draw_truth(nominal, "test", 7, 3, plan)[0] for _ in range(2))
    assert str(one) == str(again)
    for seed, number, family in ((8, 3, "test"), (7, 4, "test"), (7, 3, "calibration")):
        other = draw_truth(nominal, family, seed, number, plan)[0]
        assert not np.array_equal(other.structure.profile, one.structure.profile)


def test_unknown_family_is_refused() -> None:
    with pytest.raises(ChallengeError, match=r"family 'tset' is unknown; families are development"):
        family_named("tset")


def test_unfit_nominal_rigs_are_refused() -> None:
    nominal = short_case()

    def changed(table: str, **fields: object) -> object:
        part = getattr(nominal.rig, table).model_copy(update=fields)
        return nominal.model_copy(update={"rig": nominal.rig.model_copy(update={table: part})})

    check_nominal(nominal)
    for case, words in (
        (changed("friction", coefficient=0.1), "rig.friction"),
        (changed("driver", mass=None), "rig.driver.mass_kg"),
        (changed("support", direction="line-of-action"), "tangential"),
        (changed("drive", coupling=None), "inertia_kg_m2"),
    ):
        with pytest.raises(ChallengeError, match=words):
            check_nominal(case)  # type: ignore[arg-type]
    once = nominal.experiment.model_copy(update={"periods": 1})
    with pytest.raises(ChallengeError, match="at least 2"):
        check_nominal(nominal.model_copy(update={"experiment": once}))

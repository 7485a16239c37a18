"""Unknowns as a rig: a rig simulated with them leaves no force residuals at them, and its fields are the stated ones.

The truth is the non-linear lumped model in time domain, which knows nothing of residuals and unknowns.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import cos, pi, radians
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.linalg import norm

from gearbench.bench import simulate
from gearbench.bench.nonlinear.replay import replay
from gearbench.bench.nonlinear.run import HEADROOM
from gearbench.cases import case_files
from gearbench.diagnosis.effects.effect import Effect, Estimate, Fitted, Hypothesis, added
from gearbench.diagnosis.effects.library import LIBRARY, all_unknowns, hypotheses
from gearbench.diagnosis.effects.recalibrated import recalibrated
from gearbench.diagnosis.forces.basis import in_parts
from gearbench.diagnosis.forces.condition import Condition, prepare
from gearbench.diagnosis.forces.equations import Equation
from gearbench.diagnosis.forces.nominal import NominalModel, nominal_model
from gearbench.diagnosis.forces.residuals import residuals
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.intake.measurements import measurement
from gearbench.rig import Case, dump_case, read_case

BAND = 3000.0
QUIET = [f"rig.sensors.noise_{name}=0" for name in ("angle_urad", "displacement_um", "torque_nm")]
# Little enough for the flanks to stay together, and enough to make them separate.
SETTINGS = {"base": "condition.0.multisine.amplitude_nm=20", "light": "condition.1.multisine.amplitude_nm=60"}


@dataclass(frozen=True)
class Bench:
    """One condition of the demonstration without noise."""

    nominal: Case
    record: xr.Dataset
    model: NominalModel
    unknowns: Unknowns

    def values(self, values: Mapping[str, object]) -> np.ndarray:
        """Unknowns (P,) of these blocks, with radial supports as rigid as the lumped model has them."""
        p = np.zeros(self.unknowns.size)
        p[self.unknowns["radial"]] = 30.0
        for key, value in values.items():
            p[self.unknowns[key]] = value
        return p

    def fitted(self, p: np.ndarray) -> Fitted:
        return Fitted(self.model, self.unknowns, p, np.full(p.size, 1e-3), {"base": 100.0})

    def prepared(self, case: Case) -> Condition:
        """What sensors on that rig would show, prepared under the nominal one."""
        seen = measurement(replay(case, self.record), "base", self.nominal)
        return prepare(seen, self.model, BAND)

    def residual(self, condition: Condition, p: np.ndarray) -> np.ndarray:
        return residuals(self.model, condition, self.unknowns.departures(p, condition)).left

    def hypothesis(self, name: str) -> Hypothesis:
        return next(h for h in hypotheses(self.model) if h.name == name)

    def applied(self, name: str, p: np.ndarray) -> tuple[Case, tuple[Estimate, ...]]:
        fitted = self.fitted(p)
        return added(recalibrated(self.nominal, fitted), self.hypothesis(name), fitted)


def bench(name: str) -> Bench:
    case = read_case(case_files()["gap_demo"], [*QUIET, SETTINGS[name]])
    nominal = case.under(next(c for c in case.conditions if c.name == name))
    record = simulate(nominal)
    made = nominal_model(nominal, HEADROOM * float(np.abs(record["torque_driver"].values).max()), 100.0)
    condition = prepare(measurement(record, "base", nominal), made, BAND)
    return Bench(nominal, record, made, all_unknowns(made, [condition]))


@pytest.fixture(scope="module")
def base() -> Bench:
    return bench("base")


TURN = np.random.default_rng(8)
# Values of the effect, and by how much the residuals must shrink. With friction, steps of the force where pairs enter
# and leave fold back from beyond the sampled band; pitch errors shift where that happens; the coupling's loss is
# structural in the rows and viscous in the rig.
EFFECTS: dict[str, tuple[dict[str, object], float]] = {
    "friction": ({"friction": 0.06}, 5.0),
    "eccentricity driver": ({"eccentricity-driver": (5e-6, -8e-6)}, 300.0),
    "eccentricity driven": ({"eccentricity-driven": (-4e-6, 7e-6)}, 300.0),
    "pitch-error driver": ({"pitch-driver": 2e-6 * TURN.standard_normal(20)}, 10.0),
    "pitch-error driven": ({"pitch-driven": 2e-6 * TURN.standard_normal(30)}, 10.0),
    "tooth-crack 7": ({"crack": 0.3 * (np.arange(50) == 7)}, 10.0),
    "tooth-crack 33": ({"crack": 0.3 * (np.arange(50) == 33)}, 10.0),
    "coupling": ({"coupling": 1 / 4e4}, 20.0),
    "bearing-nonlinearity driver": ({"bearing-driver": 0.5}, 50.0),
    "bearing-nonlinearity driven": ({"bearing-driven": -0.3}, 50.0),
    "sensor-delay angle_driver": ({"delay-angle_driver": 40e-6}, 100.0),
    "sensor-delay angle_driven": ({"delay-angle_driven": -40e-6}, 100.0),
    "sensor-delay y_driver": ({"delay-y_driver": 40e-6}, 100.0),
    "sensor-delay y_driven": ({"delay-y_driven": 40e-6}, 100.0),
    "encoder-runout driver": ({"encoder-driver": (5e-6, -8e-6)}, 100.0),
    "encoder-runout driven": ({"encoder-driven": (-4e-6, 7e-6)}, 100.0),
    "profile-error": ({"profile": 1e-6 * np.array([2.0, -1.0, 0.0, 0.5, 0.3, *np.zeros(7)])}, 100.0),
    "profile-error flanks": ({"flanks": in_parts(1e-6 * np.array([-3.0, -1.5, 0.2, 0.5, 0.0, -0.8, -2.0]))}, 4.0),
    "profile-error slope": ({"flanks": 1e-6 * np.array([0.0, 2.0, -1.0, 0.0, 0.0, 0.0, 0.0])}, 3.0),
    "torque-ripple": ({"ripple": (1.0, -0.5, 0.3, 0.6, 0.0, -0.4, 0.2, 0.2)}, 20.0),
}


# The other gear, tooth or channel of an effect that is tried already.
AGAIN = {
    *("eccentricity driver", "pitch-error driven", "tooth-crack 7", "bearing-nonlinearity driven"),
    *("sensor-delay angle_driven", "sensor-delay y_driver"),
}


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=pytest.mark.validation if one in AGAIN else ()) for one in EFFECTS]
)
def test_a_rig_with_the_effect_leaves_no_residual_at_its_unknowns(base: Bench, name: str) -> None:
    values, ratio = EFFECTS[name]
    p = base.values(values)
    condition = base.prepared(base.applied(name, p)[0])
    before, after = base.residual(condition, base.values({})), base.residual(condition, p)
    assert norm(before) > ratio * norm(after)


@pytest.mark.validation
def test_backlash_where_flanks_separate() -> None:
    light = bench("light")
    p = light.values({"backlash": 60e-6})
    condition = light.prepared(light.applied("backlash", p)[0])
    assert norm(light.residual(condition, light.values({}))) > 15 * norm(light.residual(condition, p))


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("coupling", {"drive"}),
        ("torque-ripple", {"drive"}),
        ("bearing-nonlinearity driver", {"driver-support"}),
        ("bearing-nonlinearity driven", {"driven-support"}),
    ],
)
def test_an_effect_outside_the_mesh_shows_in_its_own_equation(base: Bench, name: str, place: set[str]) -> None:
    p = base.values(EFFECTS[name][0])
    condition = base.prepared(base.applied(name, p)[0])
    size = norm(base.residual(condition, base.values({})), axis=1)
    loud = {one.place for one in Equation if size[one] > 0.1 * size.max()}
    assert loud == place


def test_a_recalibrated_rig_leaves_no_residual(base: Bench) -> None:
    turn = np.random.default_rng(3)
    values: dict[str, object] = {
        "stiffness": (0.2, -0.15),
        "damping": (0.8, -0.6),
        "mass": (0.2, -0.15),
        "inertia": (0.08, -0.08, 0.1),
        "scale": 0.1,
        "mesh-ratio": 0.5,
        "offset": -3e-6,
        "shape": 0.02 * turn.standard_normal(12),
        "profile": 0.3e-6 * turn.standard_normal(12),
    }
    p = base.values(values)
    condition = base.prepared(recalibrated(base.nominal, base.fitted(p)))
    after = norm(base.residual(condition, p))
    assert norm(base.residual(condition, base.values({}))) > 200 * after
    for key in values:  # each of them counts
        without = base.values({other: value for other, value in values.items() if other != key})
        assert norm(base.residual(condition, without)) > 2 * after, key


def test_fields_and_estimates_of_effects(base: Bench) -> None:
    def field(name: str, values: dict[str, object]) -> tuple[Case, dict[str, Estimate]]:
        case, estimates = base.applied(name, base.values(values))
        return case, {estimate.name: estimate for estimate in estimates}

    case, found = field("friction", {"friction": 0.05})
    assert case.rig.friction.coefficient == pytest.approx(0.05) and found["coefficient"].std == pytest.approx(1e-3)

    # Run-out is twice the eccentricity, its phase where material is most: 3-4-5 triangle in the fourth quadrant.
    case, found = field("eccentricity driven", {"eccentricity-driven": (3e-6, -4e-6)})
    assert case.rig.driven.runout == pytest.approx(10e-6)
    assert case.rig.driven.runout_phase == pytest.approx(radians(-53.13010235))
    assert case.rig.driver.runout == 0.0
    assert found["driven.runout"].value == pytest.approx(10.0) and found["driven.runout"].unit == "um"
    assert found["driven.runout_phase"].value == pytest.approx(-53.13010235)
    assert "driver.runout" not in found
    # What the encoder of the same gear reads ahead in that direction may be run-out, what lies across it not.
    for other, more in (((0.6e-6, -0.8e-6), 2.0), ((0.8e-6, 0.6e-6), 0.0)):
        _, beside = field("eccentricity driven", {"eccentricity-driven": (3e-6, -4e-6), "encoder-driven": other})
        assert beside["driven.runout"].value == pytest.approx(10.0)
        assert beside["driven.runout"].std == pytest.approx(np.hypot(found["driven.runout"].std, more))

    case, found = field("pitch-error driver", {"pitch-driver": 1e-6 * np.r_[2.0, -2.0, np.zeros(18)]})
    assert case.rig.driver.pitch_error[:3] == pytest.approx((2e-6, -2e-6, 0.0))
    assert found["driver.rms"].value == pytest.approx(np.sqrt(8 / 20))

    # Teeth are numbered driver first, then driven.
    case, found = field("tooth-crack 24", {"crack": 0.4 * (np.arange(50) == 24)})
    crack = case.rig.driven.crack
    assert crack is not None and (crack.tooth, crack.stiffness_loss) == (4, pytest.approx(0.4))
    assert case.rig.driver.crack is None and found["driven.tooth"].value == 4.0

    # Both flanks of a gear recede by half its thinning of the reference circle's tooth thickness.
    case, found = field("backlash", {"backlash": 20e-6})
    more = sum(gear.thinning for gear in (case.rig.driver, case.rig.driven)) - 60e-6
    assert more * cos(radians(20.0)) == pytest.approx(20e-6)
    assert found["more"].value == pytest.approx(20.0)

    case, found = field("bearing-nonlinearity driver", {"bearing-driver": 0.5})
    assert case.rig.support.driver.exponent == pytest.approx(0.5) and case.rig.support.driven.exponent == 0.0
    # About the deflection under 100 N m, where the secant stiffness is the stated 1e8 N/m.
    force = 100.0 / base.model.base_radius[0] * cos(radians(20.0))
    assert case.rig.support.driver.reference_deflection == pytest.approx(force / 1e8, rel=1e-3)

    case, found = field("contact-nonlinearity", {"curvature": 0.3})
    assert case.rig.mesh.exponent == pytest.approx(0.3) and found["exponent"].value == pytest.approx(0.3)
    assert found["exponent"].std == pytest.approx(np.hypot(1e-3, 0.04))  # sound rigs seem to have as much

    case, found = field("sensor-delay y_driven", {"delay-y_driven": -30e-6})
    assert case.rig.sensors.delay_y_driven == pytest.approx(-30e-6)
    assert case.rig.sensors.delay_angle_driver == 0.0 and found["y_driven.delay"].value == pytest.approx(-30.0)


# Slope and barrelling [um], and of how much of either each estimate is made (of the barrelling's two valleys the one
# where teeth come into mesh comes first).
DRAWN = {
    "slope": ((3.0, 0.0), {"peak_to_valley": (2.0, 0.0), "driven_tip": (-1.0, -1.0), "driver_tip": (1.0, -1.0)}),
    "bow": ((0.0, 3.0), {"peak_to_valley": (1.0, 1.0), "driven_tip": (-1.0, -1.0), "driver_tip": (1.0, -1.0)}),
}


@pytest.mark.parametrize("name", DRAWN)
def test_slope_and_barrelling_are_told_by_the_numbers_of_a_drawing(base: Bench, name: str) -> None:
    """Excess a x + b (1/3 - x^2) along the path, x from -1 to 1: its mean over the path is nothing."""
    values, expected = DRAWN[name]
    form = 1e-6 * np.array([0.0, *values, 0.0, 0.0, 0.0, 0.0])
    case, listed = base.applied("profile-error slope", base.values({"flanks": form}))
    for one in listed:
        parts = np.array(expected[one.name])
        assert one.value == pytest.approx(parts @ values), one.name
        assert one.std == pytest.approx(1e3 * np.hypot(*parts)), one.name  # the bench knows all unknowns to 1 mm
    # What sound flanks seem to have is no error, however well the records tell it.
    told = replace(base.fitted(base.values({"flanks": form})), std=np.zeros(base.unknowns.size))
    good = 1e6 * base.unknowns.prior()[base.unknowns["flanks"]][1:3]
    for one in added(base.nominal, base.hypothesis("profile-error slope"), told)[1]:
        assert one.std == pytest.approx(np.hypot(*(good * expected[one.name]))), one.name
    assert case.rig.driver.profile_form[-1] == pytest.approx(1e-6 * (values[0] - 2 * values[1] / 3))


def test_fields_of_drive_effects(base: Bench) -> None:
    case, listed = base.applied("coupling", base.values({"coupling": 1 / 5e4}))
    found = {estimate.name: estimate for estimate in listed}
    coupling = case.rig.drive.coupling
    assert coupling is not None and coupling.inertia == pytest.approx(2e-3)
    assert coupling.stiffness == pytest.approx(5e4)
    resonance = np.sqrt(5e4 * (1 / 2e-3 + 1 / 3e-4)) / (2 * pi)
    assert found["resonance"].value == pytest.approx(resonance) and found["resonance"].unit == "Hz"
    # A loss factor of 0.05 at resonance.
    assert coupling.damping * 2 * pi * resonance / 5e4 == pytest.approx(0.05)

    case, listed = base.applied("torque-ripple", base.values({"ripple": (3.0, 4.0, 0, 0, 0, -2.0, 0, 0)}))
    ripple = case.rig.drive.ripple
    assert ripple is not None and ripple.orders == (6, 12, 18, 24)
    assert ripple.amplitude == pytest.approx((5.0, 0.0, 2.0, 0.0))
    theta = 0.3
    wave = 3.0 * cos(6 * theta) + 4.0 * np.sin(6 * theta)
    assert ripple.amplitude[0] * cos(6 * theta + ripple.phase[0]) == pytest.approx(wave)
    assert ripple.amplitude[2] * cos(18 * theta + ripple.phase[2]) == pytest.approx(-2.0 * np.sin(18 * theta))
    assert listed[0].value == pytest.approx(0.05) and listed[0].unit == "1"


def test_applied_rigs_can_be_written_and_read(base: Bench, tmp_path: Path) -> None:
    """What the fit may find at its bounds is brought back into what a rig may be."""
    path = tmp_path / "updated.toml"
    for name, values in (
        ("friction", {"friction": -0.05}),
        ("tooth-crack 0", {"crack": -0.5 * (np.arange(50) == 0)}),
        ("bearing-nonlinearity driver", {"bearing-driver": -0.95}),
        ("backlash", {"backlash": -200e-6}),
    ):
        case, _ = base.applied(name, base.values(values))
        path.write_text(dump_case(case), encoding="utf-8")
        assert dump_case(read_case(path)) == dump_case(case), name


def leaves(value: object, path: str) -> dict[str, object]:
    """Numbers and tuples of a rig by their dotted paths."""
    if not hasattr(type(value), "model_fields"):
        return {path: value}
    inner = [leaves(getattr(value, name), f"{path}.{name}") for name in type(value).model_fields]
    return {key: item for one in inner for key, item in one.items()}


@pytest.mark.parametrize("effect", LIBRARY, ids=lambda effect: effect.name)
def test_an_effect_moves_the_fields_that_it_says(base: Bench, effect: Effect) -> None:
    p = 0.5 * base.unknowns.prior()
    plain = recalibrated(base.nominal, base.fitted(p))
    before = leaves(plain.rig, "rig")
    moved: set[str] = set()
    for hypothesis in effect.hypotheses(base.model):
        wide = hypothesis.prior(base.unknowns)
        values = np.where(wide > base.unknowns.prior(), 0.4 * wide, p)
        after = leaves(added(plain, hypothesis, base.fitted(values))[0].rig, "rig")
        moved |= {key for key in {*before, *after} if before.get(key) != after.get(key)}
    fields = {key: [one for one in effect.fields if f"{key}.".startswith(f"{one}.")] for key in moved}
    assert all(fields.values()) and {one for found in fields.values() for one in found} == set(effect.fields)

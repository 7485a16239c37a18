"""One whole search: a motor's torque ripple, simulated in time domain with noise, is found, sized and put back."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from gearbench.bench import simulate
from gearbench.bench.nonlinear.replay import replay
from gearbench.cases import case_files
from gearbench.diagnosis.cause import find_cause
from gearbench.diagnosis.effects.eccentricity import ECCENTRICITY
from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.effects.encoder_runout import ENCODER_RUNOUT
from gearbench.diagnosis.found_by_simulation import with_rivals
from gearbench.diagnosis.intake.measurements import measurement
from gearbench.diagnosis.selection.weighing import Weighed
from gearbench.rig import read_case

RIPPLE = {"orders": "[6, 12]", "amplitude_nm": "[1.5, 0.8]", "phase_deg": "[30, -60]"}


@pytest.mark.validation
def test_torque_ripple_from_records_to_the_rig_that_has_it() -> None:
    path = case_files()["gap_demo"]
    nominal = read_case(path)
    real = read_case(path, [f"rig.drive.ripple.{key}={value}" for key, value in RIPPLE.items()])
    records = {condition.name: simulate(real.under(condition)) for condition in real.conditions[::3]}
    base, held_out = (measurement(record, name, nominal) for name, record in records.items())
    steps: list[str] = []
    found = find_cause([base], nominal, report=steps.append)

    assert (found.verdict, found.place) == ("effects", "drive")
    assert [effect.name for effect in found.effects] == ["torque-ripple"]
    assert found.probability["effect"] > 0.9 and sum(found.probability.values()) == pytest.approx(1.0)
    assert found.candidates[0].effects == ("torque-ripple",)
    assert "background" in steps and "torque-ripple" in steps
    # What no equation of a steady, complete model keeps, and how the verdict says so.
    assert max(found.audits["unsteady"]) < 100 and max(found.audits["missing"]) < 0.3
    assert found.effects[0].due and found.effects[0].closes["dte"].value > 0.0
    assert "ripple" in found.because[1] and found.where[0].kind == "place"
    assert max(found.where, key=lambda share: share.share).name == "drive"

    parameters = found.effects[0].parameters
    for order, amplitude in ((6, 1.5), (12, 0.8)):
        one = parameters[f"order_{order}.relative_amplitude"]
        assert one.std < 0.003 and abs(one.value - amplitude / 100) < 0.0005

    assert found.with_effect is not None
    ripple = found.with_effect.rig.drive.ripple
    assert ripple is not None and ripple.phase[:2] == pytest.approx((radians(30), radians(-60)), abs=0.1)
    plain = found.recalibrated.rig.drive.ripple  # a good rig's share of it
    assert plain is None
    # A record that the search has not seen, in the bins of the ripple: 6 and 12 times 2.5 Hz, angle of the driver.
    errors = []
    for case in (found.recalibrated, found.with_effect):
        simulated = measurement(replay(case, held_out.record), "held-out", nominal)
        left = np.fft.rfft(held_out.mean("angle_driver") - simulated.mean("angle_driver"))
        errors.append(np.linalg.norm(left[[18, 36]]))
    assert errors[1] < 0.1 * errors[0]


def test_a_named_effect_and_its_rivals_are_a_group() -> None:
    named, rival = (
        Hypothesis(effect.name, "mesh", (), effect=effect) for effect in (ECCENTRICITY, ENCODER_RUNOUT)
    )
    groups = (("friction", "mesh-damping"), ("eccentricity", "pitch-error"))
    both = ("eccentricity", "encoder-runout")
    assert with_rivals(groups, [Weighed(named, 30.0, None, (rival,))]) == (*groups, both)
    assert with_rivals((*groups, both), [Weighed(named, 30.0, None, (rival,))]) == (*groups, both)
    assert with_rivals(groups, [Weighed(named, 30.0, None)]) == groups

"""A rig whose flanks part in all of its records, from these to what is named."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.bench import simulate
from gearbench.cases import case_files
from gearbench.diagnosis.cause import find_cause
from gearbench.diagnosis.intake.measurements import measurement
from gearbench.diagnosis.replay.gap import gaps
from gearbench.diagnosis.replay.replays import replays_of
from gearbench.rig import read_case

RUNOUT = 14e-6


@pytest.mark.validation
def test_run_out_of_a_rig_that_rattles_is_found_with_its_size() -> None:
    """The supports are softer than the nominal ones too, and only the rig with both comes near the held-out record."""
    nominal = read_case(case_files()["gap_demo"], ["experiment.multisine.amplitude_nm=130.0"])
    rig = nominal.rig
    driver = rig.driver.model_copy(update={"runout": RUNOUT, "runout_phase": 0.8})
    held = rig.support.driver
    support = rig.support.model_copy(update={"driver": held.model_copy(update={"stiffness": 0.96 * held.stiffness})})
    real = nominal.model_copy(update={"rig": rig.model_copy(update={"driver": driver, "support": support})})
    records = {one.name: simulate(real.under(one)) for one in nominal.conditions if one.name != "fast"}
    lost = {name: one.attrs["contact_lost_samples"] / one.sizes["time"] for name, one in records.items()}
    assert min(lost.values()) > 0.1
    measured = {name: measurement(record, name, nominal) for name, record in records.items()}
    out = measured.pop("held-out")
    found = find_cause(list(measured.values()), nominal, held_out=out)
    (effect,) = found.effects
    assert effect.name == "eccentricity"
    size = effect.parameters["driver.runout"]
    assert size.value == pytest.approx(1e6 * RUNOUT, rel=0.1)
    assert size.low < 1e6 * RUNOUT < size.high
    simulate_again = replays_of(nominal, [*measured.values()])
    shrunk = gaps(nominal, found.recalibrated, found.with_effect, out, simulate=simulate_again)
    gap = next(one for one in shrunk if one.channel == "dte")
    assert gap.with_effect is not None
    assert gap.with_effect.value < 0.15 * gap.nominal.value
    assert np.isfinite(gap.recalibrated.value)

"""What the records themselves tell to measure next."""

from __future__ import annotations

import numpy as np
from shared.measured import SAMPLES, channels, nominal, record

from gearbench.diagnosis.advice import advice_of
from gearbench.diagnosis.intake.measurements import Measurement, measurement


def taken(name: str, **changes: float) -> Measurement:
    return measurement(record(channels(**changes), mesh_period=None), name, nominal())


def test_a_complete_set_needs_nothing_more() -> None:
    fast = measurement(
        record(channels(torque=70.0, mesh=60.0, samples=10240), mesh_period=None, samples_per_period=10240),
        "fast",
        nominal(),
    )
    assert advice_of([taken("base"), taken("light", torque=40.0), fast], taken("held-out", torque=80.0)) == ()


def test_another_torque_another_speed_and_a_held_out_record_are_asked_for() -> None:
    torque, speed, held_out = advice_of([taken("base"), taken("base-2", torque=105.0)], None)
    assert "another mean torque" in torque and "another speed" in speed and "held out" in held_out
    assert len(advice_of([taken("base"), taken("light", torque=40.0)], None)) == 2


def test_channels_periods_and_drift_are_named_with_their_records() -> None:
    values = channels()
    lacking = {name: value[:SAMPLES] for name, value in values.items() if name != "y_driven"}
    short = measurement(record(lacking, periods=1), "short", nominal())
    ramp = 1e-6 * np.linspace(0.0, 1.0, 2 * SAMPLES)
    warm = measurement(record({**values, "y_driven": values["y_driven"] + ramp}), "warm", nominal())
    said = advice_of([short, warm], taken("held-out", torque=80.0))
    assert said[0].startswith("Measure the displacement of the driven gear") and said[0].endswith("missing in short.")
    assert said[1].startswith("Record two hunting periods") and said[1].endswith("only in short.")
    assert "warm drifted" in said[2]

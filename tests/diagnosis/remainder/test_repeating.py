"""What changes from one repetition to the next, of records whose motion need not repeat."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import xarray as xr
from shared.synthetic import SAMPLES, measurement

from gearbench.diagnosis.remainder.repeating import repeating, sentences_of_others

ATTRIBUTES = {"base_radius_driver": 0.028, "base_radius_driven": 0.042, "working_pressure_angle": 0.35}


def test_a_record_whose_flanks_part_says_nothing_of_what_changes() -> None:
    steady = replace(measurement(), record=xr.Dataset(attrs=ATTRIBUTES))
    wave = 3e-6 * np.cos(2 * np.pi * 40 * np.arange(SAMPLES) / SAMPLES)
    seen = steady.periods["y_driver"] + wave * np.array([[1.0], [-1.0]])
    parting = replace(steady, name="light", periods=dict(steady.periods) | {"y_driver": seen})
    restless = frozenset[str]()
    found = cast(Any, SimpleNamespace(simulator=SimpleNamespace(held_by=(steady,)), restless=restless))
    records = (steady, parting)

    assert repeating(records, found) == (steady,)
    assert repeating(records, None) == records
    (sentence,) = sentences_of_others(records, (steady,), 2000.0)
    assert "light" in sentence and "flanks part" in sentence
    assert sentences_of_others(records, records, 2000.0) == ()
    assert sentences_of_others((steady,), (), 2000.0) == ()  # nothing changes there but noise

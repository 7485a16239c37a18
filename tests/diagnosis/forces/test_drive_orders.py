"""Torque that the drive lacks at orders of the driver, against balances written out here."""

from __future__ import annotations

import numpy as np
import pytest
from shared.measured import channels, nominal, record

from gearbench.diagnosis.effects.torque_ripple import ORDERS, orders_of
from gearbench.diagnosis.forces.condition import Condition, prepare
from gearbench.diagnosis.forces.drive_orders import missing_orders
from gearbench.diagnosis.forces.nominal import nominal_model
from gearbench.diagnosis.intake.measurements import measurement

MODEL = nominal_model(nominal(), 220.0, 100.0)
LEAST = 0.003


def condition(waves: dict[int, float], gain: float = 1.0, told: float = 0.0) -> Condition:
    """A rig whose load bears these parts of the mean torque more, by orders of the driver, than its drive is said to
    give but for the part `told`; the load's sensor has a gain."""
    values, torque = channels(), 100.0
    turned = 2 * np.pi * values["mesh_phase"] / MODEL.teeth[0]
    rippling = sum((part * np.cos(order * turned + 0.7) for order, part in waves.items()), np.zeros_like(turned))
    values["torque_driver"] = values["torque_driver"] + told * torque * rippling
    more = torque * rippling * MODEL.base_radius[1] / MODEL.base_radius[0]
    values["torque_driven"] = gain * (values["torque_driven"] + more)
    return prepare(measurement(record(values), "base", nominal()), MODEL, 300.0)


def test_a_drive_that_gives_what_the_load_bears_lacks_nothing() -> None:
    for one in (condition({}), condition({2: 0.05}, told=1.0), condition({2: 0.05}, told=1.0, gain=1.02)):
        assert not missing_orders(MODEL, [one], LEAST).any()
        assert orders_of(MODEL, [one]) == ORDERS


def test_what_a_drive_lacks_is_read_by_orders() -> None:
    conditions = [condition({2: 0.03, 7: 0.02, 9: 0.002}), condition({2: 0.025, 7: 0.02, 11: 0.05})]
    found = missing_orders(MODEL, conditions, LEAST)
    assert np.flatnonzero(found).tolist() == [1, 6]  # what one condition alone has is no ripple of the drive
    assert found[[1, 6]] == pytest.approx([0.025, 0.02], rel=0.03)
    assert orders_of(MODEL, conditions) == (2, 6, 7, 12, 18, 24)


def test_balances_that_no_line_keeps_tell_no_order() -> None:
    values = channels()
    repeated = np.tile(np.random.default_rng(4).standard_normal(len(values["torque_driven"]) // 2), 2)
    values["torque_driven"] = values["torque_driven"] + 100.0 * repeated
    rough = prepare(measurement(record(values), "base", nominal()), MODEL, 300.0)
    assert orders_of(MODEL, [rough]) == ORDERS


def test_mesh_orders_and_records_without_a_reaction_tell_nothing() -> None:
    mesh = MODEL.teeth[0]
    assert not missing_orders(MODEL, [condition({mesh: 0.05, mesh + 3: 0.05})], LEAST).any()
    values = channels()
    del values["torque_driven"]
    silent = prepare(measurement(record(values), "base", nominal()), MODEL, 300.0)
    assert orders_of(MODEL, [silent]) == ORDERS

"""A small rig with all its unknowns: the twins of z = 20, meshed as coarsely as a tooth allows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gearbench.fem.full.gear import FullGear, make_gear
from gearbench.fem.full.machine import Machine, make_machine
from gearbench.geometry.tooth.body import body
from gearbench.rig import Damping, Load, Support, Supports


@pytest.fixture(scope="session")
def coarse_gear(twins: Any) -> FullGear:
    return make_gear(twins.rig.driver, twins.rig.material, twins.rig.driver.module / 2)


@pytest.fixture(scope="session")
def build(twins: Any, coarse_gear: FullGear) -> Callable[..., Machine]:
    def machine(
        mesh_frequency: float = 0.0,
        *,
        beta: float = 0.0,
        stiffness: float = 2e8,
        damping: float = 0.0,
        boundary: str = "speed",
        inertia: float | None = None,
    ) -> Machine:
        support = Support(stiffness=stiffness, damping=damping)
        rig = twins.rig.model_copy(
            update={
                "support": Supports(driver=support, driven=support),
                "load": Load(boundary=boundary),
                "damping": Damping(material_ratio=beta * np.pi * 1250.0),
            }
        )
        gear = rig.driver.model_copy(update={"inertia": inertia})
        one = body(twins.pair.driver, gear, rig.material.density)
        return make_machine(rig, twins.pair, twins.law, (coarse_gear, coarse_gear), (one, one), mesh_frequency)

    return machine

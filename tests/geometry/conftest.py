"""Gears and rigs for the geometry tests."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from gearbench.rig import Gear, Rig, Support, Supports


def make_gear(**changes: Any) -> Gear:
    """A standard gear with 20 teeth of 2 mm; its hub circle has half of its root radius unless given."""
    data: dict[str, Any] = {"teeth": 20, "module": 2e-3, "face_width": 0.02, **changes}
    shift, dedendum = data.get("profile_shift", 0.0), data.get("dedendum", 1.25)
    data.setdefault("hub_radius", 0.5 * data["module"] * (data["teeth"] / 2 - dedendum + shift))
    return Gear(**data)


def make_rig(driver: Gear, driven: Gear, **changes: Any) -> Rig:
    """A rig of two gears on soft supports."""
    support = Support(stiffness=6e6)
    return Rig(driver=driver, driven=driven, support=Supports(driver=support, driven=support), **changes)


@pytest.fixture
def gear() -> Callable[..., Gear]:
    return make_gear


@pytest.fixture
def rig() -> Callable[..., Rig]:
    return make_rig

"""The data sheet: complete, in drawing units, and right where a hand calculation exists."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, radians

import pytest

from gearbench.geometry import data_sheet
from gearbench.rig import Gear, Rig

MakeGear = Callable[..., Gear]
MakeRig = Callable[..., Rig]


def test_documented_pair(gear: MakeGear, rig: MakeRig) -> None:
    one = gear(teeth=62, bore_radius=0.0175, hub_radius=0.0175)
    rows = data_sheet(rig(one, one))
    sheet = {row.name: (row.value, row.unit) for row in rows}
    assert len(sheet) == len(rows)
    expected = {
        "centre distance": (124.0, "mm"),
        "working pressure angle": (20.0, "deg"),
        "contact ratio with sharp tips": (1.78978, ""),
        "base pitch": (2 * pi * cos(radians(20)), "mm"),
        "backlash, circumferential": (0.0, "um"),
        "common face width": (20.0, "mm"),
        "driver reference diameter": (124.0, "mm"),
        "driver working pitch diameter": (124.0, "mm"),
        "driver base diameter": (124 * cos(radians(20)), "mm"),
        "driver tip diameter": (128.0, "mm"),
        "driven root diameter": (119.0, "mm"),
        "driven tooth thickness at the reference circle": (pi, "mm"),
        "driven tip clearance": (0.5, "mm"),
        "driven hub diameter": (35.0, "mm"),
        "driven mass of the hub": (0.0, "kg"),
    }
    for name, (value, unit) in expected.items():
        assert sheet[name][0] == pytest.approx(value, rel=1e-5, abs=1e-9), name
        assert sheet[name][1] == unit
    assert (
        119
        < sheet["driver root form diameter"][0]
        < sheet["driver start of active profile diameter"][0]
        < 124
    )
    assert 127.8 < sheet["driver tip form diameter"][0] < 128
    assert sheet["driver mass"][0] == pytest.approx(1.736, rel=0.02)
    assert sheet["driver inertia"] == (pytest.approx(3.6025e-3, rel=0.03), "kg m^2")

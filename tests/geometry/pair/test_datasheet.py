"""The data sheet: complete, in drawing units, and right where a hand calculation exists."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, degrees, hypot, isnan, pi, radians, sin, sqrt, tan

import pytest

from gearbench.geometry import GeometryError, data_sheet
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
    assert 119 < sheet["driver root form diameter"][0] < sheet["driver start of active profile diameter"][0] < 124
    assert 127.8 < sheet["driver tip form diameter"][0] < 128
    assert sheet["driver mass"][0] == pytest.approx(1.736, rel=0.02)
    assert sheet["driver inertia"] == (pytest.approx(3.6025e-3, rel=0.03), "kg m^2")


def test_flanks_and_backlash_of_a_pair(gear: MakeGear, rig: MakeRig) -> None:
    """A hand calculation: z 20/40, m 2, thinned by 60 and 40 um, sharp tips."""
    one, two = gear(teeth=20, thinning=60e-6, tip_edge_radius=0.0), gear(teeth=40, thinning=40e-6, tip_edge_radius=0.0)
    sheet = {row.name: (row.value, row.unit) for row in data_sheet(rig(one, two), [40e-3, 80e-3])}
    alpha = radians(20)
    base = 20 * cos(alpha), 40 * cos(alpha)
    line = 60 * sin(alpha)
    end = sqrt(22**2 - base[0] ** 2), sqrt(42**2 - base[1] ** 2)
    start = line - end[1], line - end[0]
    expected = {
        "backlash, circumferential": (100.0, "um"),
        "backlash, normal": (100 * cos(alpha), "um"),
        "driver backlash, angular, mate at rest": (degrees(0.1 / 20), "deg"),
        "driven backlash, angular, mate at rest": (degrees(0.1 / 40), "deg"),
        "path of approach": (20 * sin(alpha) - start[0], "mm"),
        "path of recess": (end[0] - 20 * sin(alpha), "mm"),
        "line of action between the base circles": (line, "mm"),
        "driver start of active profile diameter": (2 * hypot(base[0], start[0]), "mm"),
        "driven start of active profile diameter": (2 * hypot(base[1], start[1]), "mm"),
        "driven end of active profile diameter": (84.0, "mm"),
        "driver inner point of single contact diameter": (2 * hypot(base[0], end[0] - 2 * pi * cos(alpha)), "mm"),
        "driver outer point of single contact diameter": (2 * hypot(base[0], start[0] + 2 * pi * cos(alpha)), "mm"),
        "driver roll angle at the start of active profile": (degrees(start[0] / base[0]), "deg"),
        "driven roll angle at the pitch point": (degrees(tan(alpha)), "deg"),
        "driven roll angle at the end of active profile": (degrees(end[1] / base[1]), "deg"),
        # Speeds of both flanks along the common tangent: omega rho.
        "driver specific sliding, start of active profile": (1 - end[1] / 2 / start[0], ""),
        "driver specific sliding, end of active profile": (1 - start[1] / 2 / end[0], ""),
        "driven specific sliding, start of active profile": (1 - 2 * end[0] / start[1], ""),
        "driven specific sliding, end of active profile": (1 - 2 * start[0] / end[1], ""),
        "driver involute lost to undercut, on the diameter": (0.0, "mm"),
        "driver generating profile shift coefficient": (-0.06 / 4 / tan(alpha), ""),
        "driver tooth thickness at the working pitch circle": (pi - 0.06, "mm"),
        "driven tooth thickness at diameter 80 mm": (pi - 0.04, "mm"),
        "driver tooth thickness at diameter 40 mm": (pi - 0.06, "mm"),
        "driven chordal thickness at the reference circle": (80 * sin((pi - 0.04) / 80), "mm"),
    }
    for name, (value, unit) in expected.items():
        assert sheet[name] == (pytest.approx(value, rel=1e-9, abs=1e-9), unit), name
    assert isnan(sheet["driven tooth thickness at diameter 40 mm"][0])
    with pytest.raises(
        GeometryError, match=r"diameter_mm = 60 is on neither gear's teeth: 3\S+ to 44 mm or \S+ to 84 mm"
    ):
        data_sheet(rig(one, two), [60e-3])


def test_undercut_in_the_data_sheet(gear: MakeGear, rig: MakeRig) -> None:
    sheet = {row.name: row.value for row in data_sheet(rig(gear(teeth=10), gear(teeth=30)))}
    lost = sheet["driver root form diameter"] - sheet["driver base diameter"]
    assert sheet["driver involute lost to undercut, on the diameter"] == pytest.approx(lost)
    assert lost > 0.1
    assert sheet["driver start of active profile diameter"] == pytest.approx(sheet["driver root form diameter"])
    # The wheel's tip part, beyond the end of its active profile, meets nothing.
    assert sheet["driven end of active profile diameter"] < sheet["driven tip form diameter"] - 1

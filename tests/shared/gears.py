"""Gears from the whole space that a case may ask for, for property tests: the same ones in every run."""

from __future__ import annotations

from math import cos, pi, radians, sin, tan
from typing import Any

from hypothesis import strategies as st

from gearbench.rig import Gear, Rig, Support, Supports


def any_gear() -> st.SearchStrategy[Gear]:
    """Whatever the fields of a gear admit, possible or not."""
    return st.builds(
        Gear,
        teeth=st.one_of(st.integers(5, 40), st.integers(5, 1000)),
        module=st.sampled_from([1e-4, 1e-3, 2.5e-3, 0.1]),
        pressure_angle=st.floats(radians(10), radians(35)),
        profile_shift=st.floats(-1.5, 2.0),
        addendum=st.floats(0.0, 2.0, exclude_min=True),
        dedendum=st.floats(0.0, 2.5, exclude_min=True),
        rack_tip_radius=st.floats(0.0, 0.6),
        tip_diameter=st.one_of(st.none(), st.floats(0.0, 1.0, exclude_min=True)),
        tip_edge_radius=st.one_of(st.just(0.0), st.floats(0.0, 1e-3)),
        thinning=st.one_of(st.just(0.0), st.floats(0.0, 5e-3)),
        face_width=st.floats(1e-4, 1.0),
        hub_radius=st.floats(0.0, 1.0, exclude_min=True),
        bore_radius=st.one_of(st.just(0.0), st.floats(0.0, 0.5)),
    )


@st.composite
def likely_gear(draw: st.DrawFn, **fixed: Any) -> Gear:
    """Gears most of which are possible: deep and shallow racks, undercut, pointed, thin and thick rims."""
    teeth = draw(st.one_of(st.integers(5, 20), st.integers(5, 60), st.integers(5, 400)))
    module = draw(st.sampled_from([2e-4, 1e-3, 3.175e-3, 2e-2]))
    alpha = draw(st.floats(radians(10), radians(35)))
    dedendum = draw(st.floats(0.5, min(2.4, 0.98 * pi / 4 / tan(alpha))))
    room = (pi / 4 - dedendum * tan(alpha)) * cos(alpha) / (1 - sin(alpha))
    rounding = draw(st.floats(0.0, 1.0)) * min(0.6, room, dedendum)
    shift = draw(st.floats(-0.8, 1.2))
    thinning = draw(st.sampled_from([0.0, 0.0, 0.02])) * module
    root = module * (teeth / 2 - dedendum + shift) - thinning / 2 / tan(alpha)
    data = {
        "teeth": teeth,
        "module": module,
        "pressure_angle": alpha,
        "profile_shift": shift,
        "addendum": draw(st.floats(0.3, 1.4)),
        "dedendum": dedendum,
        "rack_tip_radius": rounding,
        "tip_edge_radius": min(1e-3, draw(st.sampled_from([0.0, 5e-3, 2.5e-2, 0.1])) * module),
        "thinning": thinning,
        "face_width": 10 * module,
        "hub_radius": max(root, module) * draw(st.floats(0.05, 1.0)),
        **fixed,
    }
    if 0.0 < data["tip_edge_radius"] < 1e-6:
        data["tip_edge_radius"] = 0.0
    return Gear(**data)


@st.composite
def likely_pair(draw: st.DrawFn) -> Rig:
    """Two gears of one rack, many of which can run: undercut pinions, long and short tips, backlash."""
    alpha = draw(st.floats(radians(14), radians(28)))
    dedendum = draw(st.floats(1.0, 1.35))
    room = (pi / 4 - dedendum * tan(alpha)) * cos(alpha) / (1 - sin(alpha))
    rack = {
        "module": 2e-3,
        "pressure_angle": alpha,
        "dedendum": dedendum,
        "rack_tip_radius": draw(st.floats(0.0, 1.0)) * min(0.6, room),
        "tip_edge_radius": draw(st.sampled_from([0.0, 2e-5, 1e-4])),
        "face_width": 0.02,
        "hub_radius": 5e-4,
    }
    gears = [
        Gear(
            teeth=draw(teeth),
            profile_shift=draw(st.floats(-0.3, 0.6)),
            addendum=draw(st.floats(0.75, 1.15)),
            **rack,
        )
        for teeth in (st.integers(7, 24), st.integers(12, 120))
    ]
    if draw(st.booleans()):
        gears.reverse()
    nominal = 1e-3 * (gears[0].teeth + gears[1].teeth)
    distance = draw(st.one_of(st.none(), st.floats(1.0, 1.03).map(lambda spread: spread * nominal)))
    support = Support(stiffness=1e7)
    return Rig(
        driver=gears[0],
        driven=gears[1],
        centre_distance=distance,
        support=Supports(driver=support, driven=support),
    )

"""The envelope of the rolling rack, and gears that try it: an independent formulation of the tooth profile."""

from __future__ import annotations

from math import acos, cos, pi, radians, sin, sqrt, tan

import numpy as np
from scipy.optimize import minimize_scalar

from gearbench.geometry import Profile, profile
from gearbench.rig import Gear

GEARS = {
    "z62": {"teeth": 62},
    "z16 shifted": {"teeth": 16, "module": 3.175e-3, "profile_shift": 0.1},
    "z20 thinned": {"teeth": 20, "module": 3e-3, "profile_shift": 0.2, "thinning": 80e-6},
    "z150 negative": {"teeth": 150, "module": 1e-3, "profile_shift": -1.2},
    "z10 positive": {"teeth": 10, "profile_shift": 0.6, "addendum": 0.8},
    "z80 rolling line below the rack tip": {"teeth": 80, "profile_shift": 1.6},
    "sharp rack": {"teeth": 30, "rack_tip_radius": 0.0},
    "sharp tip": {"teeth": 40, "tip_edge_radius": 0.0},
    "steep": {"teeth": 25, "pressure_angle": radians(25), "rack_tip_radius": 0.25},
    "z8 undercut": {"teeth": 8},
    "z10 undercut": {"teeth": 10, "thinning": 60e-6},
    "z12 undercut by a sharp rack": {"teeth": 12, "rack_tip_radius": 0.0},
    "z20 undercut by shift": {"teeth": 20, "profile_shift": -0.7},
    "z17 slightly undercut": {"teeth": 17, "profile_shift": -0.001},
}


def build(**changes: object) -> tuple[Gear, Profile]:
    data = {"module": 2e-3, "face_width": 0.02, "hub_radius": 1e-3, **changes}
    made = Gear(**data)  # type: ignore[arg-type]
    return made, profile(made)


def rack_half_angle(gear: Gear, radius: float) -> float:
    """Largest polar angle at `radius` that the rolling rack leaves on the tooth's counter-clockwise side.

    Independent of the law of gearing: a point of the circle that stands at the angle delta from the pitch
    point's ray lies at the depth d = r - radius cos(delta) below the rolling line; the rack has rolled so far
    that its flank passes through it; the smallest polar angle over all delta is what is left of the tooth.
    """
    m, alpha, tip_radius = gear.module, gear.pressure_angle, gear.rack_tip_radius * gear.module
    reference = m * gear.teeth / 2
    shift = gear.profile_shift - gear.thinning / (2 * m * tan(alpha))
    half_width = m * pi / 4 - shift * m * tan(alpha)  # of the rack tooth on the rolling line
    deepest = (gear.dedendum - shift) * m
    bend = deepest - tip_radius * (1 - sin(alpha))  # where the straight flank ends
    centre = deepest - tip_radius
    offset = half_width - bend * tan(alpha) - tip_radius * cos(alpha)

    def angle(delta: float) -> float:
        depth = reference - radius * cos(delta)
        if depth > deepest:
            return float("inf")
        if depth > bend:
            width = offset + sqrt(max(tip_radius**2 - (depth - centre) ** 2, 0.0))
        else:
            width = half_width - depth * tan(alpha)
        return pi / gear.teeth + delta - (radius * sin(delta) + width) / reference

    reach = acos(min(1.0, max(-1.0, (reference - deepest) / radius)))
    grid = np.linspace(-reach, reach, 1001)
    values = [angle(delta) for delta in grid]
    best = int(np.argmin(values))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(angle, bounds=(low, high), method="bounded", options={"xatol": 1e-13})
    return min(values[best], float(found.fun))

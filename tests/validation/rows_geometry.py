"""Geometry: profile against the rolling rack, kinematics against closed forms."""

from __future__ import annotations

from itertools import product
from math import acos, cos, pi, sin, sqrt, tan

import numpy as np
from scipy.optimize import brentq
from shared.rack import GEARS, build, rack_half_angle

from gearbench.commands.house.checks import Check
from gearbench.geometry import pair
from gearbench.rig import Gear, Rig, Support, Supports


def profile_against_rack() -> float:
    """Largest distance [m], along the circle, of involute and trochoid from the rack's envelope."""
    worst = 0.0
    for changes in GEARS.values():
        gear, tooth = build(**changes)
        fillet = tooth.fillet(np.linspace(0.05, 1.0, 8) * tooth.beta_form)
        flank = tooth.involute(np.linspace(tooth.rho_form, tooth.rho_end, 8))
        for point in np.concatenate((fillet, flank)):
            radius = float(np.hypot(*point))
            angle = rack_half_angle(gear, radius)
            worst = max(worst, radius * abs(angle - float(np.arctan2(point[1], point[0]))))
    return worst


def involute_angle(alpha: float) -> float:
    """inv(alpha)."""
    return tan(alpha) - alpha


def kinematics() -> float:
    """Largest error of centre distance [m], base pitch [m] and contact ratio (times the base pitch) [m]."""
    worst = 0.0
    alpha = pi / 9
    support = Support(stiffness=1e8)
    for z1, z2, x1, x2 in product((18, 62), (40, 62), (0.0, 0.35), (-0.1, 0.2)):
        m = 3e-3
        gears = [
            Gear(
                teeth=z,
                module=m,
                profile_shift=x,
                face_width=0.02,
                hub_radius=0.25 * z * m,
                tip_edge_radius=0.0,
            )
            for z, x in ((z1, x1), (z2, x2))
        ]
        found = pair(Rig(driver=gears[0], driven=gears[1], support=Supports(driver=support, driven=support)))
        wanted = involute_angle(alpha) + 2 * (x1 + x2) * tan(alpha) / (z1 + z2)
        working = brentq(lambda a, w=wanted: involute_angle(a) - w, 0.01, 1.2, xtol=1e-15)
        distance = m * (z1 + z2) / 2 * cos(alpha) / cos(working)
        pitch = pi * m * cos(alpha)
        path = -distance * sin(working)
        for z, x in ((z1, x1), (z2, x2)):
            tip, base = m * (z / 2 + 1 + x), m * z / 2 * cos(alpha)
            path += sqrt(tip**2 - base**2)
        worst = max(
            worst,
            abs(found.centre_distance - distance),
            abs(found.base_pitch - pitch),
            abs(found.contact_ratio - path / pitch) * pitch,
            abs(found.working_pressure_angle - acos(m * (z1 + z2) / 2 * cos(alpha) / distance)) * distance,
        )
    return worst


CHECKS = [
    Check(
        "geometry-rack",
        f"involute and trochoid against the rolling rack, {len(GEARS)} gears, 5 undercut",
        1e-9,
        "m",
        profile_against_rack,
    ),
    Check(
        "geometry-kinematics", "centre distance, base pitch, contact ratio, 16 pairs", 1e-9, "m", kinematics
    ),
]

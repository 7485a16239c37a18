"""The boundary of half a tooth sector, from the middle of the tooth to the middle of the tooth space, by arc length."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.profile import Profile, radial

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Segment:
    """One smooth piece. `points` maps arc length from the piece's start (n,) to points (n, 2); so does `curvature`
    to magnitudes of curvature (n,) [1/m]."""

    name: str
    length: float
    points: Callable[[Array], Array]
    curvature: Callable[[Array], Array]


def half_outline(tooth: Profile) -> tuple[Segment, ...]:
    """Tip land, tip edge, involute, fillet, root land of the counter-clockwise half; pieces without length left out."""
    edge_length, flank_length = tooth.s_tip - tooth.s_end, tooth.s_end - tooth.s_form
    fillet_length = float(tooth.fillet_length(tooth.beta_form))
    land_start = pi / tooth.teeth - tooth.root_half_angle
    base = tooth.base_radius

    def fillet_beta(length: Array) -> Array:
        return tooth.fillet_beta(fillet_length - length)

    pieces = (
        Segment(
            "tip land",
            tooth.tip_radius * tooth.tip_half_angle,
            lambda t: tooth.tip_radius * radial(t / tooth.tip_radius),
            lambda t: np.full_like(t, 1 / tooth.tip_radius),
        ),
        Segment(
            "tip edge",
            edge_length,
            lambda t: tooth.points(tooth.s_tip - t),
            lambda t: np.full_like(t, 1 / tooth.edge_radius),
        ),
        Segment(
            "involute",
            flank_length,
            lambda t: tooth.points(tooth.s_end - t),
            # A form point on the base circle has no radius of curvature; a mesh cannot and need not follow that.
            lambda t: 1 / np.maximum(tooth.roll(tooth.s_end - t), 0.02 * base),
        ),
        Segment(
            "fillet",
            fillet_length,
            lambda t: tooth.fillet(fillet_beta(t)),
            lambda t: 1 / np.maximum(tooth.fillet_radius(fillet_beta(t)), 1e-3 * tooth.module),
        ),
        Segment(
            "root land",
            tooth.root_radius * tooth.root_half_angle,
            lambda t: tooth.root_radius * radial(land_start + t / tooth.root_radius),
            lambda t: np.full_like(t, 1 / tooth.root_radius),
        ),
    )
    return tuple(piece for piece in pieces if piece.length > 1e-9 * tooth.module)

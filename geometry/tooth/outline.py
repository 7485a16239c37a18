"""The outline of half a tooth, from its middle to the middle of the next tooth space, by arc length."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.tooth.profile import Profile, radial

Array = NDArray[np.float64]

SAMPLES = 129


@dataclass(frozen=True)
class Segment:
    """One smooth piece. `points` maps arc length from the piece's start (n,) to points (n, 2); so does
    `curvature` to magnitudes of curvature (n,) [1/m]. `samples` are rising arc lengths from 0 to `length`,
    close together where the curvature is large."""

    name: str
    length: float
    points: Callable[[Array], Array]
    curvature: Callable[[Array], Array]
    samples: Array


def _even(length: float) -> Array:
    return np.linspace(0.0, length, SAMPLES)


def half_outline(tooth: Profile) -> list[Segment]:
    """Tip land, tip edge, involute, fillet, root land of the counter-clockwise half, if they have a
    length."""
    tip, root, edge = tooth.tip_radius, tooth.root_radius, tooth.edge_radius
    land, land_start = tip * tooth.tip_half_angle, pi / tooth.teeth - tooth.root_half_angle
    pieces = [
        Segment(
            "tip land",
            land,
            lambda t: tip * radial(t / tip),
            lambda t: np.full_like(t, 1 / tip),
            _even(land),
        ),
        Segment(
            "tip edge",
            tooth.s_tip - tooth.s_end,
            lambda t: tooth.points(tooth.s_tip - t),
            lambda t: np.full_like(t, 1 / edge),
            _even(tooth.s_tip - tooth.s_end),
        ),
        Segment(
            "involute",
            tooth.s_end - tooth.s_form,
            lambda t: tooth.points(tooth.s_end - t),
            # On the base circle the radius of curvature vanishes: no mesh can or need follow that.
            lambda t: 1 / np.maximum(tooth.roll(tooth.s_end - t), 0.02 * tooth.base_radius),
            _even(tooth.s_end - tooth.s_form),
        ),
        _fillet(tooth),
        Segment(
            "root land",
            root * tooth.root_half_angle,
            lambda t: root * radial(land_start + t / root),
            lambda t: np.full_like(t, 1 / root),
            _even(root * tooth.root_half_angle),
        ),
    ]
    return [piece for piece in pieces if piece.length > 1e-9 * tooth.module]


def _fillet(tooth: Profile) -> Segment:
    """The fillet, from the involute to the root circle."""
    length = float(tooth.fillet_length(tooth.beta_form))

    def beta(t: Array) -> Array:
        return tooth.fillet_beta(length - t)

    by_angle = length - tooth.fillet_length(np.linspace(tooth.beta_form, 0.0, SAMPLES))
    samples = np.unique(np.clip(np.concatenate((_even(length), by_angle)), 0.0, length))
    return Segment(
        "fillet",
        length,
        lambda t: tooth.fillet(beta(t)),
        lambda t: 1 / np.maximum(tooth.fillet_radius(beta(t)), 1e-9 * tooth.module),
        samples,
    )


def joined(first: Segment, second: Segment) -> Segment:
    """Two successive pieces as one, under the name of the longer."""
    split = first.length

    def either(one: Callable[[Array], Array], two: Callable[[Array], Array], t: Array) -> Array:
        before, after = one(np.minimum(t, split)), two(np.maximum(t - split, 0.0))
        return np.where((t <= split).reshape((-1,) + (1,) * (before.ndim - 1)), before, after)

    return Segment(
        max(first, second, key=lambda piece: piece.length).name,
        split + second.length,
        lambda t: either(first.points, second.points, t),
        lambda t: either(first.curvature, second.curvature, t),
        np.concatenate((first.samples, split + second.samples[1:])),
    )

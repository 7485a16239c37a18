"""Two gears rolled on each other as plain points: how deep one enters the other."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from gearbench.geometry import Pair, Profile


def outline(tooth: Profile) -> np.ndarray:
    """Half of a tooth (n, 2), from the middle of the root land to the tip; its radius never falls."""
    root = pi / tooth.teeth - tooth.root_half_angle * np.linspace(0, 1, 40)
    return np.concatenate(
        (
            tooth.root_radius * np.column_stack((np.cos(root), np.sin(root))),
            tooth.fillet(np.linspace(0, tooth.beta_form, 1500)),
            tooth.points(np.linspace(tooth.s_form, tooth.s_tip, 1500)),
        )
    )


def rotated(points: np.ndarray, angle: float) -> np.ndarray:
    """Points (n, 2) turned counter-clockwise."""
    return points @ np.array([[cos(angle), sin(angle)], [-sin(angle), cos(angle)]])


def overlap(meshing: Pair, tooth: np.ndarray, base: np.ndarray, turns: np.ndarray) -> float:
    """How deep (m, along the circle) points `tooth` of the driven gear's tooth 0 enter the driver's tooth 0 of outline
    `base`, over the driver's rotations `turns`."""
    one, deepest = meshing.driver, 0.0
    rising, bound = np.hypot(*base.T), np.arctan2(base[:, 1], base[:, 0])
    for turn in turns:
        back = turn * one.teeth / meshing.driven.teeth
        world = rotated(tooth, pi + meshing.driven_angle - back) + np.array([meshing.centre_distance, 0.0])
        own = rotated(world, -(meshing.driver_angle + turn))
        radius, angle = np.hypot(*own.T), np.arctan2(own[:, 1], own[:, 0])
        near = (radius > one.root_radius) & (radius < one.end_radius) & (np.abs(angle) < 2 * pi / one.teeth)
        if near.any():
            left = np.interp(radius[near], rising, bound)
            deepest = max(deepest, float(np.max(radius[near] * (left - np.abs(angle[near])))))
    return deepest

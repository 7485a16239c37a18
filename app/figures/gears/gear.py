"""Pictures of the gear pair: the whole, and the mesh where the teeth touch."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.figures.plotting import BLUE, ORANGE, figure, save

if TYPE_CHECKING:
    from gearbench.geometry import Pair, PairMesh, Profile
    from gearbench.rig import Rig

Array = NDArray[np.float64]


def draw_pair(path: Path, rig: Rig, meshing: Pair, mesh: PairMesh | None) -> None:
    """Both gears at mesh phase 0, and the contact enlarged, with the finite-element mesh if there is one."""
    with figure(1, 2, (11.0, 5.2)) as (drawing, (whole, near)):
        _draw_outlines(whole, rig, meshing)
        _draw_circles(whole, rig, meshing)
        whole.set_title(
            f"Gear pair z = {rig.driver.teeth}/{rig.driven.teeth}, m = {rig.driver.module * 1e3:g} mm, mesh phase 0"
        )
        largest = 1e3 * max(meshing.driver.tip_radius, meshing.driven.tip_radius)
        whole.set_ylim(-1.1 * largest, 1.1 * largest)
        reach = 2.2e3 * meshing.driver.module
        pitch = meshing.pitch_radii[0] * 1e3
        if mesh is None:
            _draw_outlines(near, rig, meshing)
            near.set_title("Where the teeth touch")
        else:
            _draw_mesh(near, mesh, np.array([pitch, 0.0]) * 1e-3, 1.6e-3 * reach)
            near.set_title(f"Mesh where the teeth touch ({len(mesh.cells)} elements in all)")
        _draw_line_of_action(near, meshing)
        near.set_xlim(pitch - reach, pitch + reach)
        near.set_ylim(-reach, reach)
        for axes in (whole, near):
            axes.set_aspect("equal")
            axes.set_xlabel("x [mm]")
            axes.set_ylabel("y [mm]")
            # Below the axes: inside there are teeth everywhere.
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=4.2, ncols=3)
        save(drawing, path)


def placed(points: Array, angle: float, centre: float) -> Array:
    """Points (n, 2) [m] turned by an angle and moved along x, in mm."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return 1e3 * (points @ turn.T + np.array([centre, 0.0]))


def _gears(rig: Rig, meshing: Pair) -> list[tuple[str, str, Profile, float, float, float, float]]:
    """Name, colour, profile, angle of tooth 0, x of the centre, hub and bore radius of each gear."""
    one, two = rig.driver, rig.driven
    return [
        ("driver", BLUE, meshing.driver, meshing.driver_angle, 0.0, one.hub_radius, one.bore_radius),
        (
            "driven gear",
            ORANGE,
            meshing.driven,
            np.pi + meshing.driven_angle,
            meshing.centre_distance,
            two.hub_radius,
            two.bore_radius,
        ),
    ]


def outline(tooth: Profile) -> Array:
    """Closed outline (n, 2) [m] of the whole gear in its own frame."""
    from gearbench.geometry.tooth.outline import half_outline

    half = np.concatenate([piece.points(piece.samples[::8]) for piece in half_outline(tooth)])
    single = np.concatenate((half[::-1] * [1.0, -1.0], half))
    angles = 2 * np.pi * np.arange(tooth.teeth) / tooth.teeth
    turned = [single @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) for a in angles]
    return np.concatenate([*turned, turned[0][:1]])


def _draw_outlines(axes: Any, rig: Rig, meshing: Pair) -> None:
    for name, colour, tooth, angle, centre, _, _ in _gears(rig, meshing):
        axes.plot(*placed(outline(tooth), angle, centre).T, color=colour, lw=0.9, label=name)


def _draw_circles(axes: Any, rig: Rig, meshing: Pair) -> None:
    turn = np.linspace(0.0, 2 * np.pi, 181)
    circle = np.column_stack((np.cos(turn), np.sin(turn)))
    for _, colour, tooth, _, centre, hub, bore in _gears(rig, meshing):
        # The hub circle may be the bore: dashes over its line.
        for radius, style, width in ((tooth.base_radius, ":", 0.8), (bore, "-", 0.8), (hub, "--", 2.0)):
            axes.plot(*placed(radius * circle, 0.0, centre).T, color=colour, lw=width, ls=style)
    axes.plot([], [], color="k", lw=0.8, ls=":", label="base circles")
    axes.plot([], [], color="k", lw=2.0, ls="--", label="rigid inside")
    if rig.driver.bore_radius or rig.driven.bore_radius:
        axes.plot([], [], color="k", lw=0.8, label="bores")


def _draw_line_of_action(axes: Any, meshing: Pair) -> None:
    alpha, pitch = meshing.working_pressure_angle, meshing.pitch_radii[0]
    along = np.array([np.sin(alpha), np.cos(alpha)])
    start, stop = (rho - meshing.rho_pitch[0] for rho in meshing.active_driver)
    ends = np.array([pitch, 0.0]) + np.outer([start, stop], along)
    axes.plot(*(1e3 * ends).T, color="k", lw=1.6, label="path of contact")
    axes.plot([1e3 * pitch], [0.0], "ko", ms=5, label="pitch point")


def _draw_mesh(axes: Any, mesh: PairMesh, centre: Array, reach: float) -> None:
    """Sides of the elements near the contact, the boundary stronger, with its curved middles."""
    n = mesh.kind.corners
    middle = mesh.points[mesh.corners].mean(axis=1)
    near = np.abs(middle - centre).max(axis=1) < reach
    for gear, colour, name in ((0, BLUE, "driver"), (1, ORANGE, "driven gear")):
        cells = mesh.cells[near & (mesh.gear == gear)]
        sides = np.concatenate([cells[:, [i, n + i, (i + 1) % n]] for i in range(n)])
        lines = _broken(1e3 * mesh.points[sides])
        axes.plot(*lines.T, color=colour, lw=0.35, alpha=0.7)
        count = Counter(int(side[1]) for side in sides)
        edge = sides[[count[int(side[1])] == 1 for side in sides]]
        inside = np.abs(mesh.points[edge[:, 1]] - centre).max(axis=1) < 0.8 * reach
        axes.plot(*_broken(1e3 * mesh.points[edge[inside]]).T, color=colour, lw=1.3, label=name)


def _broken(lines: Array) -> Array:
    """Polylines (n, k, 2) as one array with gaps of NaN between them."""
    gap = np.full((len(lines), 1, 2), np.nan)
    return np.concatenate((lines, gap), axis=1).reshape(-1, 2)

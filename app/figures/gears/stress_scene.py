"""Stress fields drawn by pyvista, where it can render at all.

Without a screen and without EGL or OSMesa, VTK ends the process instead of raising: whether it can draw is found out in
a process of its own.
"""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from gearbench.bench.stress.fields import PairFields

SECONDS_TO_PROBE = 60.0
PROBE = (
    "import pyvista\n"
    "scene = pyvista.Plotter(off_screen=True, window_size=(64, 64))\n"
    "scene.add_mesh(pyvista.Sphere(), color='red')\n"
    "picture = scene.screenshot(return_img=True)\n"
    "raise SystemExit(0 if picture.std() > 0 else 3)\n"
)

BAR: dict[str, Any] = {
    "color": "black",
    "vertical": True,
    "fill": True,
    "background_color": "white",
    "position_x": 0.84,
    "position_y": 0.05,
    "height": 0.5,
    "width": 0.13,
    "title_font_size": 16,
    "label_font_size": 16,
}


@cache
def can_render() -> bool:
    """Whether pyvista draws off screen on this machine."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", PROBE], capture_output=True, timeout=SECONDS_TO_PROBE, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0


def render_fields(fields: PairFields, module: float, path: Path) -> None:
    """Von Mises and largest principal stress of both gears, side by side."""
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    from gearbench.figures.gears.stress import heading, limits, view

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)  # not that there is no screen, which is no secret
    points = np.column_stack([1e3 * fields.mesh.points, np.zeros(len(fields.mesh.points))])
    quadratic = {pyvista.CellType.QUADRATIC_TRIANGLE: fields.mesh.cells}
    scene: Any = pyvista.Plotter(off_screen=True, shape=(1, 2), window_size=[1600, 850], border=False)
    (x, y), half = view(fields, module)
    # What each shows its heading says. The first line of a title is outside of its box; two of one name share a bar.
    names = ("\nMPa", "\n MPa")
    values = (fields.von_mises, fields.principal[:, 0])
    for column, (name, value, top) in enumerate(zip(names, values, limits(fields, module), strict=True)):
        grid = pyvista.UnstructuredGrid(quadratic, points)
        grid.point_data[name] = 1e-6 * value
        scene.subplot(0, column)
        digits = max(0, 2 - floor(log10(top)))
        bar = BAR | {"title": name, "n_labels": 6 + column, "fmt": f"%.{digits}f"}
        # A hair above -0.2: otherwise the label of zero, reached in steps, may read -0.00.
        span = (0.0, top) if column == 0 else (-0.2 * (1 - 1e-9) * top, top)
        scene.add_mesh(grid, scalars=name, cmap="turbo", clim=span, n_colors=64, lighting=False, scalar_bar_args=bar)
        title = f"von Mises stress, {heading(fields)}" if column == 0 else "largest principal stress"
        scene.add_text(title, font_size=11, color="white", shadow=True, position=(10, 815))
        scene.set_background("white")
        scene.view_xy()
        scene.enable_parallel_projection()
        scene.camera.focal_point = (1e3 * x, 1e3 * y, 0.0)
        scene.camera.position = (1e3 * x, 1e3 * y, 100.0)
        scene.camera.parallel_scale = 1e3 * half
    scene.screenshot(str(path))
    scene.close()

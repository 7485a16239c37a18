"""Pictures of stress: fields of both gears at a mesh phase, root stress over the mesh cycle."""

from __future__ import annotations

from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from gearbench.bench.stress.motion import quarters
from gearbench.figures.plotting import BLUE, GREY, ORANGE, figure, save

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.stress.fields import PairFields

Array = NDArray[np.float64]

LEVELS = 41
# Key, name, colour and dashes of ISO's value; where both gears have the same one, both colours show.
GEARS = (("driver", "driver", BLUE, (0.0, (5.0, 7.0))), ("driven", "driven gear", ORANGE, (6.0, (5.0, 7.0))))
ROOM = 1.22  # of the largest root stress: the height of the picture, with the legend on top
CLOSE = 6.0  # half-widths of contact on either side of it in the close-up
ROUND = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)  # limits of colours, times a power of ten
AWAY = 0.5  # modules from a contact within which its stress does not count for the colours


def heading(fields: PairFields) -> str:
    """Title of a picture."""
    return f"mesh phase {fields.phase:g}, driver torque {fields.torque:.4g} N m"


def view(fields: PairFields, module: float) -> tuple[Array, float]:
    """Middle (2,) and half of the height [m] of what a picture shows."""
    at = np.array([one.middle for one in fields.contacts])
    return at.mean(axis=0), 2.2 * module + 0.5 * float(np.ptp(at[:, 1]))


def limits(fields: PairFields, module: float) -> tuple[float, float]:
    """Upper limits [MPa] of the colours of von Mises and of the largest principal stress: the largest values in the
    picture half a module and more away from the contacts, whose own stress is several times that of the roots."""
    middle, half = view(fields, module)
    shown = np.abs(fields.mesh.points - middle).max(axis=1) < half
    for one in fields.contacts:
        shown &= np.hypot(*(fields.mesh.points - one.middle).T) > AWAY * module
    tops = fields.von_mises[shown].max(), fields.principal[shown, 0].max()
    return rounded_up(1e-6 * float(tops[0])), rounded_up(1e-6 * float(tops[1]))


def rounded_up(value: float) -> float:
    """The next larger number of which a fifth is short; a thousandth for what is not positive."""
    if not value > 0.0:
        return 1e-3
    power = 10.0 ** floor(log10(value))
    return power * next(step for step in ROUND if step * power >= value * (1 - 1e-12))


def plot_fields(fields: PairFields, module: float, path: Path) -> None:
    """Von Mises and largest principal stress around the contacts, and the most loaded contact close up."""
    triangles = quarters(fields.mesh.cells)
    middle, half = view(fields, module)
    tops = limits(fields, module)
    close = max(fields.contacts, key=lambda one: one.half_width)
    values = (1e-6 * fields.von_mises, 1e-6 * fields.principal[:, 0])
    reach = CLOSE * close.half_width
    near = np.abs(fields.mesh.points[triangles].mean(axis=1) - close.middle).max(axis=1) < 1.6 * reach
    around = np.abs(fields.mesh.points[triangles].mean(axis=1) - middle).max(axis=1) < 1.3 * half
    with figure(1, 3, size=(15.0, 4.7)) as (drawing, axes):
        drawing.suptitle(heading(fields))
        _contours(
            axes[0], drawing, fields.mesh.points, triangles[around], values[0], (0.0, tops[0]), "von Mises stress [MPa]"
        )
        _contours(
            axes[1], drawing, fields.mesh.points, triangles[around], values[1], (-0.2 * tops[1], tops[1]),
            "largest principal stress [MPa]",
        )  # fmt: skip
        peak = rounded_up(float(values[0][triangles[near]].max())) if near.any() else tops[0]
        _contours(
            axes[2], drawing, fields.mesh.points, triangles[near], values[0], (0.0, peak),
            "von Mises stress at the contact [MPa]",
        )  # fmt: skip
        for panel in axes[:2]:
            _frame(panel, middle, half)
        _frame(axes[2], close.middle, reach)
        save(drawing, path)


def _contours(
    axes: Any, drawing: Any, points: Array, triangles: NDArray[np.int64], values: Array, span: tuple[float, float],
    label: str,
) -> None:  # fmt: skip
    used, renumbered = np.unique(triangles, return_inverse=True)
    net = Triangulation(1e3 * points[used, 0], 1e3 * points[used, 1], renumbered.reshape(-1, 3))
    levels = np.linspace(*span, LEVELS)
    shown = axes.tricontourf(net, values[used], levels, cmap="turbo", extend="both")
    fifth = span[1] / 5
    ticks = np.arange(round(span[0] / fifth), 6) * fifth
    drawing.colorbar(shown, ax=axes, label=label, shrink=0.85, ticks=ticks, format="%.4g")
    axes.grid(False)
    axes.set_title(label.partition(" [")[0])


def _frame(axes: Any, middle: Array, half: float) -> None:
    x, y = 1e3 * middle
    axes.set(xlim=(x - 1e3 * half, x + 1e3 * half), ylim=(y - 1e3 * half, y + 1e3 * half))
    axes.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    axes.locator_params(axis="x", nbins=5)


def plot_root_stress(result: xr.Dataset, path: Path, iso: dict[str, float]) -> None:
    """Root stress of one tooth of each gear over its way through the mesh, under the largest load.

    iso: nominal stresses [MPa] of ISO 6336-3, by gear.
    """
    load = int(np.argmax(result["torque"].values.mean(axis=1)))
    with figure(size=(8.5, 4.8)) as (drawing, axes):
        largest = 0.0
        for name, label, colour, dashes in GEARS:
            phase, stress = tooth_history(result, name, load)
            axes.plot(phase, 1e-6 * stress, color=colour, label=f"{label}, finite elements")
            at = float(result[f"root_stress_phase_{name}"].values[load])
            peak = 1e-6 * float(result[f"root_stress_peak_{name}"].values[load])
            axes.plot([at], [peak], "o", color=colour, ms=5)
            if name in iso:
                axes.axhline(iso[name], color=colour, ls=dashes, lw=1.2, label=f"{label}, ISO 6336-3 sigma_F0")
            largest = max(largest, peak, iso.get(name, 0.0))
        axes.axhline(0.0, color=GREY, lw=0.6)
        torque = float(result["torque"].values[load].mean())
        axes.set(
            title=f"Tension in the tooth root at {torque:.4g} N m",
            xlabel="mesh phase after the pitch point [cycles]",
            ylabel="largest tension in the working root [MPa]",
        )
        axes.set_ylim(top=ROOM * largest if largest > 0.0 else None)
        axes.legend(loc="upper center", ncols=2)
        save(drawing, path)


def tooth_history(result: xr.Dataset, name: str, load: int) -> tuple[Array, Array]:
    """Root stress [Pa] of a gear's teeth over the phase since each one's contact at the pitch point [cycles]."""
    phase = result["phase"].values[:, None] - result["root_stress_tooth"].values[None, :]
    stress = result[f"root_stress_{name}"].values[load]
    order = np.argsort(phase.ravel(), kind="stable")
    return phase.ravel()[order], stress.ravel()[order]

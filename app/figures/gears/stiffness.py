"""Picture of the mesh stiffness by every method over the mesh phase."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gearbench.figures.plotting import BLUE, GREEN, GREY, ORANGE, closed, figure, phase_axis, save

if TYPE_CHECKING:
    from gearbench.bench.results.stiffness_table import StiffnessTable

COLOURS = {
    "finite elements, hub to hub": BLUE,
    "finite elements, bodies rigid in torsion": BLUE,
    "lumped model": BLUE,
    "potential energy, hub to hub": ORANGE,
    "potential energy, bodies rigid in torsion": ORANGE,
    "Weber-Banaschek": GREEN,
}


def draw_stiffness_table(path: Path, table: StiffnessTable) -> None:
    """Secant stiffness over mesh phase; what contains the torsion of the gear bodies is dashed, ISO 6336 knows a mean
    (c_gamma) and the stiffness of one pair (c') only."""
    with figure(1, 1, (8.0, 4.8)) as (drawing, axes):
        for row in table.rows:
            if row.curve is not None:
                style = "--" if row.torsion else "-"
                axes.plot(*closed(table.phase, row.curve / 1e6), style, color=COLOURS[row.model], label=row.model)
                continue
            axes.axhline(row.mean / 1e6, color=GREY, label="ISO 6336-1 c_gamma (mean)")
            if row.single is not None:
                axes.axhline(row.single / 1e6, color=GREY, linestyle=":", label="ISO 6336-1 c' (one pair)")
        phase_axis(axes)
        axes.set_ylabel("mesh stiffness [N/um]")
        axes.set_title(f"Mesh stiffness at {table.torque:.4g} N m")
        axes.set_ylim(bottom=0.0)
        axes.legend(loc="lower center", ncols=2)
        save(drawing, path)

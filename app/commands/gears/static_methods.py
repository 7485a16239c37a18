"""What other methods say beside a static solution: mesh stiffness of each, ISO root stress."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gearbench.words.iso_root_stress import root_stress_data, root_stress_lines
from gearbench.words.stiffness import stiffness_data, stiffness_lines

if TYPE_CHECKING:
    from pathlib import Path

    import xarray as xr

    from gearbench.bench.results.stiffness_table import StiffnessTable
    from gearbench.rig import Case


def stiffness_tables(case: Case, result: xr.Dataset) -> list[StiffnessTable]:
    """A table for each load of a static `result` under which all mesh phases carry, in the order of the loads."""
    from gearbench.bench.results.stiffness_table import stiffness_table

    secant = result["stiffness_secant"].values
    return [stiffness_table(case, result, load) for load in range(len(secant)) if secant[load].min() > 0.0]


def methods_data(case: Case, tables: list[StiffnessTable]) -> dict[str, Any]:
    """Stiffness and root stress for JSON, an entry for each load that carries."""
    return {
        "stiffness": [stiffness_data(table) for table in tables],
        "iso_root_stress": [root_stress_data(case.rig, table.torque) for table in tables],
    }


def methods_lines(case: Case, tables: list[StiffnessTable]) -> list[str]:
    """The same as text, for the largest torque only."""
    if not tables:
        return []
    table = largest(tables)
    return [*stiffness_lines(table), *root_stress_lines(root_stress_data(case.rig, table.torque))]


def largest(tables: list[StiffnessTable]) -> StiffnessTable:
    """The table of the largest torque."""
    return max(tables, key=lambda one: one.torque)


def draw_largest(tables: list[StiffnessTable], path: Path) -> None:
    """Picture of the stiffness by every method under the largest torque. Raises InputError where no load carries."""
    from gearbench.figures.gears.stiffness import draw_stiffness_table
    from gearbench.shell.failure import InputError

    if not tables:
        raise InputError("--stiffness-figure needs a load that closes the gap at every mesh phase: none does")
    draw_stiffness_table(path, largest(tables))

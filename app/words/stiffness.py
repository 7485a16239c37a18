"""The table of stiffnesses as text and as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gearbench.bench.results.stiffness_table import StiffnessTable

MICRO = 1e6  # N/m in one N/um


def stiffness_lines(table: StiffnessTable) -> list[str]:
    """Lines of text: a head, a row for each method, the notes."""
    lines = [
        f"mesh stiffness at {table.torque:.4g} N m [N/um] (force along the line of action over transmission error)",
        f"  {'':<43}{'one pair':>10}{'mean':>10}{'least':>10}{'most':>10}{'mean/width':>12}",
    ]
    for row in table.rows:
        figures = "".join(f"{_figure(value):>10}" for value in (row.single, row.mean, row.least, row.most))
        lines.append(f"  {row.model:<43}{figures}{row.mean / table.face_width / 1e9:>12.2f}")
    lines.append("  one pair: at the pitch point, for ISO c'; mean/width in N/(mm um), for ISO c_gamma")
    return lines + [f"  note: {note}" for note in table.notes]


def stiffness_data(table: StiffnessTable) -> dict[str, Any]:
    """The same for JSON, in N/um."""
    rows = [
        {
            "model": row.model,
            "contains_body_torsion": row.torsion,
            "one_pair_n_per_um": _micro(row.single),
            "mean_n_per_um": _micro(row.mean),
            "least_n_per_um": _micro(row.least),
            "most_n_per_um": _micro(row.most),
        }
        for row in table.rows
    ]
    return {"torque_nm": table.torque, "rows": rows, "notes": list(table.notes)}


def _micro(value: float | None) -> float | None:
    return None if value is None else value / MICRO


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value / MICRO:.1f}"

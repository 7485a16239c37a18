"""Root stress by finite elements beside ISO 6336-3 Method B, as text and as JSON."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Any

from gearbench.words.iso_root_stress import root_stress_data

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.rig import Case

GEARS = ("driver", "driven")
DIFFERENCES = (
    "finite elements: largest tension of the true fillet, wherever it is; force shared as by the static solution",
    "sigma_F0: bending at the 30 degree tangent times Y_S, without factors K; whole force at the outer point",
)


def root_data(case: Case, result: xr.Dataset, load: int) -> dict[str, Any] | None:
    """Both gears under one load of a static result; None for a result without root stress."""
    if "root_stress_tooth" not in result:
        return None
    torque = float(result["torque"].values[load].mean())
    iso = root_stress_data(case.rig, torque)["gears"] if torque > 0.0 else {}
    found = {}
    for name in GEARS:
        value = {key: float(result[f"root_stress_{key}_{name}"].values[load]) for key in _KEYS}
        found[name] = {
            "largest_mpa": value["peak"] / 1e6,
            "radius_mm": value["radius"] * 1e3,
            "tangent_deg": degrees(value["angle"]),
            "phase": value["phase"],
            "outer_point_mpa": value["outer"] / 1e6,
            "sigma_f0_mpa": iso[name]["sigma_f0_mpa"] if name in iso else None,
        }
    return {"torque_nm": torque, "gears": found, "notes": list(DIFFERENCES)}


_KEYS = ("peak", "radius", "angle", "phase", "outer")
_ROWS = (
    ("finite elements, over the mesh cycle [MPa]", "largest_mpa", ".1f"),
    ("  at the radius [mm]", "radius_mm", ".3f"),
    ("  where the tangent is turned from the axis by [deg]", "tangent_deg", ".1f"),
    ("  at this mesh phase after the pitch point [cycles]", "phase", ".3f"),
    ("finite elements, whole force at the outer point [MPa]", "outer_point_mpa", ".1f"),
    ("ISO 6336-3 Method B, sigma_F0 [MPa]", "sigma_f0_mpa", ".1f"),
)


def root_tables(case: Case, result: xr.Dataset) -> list[dict[str, Any]]:
    """`root_data` of every load; empty for a result without root stress."""
    tables = (root_data(case, result, load) for load in range(result.sizes["load"]))
    return [table for table in tables if table is not None]


def root_lines(data: dict[str, Any]) -> list[str]:
    """The same as a table."""
    lines = [f"{'root stress at ' + format(data['torque_nm'], '.4g') + ' N m':<56}{'driver':>10}{'driven':>10}"]
    for label, key, form in _ROWS:
        values = [data["gears"][name][key] for name in GEARS]
        lines.append(f"  {label:<54}" + "".join(f"{'-' if v is None else format(v, form):>10}" for v in values))
    return lines + [f"  note: {note}" for note in data["notes"]]

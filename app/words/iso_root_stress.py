"""Nominal tooth root stress by ISO 6336-3 as text and as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gearbench.rig import Rig


def root_stress_data(rig: Rig, torque: float) -> dict[str, Any]:
    """sigma_F0 [MPa], Y_F and Y_S of both gears under a driver torque [N m], and notes; for contact ratios of 2 and
    more a note only. Raises GeometryError."""
    from gearbench.geometry import pair
    from gearbench.lumped.errors import LumpedError
    from gearbench.lumped.stiffness.iso6336_root import root_stress

    meshing = pair(rig)
    force = torque / meshing.driver.base_radius
    cracked = [f"rig.{name}.crack" for name in ("driver", "driven") if getattr(rig, name).crack is not None]
    sentence = "the teeth are taken as sound, and finite elements give no root stress"
    notes = [f"{' and '.join(cracked)}: {sentence}"] if cracked else []
    try:
        found = {"driver": root_stress(rig, meshing, "driver", force)}
        found["driven"] = root_stress(rig, meshing, "driven", force)
    except LumpedError as error:
        return {"torque_nm": torque, "gears": {}, "notes": [str(error), *notes]}
    gears = {
        name: {"sigma_f0_mpa": value.stress / 1e6, "y_f": value.form, "y_s": value.correction}
        for name, value in found.items()
    }
    notes = [note for value in found.values() for note in value.notes] + notes
    return {"torque_nm": torque, "gears": gears, "notes": notes}


def root_stress_lines(data: dict[str, Any]) -> list[str]:
    """The same as lines of text."""
    lines = [
        f"ISO 6336-3 nominal root stress, {name}: {one['sigma_f0_mpa']:.1f} MPa"
        f" (Y_F = {one['y_f']:.3f}, Y_S = {one['y_s']:.3f})"
        for name, one in data["gears"].items()
    ]
    return lines + [f"  note: {note}" for note in data["notes"]]

"""The data sheet of a rig's gear pair."""

from __future__ import annotations

from math import pi, sqrt
from typing import NamedTuple

from gearbench.geometry.body import Body, body
from gearbench.geometry.pair import Pair, pair
from gearbench.geometry.profile import Profile
from gearbench.rig import Gear, Rig


class Datum(NamedTuple):
    """One row: a name, a value and the unit that the value is in (not SI: the unit of the drawing)."""

    name: str
    value: float
    unit: str


def data_sheet(rig: Rig) -> list[Datum]:
    """Rows for the pair, then for each gear, names led by "driver " or "driven ". Lengths in mm or um, angles
    in deg.

    Raises GeometryError for a rig that cannot exist (see `pair`, `body`).
    """
    meshing = pair(rig)
    rows = _pair_rows(meshing)
    radii = meshing.pitch_radii
    starts = meshing.active_driver[0], meshing.active_driven[0]
    teeth = meshing.driver, meshing.driven
    for i, (label, gear) in enumerate((("driver", rig.driver), ("driven", rig.driven))):
        mass = body(teeth[i], gear, rig.material.density, f"rig.{label}")
        clearance = meshing.clearances[i]
        own = _tooth_rows(teeth[i], gear, radii[i], starts[i], clearance) + _mass_rows(mass)
        rows += [Datum(f"{label} {row.name}", row.value, row.unit) for row in own]
    return rows


def _pair_rows(meshing: Pair) -> list[Datum]:
    alpha = meshing.driver.pressure_angle
    return [
        Datum("centre distance", meshing.centre_distance * 1e3, "mm"),
        Datum("pressure angle", alpha * 180 / pi, "deg"),
        Datum("working pressure angle", meshing.working_pressure_angle * 180 / pi, "deg"),
        Datum("gear ratio", meshing.driven.teeth / meshing.driver.teeth, ""),
        Datum("contact ratio", meshing.contact_ratio, ""),
        Datum("contact ratio with sharp tips", meshing.contact_ratio_sharp, ""),
        Datum("base pitch", meshing.base_pitch * 1e3, "mm"),
        Datum("path of contact", meshing.contact_ratio * meshing.base_pitch * 1e3, "mm"),
        Datum("backlash, circumferential", meshing.backlash * 1e6, "um"),
        Datum("backlash, normal", meshing.backlash_normal * 1e6, "um"),
        Datum("common face width", meshing.face_width * 1e3, "mm"),
    ]


def _tooth_rows(tooth: Profile, gear: Gear, pitch: float, start: float, clearance: float) -> list[Datum]:
    active = sqrt(tooth.base_radius**2 + start**2)
    thickness = float(tooth.thickness(tooth.reference_radius))
    return [
        Datum("teeth", tooth.teeth, ""),
        Datum("module", tooth.module * 1e3, "mm"),
        Datum("profile shift coefficient", gear.profile_shift, ""),
        Datum("face width", gear.face_width * 1e3, "mm"),
        Datum("reference diameter", 2e3 * tooth.reference_radius, "mm"),
        Datum("working pitch diameter", 2e3 * pitch, "mm"),
        Datum("base diameter", 2e3 * tooth.base_radius, "mm"),
        Datum("tip diameter", 2e3 * tooth.tip_radius, "mm"),
        Datum("tip form diameter", 2e3 * tooth.end_radius, "mm"),
        Datum("start of active profile diameter", 2e3 * active, "mm"),
        Datum("root form diameter", 2e3 * tooth.form_radius, "mm"),
        Datum("root diameter", 2e3 * tooth.root_radius, "mm"),
        Datum("hub diameter", 2e3 * gear.hub_radius, "mm"),
        Datum("bore diameter", 2e3 * gear.bore_radius, "mm"),
        Datum("tooth thickness at the reference circle", 1e3 * thickness, "mm"),
        Datum("tip land", 2e3 * tooth.tip_radius * tooth.tip_half_angle, "mm"),
        Datum("tip edge radius", 1e6 * tooth.edge_radius, "um"),
        Datum("tip clearance", 1e3 * clearance, "mm"),
    ]


def _mass_rows(mass: Body) -> list[Datum]:
    return [
        Datum("mass", mass.mass, "kg"),
        Datum("mass outside the hub circle", mass.mass_fe, "kg"),
        Datum("mass of the hub", mass.mass_hub, "kg"),
        Datum("inertia", mass.inertia, "kg m^2"),
        Datum("inertia outside the hub circle", mass.inertia_fe, "kg m^2"),
        Datum("inertia of the hub", mass.inertia_hub, "kg m^2"),
    ]

"""The data sheet of a rig's gear pair."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import degrees, hypot, isfinite, nan, tan
from typing import NamedTuple, TypeVar

from gearbench.geometry.error import GeometryError
from gearbench.geometry.pair.interference import fillet_clearance
from gearbench.geometry.pair.kinematics import Pair, pair
from gearbench.geometry.tooth.body import Body, body
from gearbench.geometry.tooth.measure import chord, over_pins, span, thickness
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Gear, Rig

T = TypeVar("T")


class Datum(NamedTuple):
    """One row: a name, a value and the unit that the value is in (not SI: the unit of the drawing)."""

    name: str
    value: float
    unit: str


def data_sheet(rig: Rig, diameters: Sequence[float] = ()) -> list[Datum]:
    """Rows for the pair, then for each gear, names led by "driver " or "driven ". Lengths in mm or um, angles
    in deg; nan where a gear has no such value. `diameters` [m]: where tooth thicknesses are wanted besides.

    Raises GeometryError for a rig that cannot exist (see `pair`, `body`), and for a diameter on neither gear's teeth.
    """
    meshing = pair(rig)
    rows = _pair_rows(meshing)
    teeth = meshing.driver, meshing.driven
    for diameter in diameters:
        if not any(2 * tooth.root_radius <= diameter <= 2 * tooth.tip_radius for tooth in teeth):
            spans = " or ".join(f"{2e3 * tooth.root_radius:g} to {2e3 * tooth.tip_radius:g} mm" for tooth in teeth)
            raise GeometryError(f"diameter_mm = {diameter * 1e3:g} is on neither gear's teeth: {spans}")
    for i, (label, gear) in enumerate((("driver", rig.driver), ("driven", rig.driven))):
        mass = body(teeth[i], gear, rig.material.density, f"rig.{label}")
        own = _size_rows(teeth[i], gear, meshing.pitch_radii[i]) + _flank_rows(meshing, i)
        own += _thickness_rows(teeth[i], meshing.pitch_radii[i], diameters) + _mass_rows(mass)
        rows += [Datum(f"{label} {row.name}", row.value, row.unit) for row in own]
    return rows


def _pair_rows(meshing: Pair) -> list[Datum]:
    start, stop = meshing.active_driver
    pitch_point = meshing.rho_pitch[0]
    return [
        Datum("centre distance", meshing.centre_distance * 1e3, "mm"),
        Datum("pressure angle", degrees(meshing.driver.pressure_angle), "deg"),
        Datum("working pressure angle", degrees(meshing.working_pressure_angle), "deg"),
        Datum("gear ratio", meshing.driven.teeth / meshing.driver.teeth, ""),
        Datum("contact ratio", meshing.contact_ratio, ""),
        Datum("contact ratio with sharp tips", meshing.contact_ratio_sharp, ""),
        Datum("base pitch", meshing.base_pitch * 1e3, "mm"),
        Datum("path of contact", meshing.contact_ratio * meshing.base_pitch * 1e3, "mm"),
        Datum("path of approach", (pitch_point - start) * 1e3, "mm"),
        Datum("path of recess", (stop - pitch_point) * 1e3, "mm"),
        Datum("line of action between the base circles", meshing.line_of_action * 1e3, "mm"),
        Datum("backlash, circumferential", _play(meshing.backlash) * 1e6, "um"),
        Datum("backlash, normal", _play(meshing.backlash_normal) * 1e6, "um"),
        Datum("common face width", meshing.face_width * 1e3, "mm"),
    ]


def _play(value: float) -> float:
    """A backlash [m or rad] without the rounding of a centre distance that shall leave none."""
    return value if abs(value) > 1e-12 else 0.0


def _size_rows(tooth: Profile, gear: Gear, pitch: float) -> list[Datum]:
    cut = gear.profile_shift - gear.thinning / (2 * gear.module * tan(gear.pressure_angle))
    return [
        Datum("teeth", tooth.teeth, ""),
        Datum("module", tooth.module * 1e3, "mm"),
        Datum("profile shift coefficient", gear.profile_shift, ""),
        Datum("generating profile shift coefficient", cut, ""),
        Datum("face width", gear.face_width * 1e3, "mm"),
        Datum("reference diameter", 2e3 * tooth.reference_radius, "mm"),
        Datum("working pitch diameter", 2e3 * pitch, "mm"),
        Datum("base diameter", 2e3 * tooth.base_radius, "mm"),
        Datum("tip diameter", 2e3 * tooth.tip_radius, "mm"),
        Datum("tip form diameter", 2e3 * tooth.end_radius, "mm"),
        Datum("root form diameter", 2e3 * tooth.form_radius, "mm"),
        Datum("root diameter", 2e3 * tooth.root_radius, "mm"),
        Datum("hub diameter", 2e3 * gear.hub_radius, "mm"),
        Datum("bore diameter", 2e3 * gear.bore_radius, "mm"),
        Datum("tip edge radius", 1e6 * tooth.edge_radius, "um"),
    ]


def _flank_rows(meshing: Pair, which: int) -> list[Datum]:
    """What one gear's flank does in this pair."""
    tooth, mate = (meshing.driver, meshing.driven)[:: 1 - 2 * which]
    start, stop = (meshing.active_driver, meshing.active_driven)[which]
    sliding = meshing.specific_sliding[which]
    base = tooth.base_radius
    undercut = 2 * (tooth.form_radius - base) if tooth.undercut else 0.0
    pitch = meshing.base_pitch if stop - start < 2 * meshing.base_pitch else nan  # else no tooth carries alone
    clear = fillet_clearance(tooth, mate, meshing.centre_distance, meshing.working_pressure_angle)
    return [
        Datum("start of active profile diameter", 2e3 * hypot(base, start), "mm"),
        Datum("inner point of single contact diameter", 2e3 * hypot(base, stop - pitch), "mm"),
        Datum("outer point of single contact diameter", 2e3 * hypot(base, start + pitch), "mm"),
        Datum("end of active profile diameter", 2e3 * hypot(base, stop), "mm"),
        Datum("involute lost to undercut, on the diameter", 1e3 * undercut, "mm"),
        Datum("roll angle at the root form circle", degrees(tooth.rho_form / base), "deg"),
        Datum("roll angle at the start of active profile", degrees(start / base), "deg"),
        Datum("roll angle at the pitch point", degrees(meshing.rho_pitch[which] / base), "deg"),
        Datum("roll angle at the end of active profile", degrees(stop / base), "deg"),
        Datum("specific sliding, start of active profile", sliding[0], ""),
        Datum("specific sliding, end of active profile", sliding[1], ""),
        Datum("backlash, angular, mate at rest", degrees(_play(meshing.backlash_angles[which])), "deg"),
        Datum("tip clearance", 1e3 * meshing.clearances[which], "mm"),
        Datum("clearance of the mate's tip from the fillet", 1e6 * clear if isfinite(clear) else nan, "um"),
    ]


def _thickness_rows(tooth: Profile, pitch: float, diameters: Sequence[float]) -> list[Datum]:
    reference = tooth.reference_radius
    across, height = _where(tooth, reference, lambda radius: chord(tooth, radius), (nan, nan))
    teeth, length = span(tooth)
    pin, dimension = over_pins(tooth)

    def arc(radius: float) -> float:
        return _where(tooth, radius, lambda at: thickness(tooth, at), nan)

    rows = [
        Datum("tooth thickness at the reference circle", 1e3 * arc(reference), "mm"),
        Datum("tooth thickness at the working pitch circle", 1e3 * arc(pitch), "mm"),
        Datum("tooth thickness at the base circle (involute)", 2e3 * tooth.base_radius * tooth.psi_b, "mm"),
        Datum("tooth thickness at the root form circle", 1e3 * arc(tooth.form_radius), "mm"),
        Datum("tip land", 2e3 * tooth.tip_radius * tooth.tip_half_angle, "mm"),
        Datum("chordal thickness at the reference circle", 1e3 * across, "mm"),
        Datum("chordal height above the reference chord", 1e3 * height, "mm"),
        Datum("teeth in the span", teeth or nan, ""),
        Datum("span W_k", 1e3 * length, "mm"),
        Datum("pin diameter", 1e3 * pin, "mm"),
        Datum("dimension over pins", 1e3 * dimension, "mm"),
    ]
    return rows + [Datum(f"tooth thickness at diameter {1e3 * d:g} mm", 1e3 * arc(d / 2), "mm") for d in diameters]


def _where(tooth: Profile, radius: float, measure: Callable[[float], T], other: T) -> T:
    """A measure on a circle, or `other` where the tooth does not reach it."""
    return measure(radius) if tooth.root_radius <= radius <= tooth.tip_radius else other


def _mass_rows(mass: Body) -> list[Datum]:
    return [
        Datum("mass", mass.mass, "kg"),
        Datum("mass outside the hub circle", mass.mass_fe, "kg"),
        Datum("mass of the hub", mass.mass_hub, "kg"),
        Datum("inertia", mass.inertia, "kg m^2"),
        Datum("inertia outside the hub circle", mass.inertia_fe, "kg m^2"),
        Datum("inertia of the hub", mass.inertia_hub, "kg m^2"),
    ]

"""One spur gear: macro-geometry, body and mass, micro-geometry and errors."""

from __future__ import annotations

from math import pi
from typing import Literal

from pydantic import model_validator

from gearbench.rig.checks import items_within
from gearbench.rig.flank_checks import check_flank
from gearbench.rig.value import Value, quantity, to_si

_LARGEST_ERROR = 1e-3  # m


class Crack(Value):
    """A cracked tooth, by what is lost or by the crack itself.

    With `stiffness_loss` the tooth's bending stiffness is lower and the contact of its flank that of a sound one. With
    `length` and `direction` a straight, open slit starts in the fillet below the working flank, where bending pulls:
    there the fillet's tangent makes the angle `start` with the tooth's centre line, 30 degrees being the classical
    critical section. `direction` is measured from the centre line too: at 0 the crack runs parallel to it towards the
    hub, at 90 degrees straight across the tooth, between the two down into the rim, beyond 90 degrees up into the
    tooth.
    """

    tooth: int = quantity(ge=0, doc="number of the cracked tooth, 0 .. teeth - 1")
    stiffness_loss: float = quantity(
        0.0, ge=0.0, le=0.95, doc="relative loss of that tooth's bending stiffness; or give length and direction"
    )
    length: float | None = quantity(None, "mm", ge=0.0, le=0.2, doc="length of a crack in the mesh of that tooth")
    direction: float | None = quantity(
        None,
        "deg",
        ge=to_si(-30.0, "deg"),
        le=to_si(150.0, "deg"),
        doc="direction of the crack: 0 along the tooth's centre line to the hub, 90 straight across the tooth",
    )
    start: float = quantity(
        to_si(30.0, "deg"),
        "deg",
        ge=0.0,
        le=pi / 2,
        doc="where it starts: angle of the working side's fillet to the tooth's centre line there",
    )

    @property
    def meshed(self) -> bool:
        """Whether the crack is one in the mesh, with a length."""
        return bool(self.length)

    @model_validator(mode="after")
    def _one_kind(self) -> Crack:
        if (self.length is None) != (self.direction is None):
            here, missing = ("length_mm", "direction_deg") if self.direction is None else ("direction_deg", "length_mm")
            raise ValueError(f"{missing} is missing: {here} is given")
        if self.length is None and "stiffness_loss" not in self.model_fields_set:
            raise ValueError("stiffness_loss is missing, or length_mm and direction_deg in its place")
        if self.length is not None and self.stiffness_loss:
            raise ValueError(
                f"stiffness_loss = {self.stiffness_loss:g} and length_mm = {1e3 * self.length:g} are both given: one"
                " of them"
            )
        return self


class Gear(Value):
    """Macro-geometry of an external involute spur gear, cut by a rack with rounded tips; SI and radians."""

    teeth: int = quantity(doc="number of teeth", ge=5, le=1000)
    module: float = quantity(unit="mm", gt=0.0, le=0.1, doc="module")
    pressure_angle: float = quantity(
        20 * pi / 180, "deg", ge=10 * pi / 180, le=35 * pi / 180, doc="pressure angle of the basic rack"
    )
    profile_shift: float = quantity(0.0, ge=-1.5, le=2.0, doc="profile shift coefficient x")
    addendum: float = quantity(1.0, gt=0.0, le=2.0, doc="rack addendum (of the gear tooth), in modules")
    dedendum: float = quantity(1.25, gt=0.0, le=2.5, doc="rack dedendum (of the gear tooth), in modules")
    rack_tip_radius: float = quantity(0.38, ge=0.0, le=0.6, doc="tip radius of the cutting rack, in modules")
    tip_diameter: float | None = quantity(None, "mm", gt=0.0, doc="tip diameter; absent: from addendum and shift")
    tip_edge_radius: float = quantity(50e-6, "um", ge=0.0, le=1e-3, doc="radius of the edge of flank and tip land")
    thinning: float = quantity(
        0.0, "um", ge=0.0, le=5e-3, doc="tooth thinning: transverse arc at the reference circle, per gear"
    )
    face_width: float = quantity(unit="mm", gt=0.0, le=1.0, doc="face width")
    bore_radius: float = quantity(0.0, "mm", ge=0.0, doc="bore radius; no material inside")
    hub_radius: float = quantity(unit="mm", gt=0.0, doc="radius of the rigid hub circle")
    mass: float | None = quantity(None, "kg", gt=0.0, doc="total mass; absent: from the geometry")
    inertia: float | None = quantity(None, "kg_m2", gt=0.0, doc="total moment of inertia; absent: from the geometry")
    tip_relief: float = quantity(0.0, "um", ge=0.0, le=_LARGEST_ERROR, doc="material taken off both flanks at the tip")
    tip_relief_start_diameter: float | None = quantity(
        None, "mm", gt=0.0, doc="diameter at which tip relief starts; needed with it"
    )
    tip_relief_shape: Literal["linear", "parabolic"] = quantity("linear", doc="growth of tip relief over roll angle")
    root_relief: float = quantity(
        0.0, "um", ge=0.0, le=_LARGEST_ERROR, doc="material taken off both flanks at the form circle"
    )
    root_relief_start_diameter: float | None = quantity(
        None, "mm", gt=0.0, doc="diameter at which root relief starts; needed with it"
    )
    root_relief_shape: Literal["linear", "parabolic"] = quantity("linear", doc="growth of root relief over roll angle")
    profile_slope: float = quantity(
        0.0,
        "um",
        ge=-_LARGEST_ERROR,
        le=_LARGEST_ERROR,
        doc="slope deviation f_Halpha: excess of the working flank at the tip less that at the form circle",
    )
    profile_slope_tooth: tuple[float, ...] = quantity(
        (), "um", doc="what each tooth adds to profile_slope; empty: nothing"
    )
    profile_form: tuple[float, ...] = quantity((), "um", doc="measured excess of the working flank; empty: none")
    profile_form_diameter: tuple[float, ...] = quantity((), "mm", doc="diameters of profile_form (or give roll)")
    profile_form_roll: tuple[float, ...] = quantity((), "deg", doc="roll angles of profile_form (or give diameter)")
    profile_form_tooth: tuple[float, ...] = quantity(
        (), doc="factor on profile_form for each tooth; empty: all teeth alike"
    )
    wear: float = quantity(0.0, "um", ge=0.0, le=_LARGEST_ERROR, doc="wear depth of the whole working flank")
    wear_depth: tuple[float, ...] = quantity((), "um", doc="wear depth over wear_roll, added to wear; empty: none")
    wear_roll: tuple[float, ...] = quantity((), "deg", doc="roll angles of wear_depth")
    wear_tooth: tuple[float, ...] = quantity((), doc="factor on all wear for each tooth; empty: all teeth alike")
    pitch_error: tuple[float, ...] = quantity(
        (), "um", doc="excess of each tooth's working flank, in order of meshing; empty: none"
    )
    runout: float = quantity(0.0, "um", ge=0.0, le=_LARGEST_ERROR, doc="run-out F_r, twice the eccentricity")
    runout_phase: float = quantity(0.0, "deg", doc="rotation of this gear at which run-out adds most material")
    iso_grade: int | None = quantity(
        None, ge=1, le=11, doc="draw pitch, run-out and profile errors that just satisfy this grade of ISO 1328-1:2013"
    )
    iso_seed: int = quantity(0, ge=0, le=2**31, doc="seed of the errors that iso_grade draws")
    crack: Crack | None = quantity(None, doc="absent: all teeth are sound")

    @model_validator(mode="after")
    def _errors(self) -> Gear:
        check_flank(self)
        items_within(self, "pitch_error", -_LARGEST_ERROR, _LARGEST_ERROR)
        if self.crack and self.crack.tooth >= self.teeth:
            raise ValueError(
                f"crack.tooth = {self.crack.tooth} must be less than teeth = {self.teeth} (teeth count from 0)"
            )
        return self

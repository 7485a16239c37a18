"""One spur gear: macro-geometry, body and mass."""

from __future__ import annotations

from math import pi

from gearbench.rig.value import Value, quantity


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

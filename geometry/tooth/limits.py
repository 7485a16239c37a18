"""What a single gear may be: each refusal is one sentence with parameter, value and limit."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, pi, sin, sqrt, tan

from gearbench.geometry.error import GeometryError, at_least, at_most
from gearbench.rig import Gear

# Thinnest rim between hub circle and root circle, in modules: below it the hub would be the root itself.
RIM_MODULES = 0.05
# Smallest rounding of a tip edge that is told from a sharp corner [m].
SMALLEST_EDGE = 1e-6
# Thinnest tooth between its fillets, in modules: below it undercut has cut the tooth off.
NECK_MODULES = 0.1
# Smallest root radius and smallest hub radius that can be meshed, in modules.
ROOT_MODULES = 0.1
HUB_MODULES = 1e-3
# Smallest module [m]: below it a length was probably given in metres.
SMALLEST_MODULE = 0.02e-3
# A rack tip this little (in modules) too wide for the rack tooth is rounding.
ROUNDING = 1e-12


def check_module(gear: Gear, name: str) -> None:
    """Refuse a module that no gear has."""
    if gear.module < SMALLEST_MODULE:
        raise GeometryError(
            f"{name}.module_mm = {gear.module * 1e3:g} is too small: at least {SMALLEST_MODULE * 1e3:g}; the unit is mm"
        )


def check_rack(gear: Gear, name: str, offset: float) -> None:
    """Refuse a rack tip radius that needs more width than the rack's tooth has (`offset` < 0, m)."""
    alpha = gear.pressure_angle
    room = pi / 4 - gear.dedendum * tan(alpha)
    if room < 0.0:
        raise GeometryError(
            f"{name}.dedendum = {gear.dedendum:g} makes the rack tooth pointed: at most"
            f" {at_most(pi / 4 / tan(alpha), 4)} at pressure_angle_deg = {alpha * 180 / pi:g}"
        )
    if offset < -ROUNDING * gear.module:
        raise GeometryError(
            f"{name}.rack_tip_radius = {gear.rack_tip_radius:g} does not fit the rack tooth: at most"
            f" {at_most(room * cos(alpha) / (1 - sin(alpha)), 4)} with dedendum = {gear.dedendum:g} and"
            f" pressure_angle_deg = {alpha * 180 / pi:g}"
        )


def check_thinning(gear: Gear, name: str, psi_b: float) -> None:
    """Refuse a thinning that leaves nothing of the tooth even on the base circle (`psi_b` <= 0)."""
    if psi_b <= 0.0:
        reference = gear.module * gear.teeth / 2
        if gear.thinning > 0.0 and psi_b + gear.thinning / (2 * reference) > 0.0:
            limit = at_most(1e6 * (gear.thinning + 2 * reference * psi_b), 2)
            raise GeometryError(
                f"{name}.thinning_um = {gear.thinning * 1e6:g} leaves nothing of the teeth: it must stay below {limit}"
            )
        limit = at_least(gear.profile_shift - psi_b * gear.teeth / (2 * tan(gear.pressure_angle)), 4)
        raise GeometryError(
            f"{name}.profile_shift = {gear.profile_shift:g} leaves nothing of the teeth: it must exceed {limit} with"
            f" teeth = {gear.teeth}, thinning_um = {gear.thinning * 1e6:g}"
        )


def check_root(gear: Gear, name: str, root: float) -> None:
    """Refuse a rack that reaches the gear's centre, `root` being the root radius [m]."""
    lacking = ROOT_MODULES - root / gear.module
    if lacking > ROUNDING:
        limit = gear.dedendum - lacking
        raise GeometryError(
            f"{name}.dedendum = {gear.dedendum:g} leaves no root circle: at most {at_most(limit, 4)} with"
            f" teeth = {gear.teeth}, profile_shift = {gear.profile_shift:g}, thinning_um = {gear.thinning * 1e6:g}"
        )


def check_neck(gear: Gear, name: str, has_neck: Callable[[Gear], bool]) -> None:
    """Refuse teeth that their fillets cut off or nearly: `has_neck` tells whether enough is left between them."""
    if has_neck(gear):
        return

    def fits(shift: float) -> bool:
        return has_neck(gear.model_copy(update={"profile_shift": shift}))

    shifts = [gear.profile_shift + 0.1 * k for k in range(1, 36)]
    high = next((shift for shift in shifts if fits(shift)), None)
    what = (
        f"{name}.profile_shift = {gear.profile_shift:g} cuts the teeth off at their roots (less than"
        f" {NECK_MODULES:g} modules are left between the fillets)"
    )
    others = (
        f"with teeth = {gear.teeth}, dedendum = {gear.dedendum:g}, rack_tip_radius = {gear.rack_tip_radius:g},"
        f" thinning_um = {gear.thinning * 1e6:g}"
    )
    if high is None:
        raise GeometryError(f"{what}: no profile_shift helps {others}")
    limit = at_least(_largest(high, gear.profile_shift, fits), 4)
    raise GeometryError(f"{what}: at least {limit} {others}")


def land_half_angle(tip: float, edge: float, base: float, psi_b: float) -> float:
    """Half the angle of the tip land left by an edge of radius `edge`; negative where the tooth is
    pointed."""
    centre = sqrt(max((tip - edge) ** 2 - base**2, 0.0))  # roll length of the arc's centre
    return psi_b - (centre + edge) / base + atan2(centre, base)


def _largest(fits: float, fails: float, ok: Callable[[float], bool]) -> float:
    """The limit between a value for which `ok` and one for which not, by bisection."""
    for _ in range(60):
        middle = 0.5 * (fits + fails)
        fits, fails = (middle, fails) if ok(middle) else (fits, middle)
    return fits


def check_tip(gear: Gear, name: str, *, tip: float, base: float, psi_b: float, rho_form: float) -> None:
    """Refuse a tip circle inside the form circle, a pointed tip and a tip edge that does not fit."""
    edge = gear.tip_edge_radius
    if 0.0 < edge < SMALLEST_EDGE:
        raise GeometryError(
            f"{name}.tip_edge_radius_um = {edge * 1e6:g} is too small to be meshed: 0 (sharp) or at least"
            f" {SMALLEST_EDGE * 1e6:g}"
        )
    form = sqrt(base**2 + max(rho_form, 0.0) ** 2)
    tip_key = f"{name}.tip_diameter_mm = {2e3 * tip:.6g}"
    if gear.tip_diameter is None:
        tip_key += f" (from addendum = {gear.addendum:g}, profile_shift = {gear.profile_shift:g})"
    if tip <= form:
        raise GeometryError(
            f"{tip_key} leaves no involute: it must exceed the form diameter of {at_least(2e3 * form, 4)} mm"
        )
    if land_half_angle(tip, 0.0, base, psi_b) <= 0.0:
        limit = _largest(base, tip, lambda radius: land_half_angle(radius, 0.0, base, psi_b) > 0.0)
        raise GeometryError(
            f"{tip_key} makes the teeth pointed: it must stay below {at_most(2e3 * limit, 4)} mm"
        )

    def fits(radius: float) -> bool:
        inside = tip - radius > base and radius + sqrt((tip - radius) ** 2 - base**2) > max(rho_form, 0.0)
        return inside and land_half_angle(tip, radius, base, psi_b) > 0.0

    if not fits(edge):
        raise GeometryError(
            f"{name}.tip_edge_radius_um = {edge * 1e6:g} does not fit between flank and tip land: it must"
            f" stay below {at_most(1e6 * _largest(0.0, edge, fits), 2)} um"
        )


def check_body(gear: Gear, name: str, root: float) -> None:
    """Refuse a hub circle that is not inside the root circle or not outside the bore."""
    limit = root - RIM_MODULES * gear.module
    # A case without a hub circle has it at the bore: then the bore is what its writer knows.
    at_bore = gear.hub_radius == gear.bore_radius
    key = f"{name}.bore_radius_mm" if at_bore else f"{name}.hub_radius_mm"
    if gear.hub_radius > limit:
        raise GeometryError(
            f"{key} = {gear.hub_radius * 1e3:g} is too large: at most"
            f" {at_most(limit * 1e3, 4)}, that is the root radius of {root * 1e3:.6g} mm less {RIM_MODULES:g}"
            " modules"
        )
    if gear.hub_radius < HUB_MODULES * gear.module:
        wider = f"; give a larger {name}.hub_radius_mm, inside which the gear is rigid" if at_bore else ""
        raise GeometryError(
            f"{key} = {gear.hub_radius * 1e3:g} is too small to be meshed: at least"
            f" {HUB_MODULES * gear.module * 1e3:g} ({HUB_MODULES:g} modules){wider}"
        )
    if gear.bore_radius > gear.hub_radius:
        raise GeometryError(
            f"{name}.bore_radius_mm = {gear.bore_radius * 1e3:g} is too large: at most hub_radius_mm ="
            f" {gear.hub_radius * 1e3:g}"
        )

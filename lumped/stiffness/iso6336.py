"""Tooth stiffness by ISO 6336-1, Method B: single stiffness c' and mesh stiffness c_gamma-alpha.

The formulas are those of ISO 6336-1:2006, 9.3 (the 2019 edition keeps them under other numbers). They are a
fit to the tooth deflections of Weber and Banaschek (1953) at F_bt/b = 300 N/mm, which the correction factor
C_M = 0.8 brings down to what was measured on solid discs of steel; torsion of the gear body is not in them.
Stiffness here is in the standard's unit N/(mm um), per millimetre of face width along the line of action;
1 N/(mm um) = 1e9 N/m^2. A helix angle exists in these formulas only, because the standard's worked example
(ISO/TR 6336-30, example 1) is helical; the gears of a rig are spur gears.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, asin, atan, cos, degrees, exp, log, pi, sin, sqrt, tan

from gearbench.geometry import Pair
from gearbench.rig import Rig

SI = 1e9  # N/m^2 in one N/(mm um)

# C_1 .. C_9 of the series for q' (ISO 6336-1:2006, 9.3.2.1, table of constants).
SERIES = (0.04723, 0.15551, 0.25791, -0.00635, -0.11654, -0.00193, -0.24188, 0.00529, 0.00182)
MEASURED = 0.8  # C_M (9.3.2.2)
STEEL = 206e9  # Young's modulus for which the series holds [Pa] (9.3.2.6)
LOW_LOAD = 100.0  # F_t K_A / b below which c' falls [N/mm] (9.3.2.7)
SHIFT_SUM = (-0.5, 2.0)  # of x_1 + x_2 (9.3.2.1)
LEAST_CONTACT_RATIO = 1.2  # below it c_gamma-alpha of spur gears may be up to 10 % lower (9.3.3)


@dataclass(frozen=True)
class IsoStiffness:
    """Stiffness [N/(mm um)]: theoretical c'_th, single c', mesh c_gamma-alpha; `notes` where the pair lies
    outside the range of the formulas, one sentence each."""

    theoretical: float
    single: float
    mesh: float
    notes: tuple[str, ...] = ()


def base_helix(helix: float, pressure_angle: float) -> float:
    """Helix angle on the base circle: sin(beta_b) = sin(beta) cos(alpha_n) (ISO 21771)."""
    return asin(sin(helix) * cos(pressure_angle))


def virtual_teeth(teeth: float, helix: float = 0.0, pressure_angle: float = 20 * pi / 180) -> float:
    """Number of teeth of the virtual spur gear, z_n = z / (cos^2 beta_b cos beta) (ISO 6336-3:2006, 6.2.1)."""
    return teeth / (cos(base_helix(helix, pressure_angle)) ** 2 * cos(helix))


def contact_ratio(
    teeth: Sequence[int],
    module: float,
    tip_diameters: Sequence[float],
    centre_distance: float,
    helix: float = 0.0,
    pressure_angle: float = 20 * pi / 180,
) -> float:
    """Transverse contact ratio of two external gears (ISO 21771); `module` is the normal one, lengths in any
    one unit."""
    transverse = atan(tan(pressure_angle) / cos(helix))
    across = module / cos(helix)
    base = [z * across * cos(transverse) for z in teeth]
    working = acos(sum(base) / (2 * centre_distance))
    path = sum(sqrt(tip**2 - b**2) / 2 for tip, b in zip(tip_diameters, base, strict=True))
    return (path - centre_distance * sin(working)) / (pi * across * cos(transverse))


def flexibility(virtual: Sequence[float], shifts: Sequence[float]) -> float:
    """q' [mm um/N], the deflection of one tooth pair per load, from z_n and x of pinion and wheel (9.3.2.1)."""
    (z1, z2), (x1, x2) = virtual, shifts
    terms = (1.0, 1 / z1, 1 / z2, x1, x1 / z1, x2, x2 / z2, x1**2, x2**2)
    return sum(c * term for c, term in zip(SERIES, terms, strict=True))


def blank_factor(web: float, rim: float) -> float:
    """Gear blank factor C_R (9.3.2.3) from web thickness over face width and rim thickness over module.

    Solid discs have web = 1 and C_R = 1. Beyond the limits 0.2 <= web <= 1.2 and rim >= 1 the limits are taken.
    """
    web, rim = min(max(web, 0.2), 1.2), max(rim, 1.0)
    return 1 + log(web) / (5 * exp(rim / 5))


def basic_rack_factor(dedendum: float, pressure_angle: float) -> float:
    """Basic rack factor C_B (9.3.2.4) of one gear; `dedendum` h_fP in modules, normal pressure angle [rad]."""
    return (1 + 0.5 * (1.2 - dedendum)) * (1 - 0.02 * (20 - degrees(pressure_angle)))


def single_stiffness(
    theoretical: float,
    *,
    rack: float,
    blank: float = 1.0,
    helix: float = 0.0,
    youngs_modulus: float = STEEL,
    load: float | None = None,
) -> float:
    """c' = c'_th C_M C_R C_B cos(beta) E/E_St [N/(mm um)]; `rack` is C_B, for unlike racks the mean of both.

    `load` is F_t K_A / b [N/mm]: below 100 N/mm c' falls with its fourth root (9.3.2.7); absent: not corrected.
    """
    value = theoretical * MEASURED * blank * rack * cos(helix) * youngs_modulus / STEEL
    if load is not None and load < LOW_LOAD:
        value *= (load / LOW_LOAD) ** 0.25
    return value


def mesh_stiffness(single: float, ratio: float) -> float:
    """c_gamma-alpha = c' (0.75 eps_alpha + 0.25) [N/(mm um)], the mean over the mesh cycle (9.3.3)."""
    return single * (0.75 * ratio + 0.25)


def iso_stiffness(rig: Rig, meshing: Pair, force: float | None = None) -> IsoStiffness:
    """ISO stiffness of a rig's spur pair as solid discs; `force` along the line of action [N] for low loads.

    The pinion is the gear with fewer teeth, of equal ones that with the larger shift. Per face width: the
    common one.
    """
    pinion, wheel = sorted((rig.driver, rig.driven), key=lambda gear: (gear.teeth, -gear.profile_shift))
    shifts = (pinion.profile_shift, wheel.profile_shift)
    theoretical = 1 / flexibility((pinion.teeth, wheel.teeth), shifts)
    racks = [basic_rack_factor(gear.dedendum, gear.pressure_angle) for gear in (pinion, wheel)]
    load = None
    if force is not None:
        load = force * cos(pinion.pressure_angle) / (1e3 * meshing.face_width)
    single = single_stiffness(theoretical, rack=0.5 * sum(racks), youngs_modulus=rig.material.youngs_modulus, load=load)
    ratio = meshing.contact_ratio
    return IsoStiffness(theoretical, single, mesh_stiffness(single, ratio), _notes(shifts, ratio, load))


def _notes(shifts: tuple[float, float], ratio: float, load: float | None) -> tuple[str, ...]:
    notes = []
    if shifts[0] < shifts[1]:
        notes.append(f"x1 = {shifts[0]:g} is below x2 = {shifts[1]:g}; the ISO series holds for x1 >= x2")
    if not SHIFT_SUM[0] <= sum(shifts) <= SHIFT_SUM[1]:
        low, high = SHIFT_SUM
        notes.append(f"x1 + x2 = {sum(shifts):g} is outside {low:g} to {high:g}, the range of the ISO series")
    if ratio < LEAST_CONTACT_RATIO:
        notes.append(f"contact ratio {ratio:.3f} is below {LEAST_CONTACT_RATIO:g}: ISO's c_gamma may be 10 % too high")
    if load is not None and load < LOW_LOAD:
        notes.append(
            f"load {load:.3g} N/mm is below {LOW_LOAD:g} N/mm: ISO's c' is lowered by the fourth root of their ratio"
        )
    return tuple(notes)

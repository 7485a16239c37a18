"""Do the angles turn as teeth, base radii and mesh period say?"""

from __future__ import annotations

from math import degrees, pi

import numpy as np

from gearbench.records.even_speed import departure
from gearbench.records.seen.finding import ANGLE_UNITS, Finding, unit_hint
from gearbench.records.seen.look import GEARS, Look, mean_rate

# Speeds against teeth, base radii against teeth.
RATIO = 1e-3
# Declared against measured mesh frequency, and cycles by which both may part over a period, beside what gears swing.
FREQUENCY, CYCLES = 2e-3, 5e-3
# By how many cycles the angles may depart from mesh_phase anywhere in a record whose speed varies.
APART = 0.3
# Working pressure angles of involute gears [deg], base radii [m].
WORKING_ANGLE_DEG = (5.0, 45.0)
BASE_RADIUS = (1e-4, 20.0)
# Inertia over the fourth power of the base radius [kg/m^2], at least: a disc of steel has 12000 times its width, 3 um
# would be less than any gear.
DISC = 0.05


def angles_unwrapped(look: Look) -> list[Finding]:
    """Angles are absolute: no jump by a turn, no standstill, no turning backwards."""
    found = []
    for gear in GEARS:
        values = look.channel(f"angle_{gear}")
        if values is None or values.size < 3:
            continue
        steps = np.diff(values)
        jump = float(np.abs(steps - np.median(steps)).max())
        if jump > pi:
            found.append(
                Finding(
                    f"angle_{gear} jumps by {jump:.4g} rad between two samples (limit pi): a record holds absolute,"
                    " unwrapped angles in rad"
                )
            )
        elif not look.speed(gear) > 0.0:
            found.append(
                Finding(
                    f"angle_{gear} does not rise (mean speed {look.speed(gear):.4g} rad/s, must be positive): each"
                    " angle is positive in its gear's own direction of rotation"
                )
            )
    return found


def angles_roll(look: Look) -> list[Finding]:
    """Both gears pass the same number of teeth: speeds are as the teeth (else: base radii) want."""
    if look.channel("angle_driver") is None or look.channel("angle_driven") is None:
        return []
    teeth = [look.number(f"teeth_{gear}") for gear in GEARS]
    radii = [look.number(f"base_radius_{gear}") for gear in GEARS]
    sizes, what = (teeth, "teeth") if None not in teeth else (radii, "base radii")
    if sizes[0] is None or sizes[1] is None or not look.speed("driven") > 0:
        return []
    got, wanted = look.speed("driver") / look.speed("driven"), sizes[1] / sizes[0]
    if abs(got / wanted - 1) <= max(RATIO, _slack(look)):
        return []
    if abs(got * wanted - 1) <= RATIO:
        hint = ": are driver and driven swapped?"
    else:
        hint = unit_hint(got / wanted, ANGLE_UNITS, "angle_driver")
        hint = hint or unit_hint(wanted / got, ANGLE_UNITS, "angle_driven")
    return [
        Finding(
            f"the speeds of angle_driver and angle_driven have the ratio {got:.6g}, but the {what}"
            f" {sizes[0]:.6g}/{sizes[1]:.6g} want {wanted:.6g} (limit {RATIO:.1%}){hint}"
        )
    ]


def angles_keep_mesh_period(look: Look) -> list[Finding]:
    """The driver passes a tooth in each declared mesh period."""
    teeth, period = look.number("teeth_driver"), look.mesh_period
    if look.channel("angle_driver") is None or teeth is None or period is None or not look.speed("driver") > 0:
        return []
    got, declared, source = look.speed("driver") * teeth / (2 * pi), 1.0 / period, "mesh_period"
    phase = look.channel("mesh_phase")
    if look.number("mesh_period") is None and phase is not None:
        # Of a speed that wanders the ends say another mean than a line does.
        declared, source = mean_rate(phase, look.rate, int(look.record.attrs["periods"])), "mesh_phase"
    if abs(got / declared - 1) <= max(FREQUENCY, _slack(look)):
        return []
    return [
        Finding(
            f"angle_driver and teeth_driver = {teeth:g} give a mesh frequency of {got:.5g} Hz, but {source} says"
            f" {declared:.5g} Hz (limit {FREQUENCY:.1%}){unit_hint(got / declared, ANGLE_UNITS, 'the angles', 'are')}"
        )
    ]


def angles_follow_mesh_phase(look: Look) -> list[Finding]:
    """Of a speed that varies, by the angles or by mesh_phase, both tell one course, their zeros apart."""
    phase = look.channel("mesh_phase")
    for gear in GEARS:
        values, teeth = look.channel(f"angle_{gear}"), look.number(f"teeth_{gear}")
        if phase is None or values is None or teeth is None:
            continue
        turned = values * teeth / (2 * pi)
        if max(look.departure, departure(turned)) < APART:
            continue
        apart = np.abs(turned - phase - (turned - phase).mean())
        worst = int(np.argmax(apart))
        if apart[worst] > APART:
            return [
                Finding(
                    f"angle_{gear} times teeth_{gear} = {teeth:g} departs from mesh_phase by {apart[worst]:.3g} cycles"
                    f" at sample {worst} (limit {APART:g}, their means apart): is mesh_phase that of a constant speed?"
                    " Where it and mesh_period are left out it is taken from angle_driver"
                )
            ]
    return []


def radii_fit_teeth(look: Look) -> list[Finding]:
    """Gears of one base pitch: base radii are as the teeth; radii in m, working pressure angle in rad."""
    found = []
    for gear in GEARS:
        radius = look.number(f"base_radius_{gear}")
        if radius is not None and not BASE_RADIUS[0] < radius < BASE_RADIUS[1]:
            found.append(
                Finding(
                    f"attribute base_radius_{gear} = {radius:g} m must lie between {BASE_RADIUS[0]:g} and"
                    f" {BASE_RADIUS[1]:g} m: is it in mm?"
                )
            )
    angle = look.number("working_pressure_angle")
    if angle is not None and not WORKING_ANGLE_DEG[0] < degrees(angle) < WORKING_ANGLE_DEG[1]:
        hint = ": is it in degrees?" if WORKING_ANGLE_DEG[0] < angle < WORKING_ANGLE_DEG[1] else ""
        found.append(
            Finding(
                f"attribute working_pressure_angle = {angle:g} rad is {degrees(angle):.4g} deg, which must lie between"
                f" {WORKING_ANGLE_DEG[0]:g} and {WORKING_ANGLE_DEG[1]:g} deg{hint}"
            )
        )
    z1, z2, r1, r2 = (look.number(f"{name}_{gear}") for name in ("teeth", "base_radius") for gear in GEARS)
    if z1 and z2 and r1 and r2 and abs(r1 * z2 / (r2 * z1) - 1) > RATIO:
        hint = ": are driver and driven swapped in one of them?" if abs(r1 * z1 / (r2 * z2) - 1) <= RATIO else ""
        found.append(
            Finding(
                f"attributes base_radius_driver / base_radius_driven = {r1 / r2:.6g}, but teeth {z1:g}/{z2:g} want"
                f" {z1 / z2:.6g} (limit {RATIO:.1%}){hint}"
            )
        )
    return found


def _slack(look: Look) -> float:
    """By what part the mean speed may err: some cycles over the record, and what the gears swing.

    Over a single period the slope that a sine of rms r feigns is at most 6 sqrt(2) / pi r per record, below 3 r.
    Several periods tell the speed by what is added from one to the next; what that varies by is its uncertainty.
    """
    periods = int(look.record.attrs["periods"])
    slack = []
    for gear in GEARS:
        values, teeth = look.channel(f"angle_{gear}"), look.number(f"teeth_{gear}")
        if values is None or teeth is None:
            continue
        to_cycles = teeth / (2 * pi)
        if periods > 1:
            steps = np.diff(values.reshape(periods, -1), axis=0)
            wander, cycles = float(np.std(steps)), abs(float(steps.mean()))
            slack.append((CYCLES + 3 * wander * to_cycles, cycles * to_cycles))
        else:
            turned = abs(look.speed(gear)) / look.rate * np.arange(values.size)
            slack.append((CYCLES + 3 * float(np.std(values - turned)) * to_cycles, turned[-1] * to_cycles))
    if not slack or not max(cycles for _, cycles in slack) > 0:
        return CYCLES
    return max(wander for wander, _ in slack) / max(cycles for _, cycles in slack)


def radii_fit_inertias(look: Look) -> list[Finding]:
    """A gear is no thinner than any gear: its inertia is that of a disc of its base radius."""
    for gear in GEARS:
        radius, inertia = look.number(f"base_radius_{gear}"), look.number(f"inertia_{gear}")
        if radius is None or inertia is None or not radius > 0 or not 0 < inertia < DISC * radius**4:
            continue
        return [
            Finding(
                f"attribute inertia_{gear} = {inertia:.4g} kg m^2 is too small for base_radius_{gear} = {radius:.4g} m"
                f" (limit {DISC * radius**4:.3g} kg m^2): is the radius in inches or mm, the inertia in another unit?"
            )
        ]
    return []

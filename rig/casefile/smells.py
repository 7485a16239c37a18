"""Values of a case that smell of another unit, or do not go together: questioned, never refused, since plastics and
watches exist."""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from typing import NamedTuple

from gearbench.rig.casefile.case import Case
from gearbench.rig.rig import Rig
from gearbench.rig.value import SYMBOLS, Value, format_number, key_of, unit_of


class Usual(NamedTuple):
    """What a field usually is, in the unit of its key; `factor`: from the other unit to the key's."""

    low: float
    high: float
    factor: float
    other: str


_LENGTH = (1e3, "m")
_GEAR = {
    "module": Usual(0.05, 100.0, *_LENGTH),
    "face_width": Usual(0.3, 1000.0, *_LENGTH),
    "hub_radius": Usual(0.3, 5000.0, *_LENGTH),
    "bore_radius": Usual(0.1, 5000.0, *_LENGTH),
    "tip_diameter": Usual(1.0, 20000.0, *_LENGTH),
    "tip_relief": Usual(0.2, 1000.0, 1e3, "mm"),
    "root_relief": Usual(0.2, 1000.0, 1e3, "mm"),
    "runout": Usual(0.2, 1000.0, 1e3, "mm"),
    "thinning": Usual(0.5, 5000.0, 1e3, "mm"),
    "mass": Usual(1e-5, 1e5, 1e-3, "g"),
}
_MATERIAL = {
    "youngs_modulus": Usual(0.5, 1300.0, 1e3, "TPa"),
    "density": Usual(300.0, 25000.0, 1e3, "g/cm^3"),
}
_SUPPORT = {"stiffness": Usual(1e4, 1e13, 1e6, "N/um")}
_EXPERIMENT = {"sampling_rate": Usual(100.0, 1e8, 1e3, "kHz")}
_RIG = {"centre_distance": Usual(2.0, 20000.0, *_LENGTH)}

# Significant digits of a number that somebody typed: one with more was computed, in the unit of its key, such as a
# run-out of nanometres that a diagnosis leaves in its rig.
_TYPED = 5

# Face width over module: of nearly all gears 5 to 15, of racks and hobs and toys not beyond these.
_WIDTH = (1.0, 60.0)
# Nominal root bending stress and Hertz pressure [Pa] that no material of gears bears.
_BENDING, _PRESSURE = 3e9, 6e9
# Form and stress factor Y_F Y_S of a tooth, roughly; for a doubt that is enough.
_FORM = 4.0


def smells(case: Case) -> tuple[str, ...]:
    """A sentence for each value that is unusual as it stands and usual in another unit (zeros, absent and computed ones
    pass), and for face widths and loads that do not go with the rest."""
    rig = case.rig
    tables: list[tuple[str, Value, dict[str, Usual]]] = [
        ("rig", rig, _RIG),
        ("rig.driver", rig.driver, _GEAR),
        ("rig.driven", rig.driven, _GEAR),
        ("rig.material", rig.material, _MATERIAL),
        ("rig.support.driver", rig.support.driver, _SUPPORT),
        ("rig.support.driven", rig.support.driven, _SUPPORT),
        ("experiment", case.experiment, _EXPERIMENT),
    ]
    found = []
    for where, value, fields in tables:
        for name, usual in fields.items():
            held = getattr(value, name)
            if not held:
                continue
            unit = unit_of(type(value), name)
            number = float(format_number(held, unit))
            read = number * usual.factor
            typed = number == float(f"{number:.{_TYPED}g}")
            if typed and not usual.low <= number <= usual.high and usual.low <= read <= usual.high:
                found.append(
                    f"{where}.{key_of(type(value), name)} = {number:g} is unusual: was {number:g} {usual.other} meant,"
                    f" which is {read:g} {SYMBOLS[unit]}? It is taken as {number:g} {SYMBOLS[unit]}"
                )
    questioned = {line.partition(" = ")[0].rpartition(".")[2] for line in found}
    if not questioned & {"face_width_mm", "module_mm"}:
        found += _widths(rig) or _loads(case)
    return tuple(found)


def _widths(rig: Rig) -> list[str]:
    """Face widths that do not go with their modules."""
    found = []
    for side, gear in (("driver", rig.driver), ("driven", rig.driven)):
        ratio = gear.face_width / gear.module
        if not _WIDTH[0] <= ratio <= _WIDTH[1]:
            found.append(
                f"rig.{side}.face_width_mm = {1e3 * gear.face_width:g} is {ratio:.3g} modules"
                f" (module_mm = {1e3 * gear.module:g}); usual are 5 to 15, and {_WIDTH[0]:g} to {_WIDTH[1]:g} pass"
                " unasked: are both in mm?"
            )
    return found


def _loads(case: Case) -> list[str]:
    """A mean torque that no material bears: one sentence, on bending or on pressure."""
    if not case.stated:
        return []
    torque = max(one.experiment.torque_mean for _, one in case.experiments())
    bending, pressure = nominal_stresses(case.rig, torque)
    width = 1e3 * min(case.rig.driver.face_width, case.rig.driven.face_width)
    for words, stress, most in (
        ("bends the tooth roots by", bending, _BENDING),
        ("presses the flanks by", pressure, _PRESSURE),
    ):
        if stress > most:
            return [
                f"experiment.torque_mean_nm = {torque:g} {words} about {1e-6 * stress:.0f} MPa at face_width_mm ="
                f" {width:g} (nominal), more than any gear bears ({1e-6 * most:.0f}): are they in N m and mm?"
            ]
    return []


def nominal_stresses(rig: Rig, torque: float) -> tuple[float, float]:
    """Nominal root stress and Hertz pressure [Pa] of one tooth pair at the pitch point under a driver torque [N m].

    F_t / (b m) Y_F Y_S with a rough Y_F Y_S = 4, and Hertz's line contact of flanks with the radii of curvature
    d sin(alpha) / 2 (ISO 6336-2 and -3 without their factors).
    """
    one, two, alpha = rig.driver, rig.driven, rig.driver.pressure_angle
    width = min(one.face_width, two.face_width)
    diameters = [gear.module * gear.teeth for gear in (one, two)]
    tangential = 2 * torque / diameters[0]
    curvature = sum(2 / (d * sin(alpha)) for d in diameters)
    line = tangential / cos(alpha) / width
    stiffness = rig.material.youngs_modulus / (2 * (1 - rig.material.poisson**2))
    return tangential / (width * one.module) * _FORM, sqrt(line * stiffness * curvature / pi)

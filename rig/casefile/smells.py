"""Values of a case that smell of another unit: questioned, never refused, since plastics and watches exist."""

from __future__ import annotations

from typing import NamedTuple

from gearbench.rig.casefile.case import Case
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


def smells(case: Case) -> tuple[str, ...]:
    """A sentence for each value that is unusual as it stands and usual in another unit; zeros and absent ones pass."""
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
            if not usual.low <= number <= usual.high and usual.low <= read <= usual.high:
                found.append(
                    f"{where}.{key_of(type(value), name)} = {number:g} is unusual: was {number:g} {usual.other} meant,"
                    f" which is {read:g} {SYMBOLS[unit]}? It is taken as {number:g} {SYMBOLS[unit]}"
                )
    return tuple(found)

"""Which effects a rig has: the fields that differ from their neutral values."""

from __future__ import annotations

from gearbench.rig.drive import Drive
from gearbench.rig.gear import Gear
from gearbench.rig.rig import Rig
from gearbench.rig.value import Value, fields_of, key_of

# Fields that only shape an effect whose size another field gives: alone they change nothing.
_SHAPES = {"transition_speed"}


def effects_in(rig: Rig) -> tuple[str, ...]:
    """Dotted TOML keys ("rig.driver.runout_um") of all effects that the rig has, in the order of a dumped case.

    An effect is what an ideal rig lacks: tooth errors and cracks, non-linear supports, what stands behind a
    coupling, ripple, friction, corrections of the mesh, delays and noise of the sensors. A field with its
    neutral value is none, and neither is an error of zero, a crack without loss or a ripple of amplitude 0.
    Backlash (thinning, centre distance) belongs to the geometry and is not listed.
    """
    found: list[str] = []
    for side in ("driver", "driven"):
        found += [f"rig.{side}.{key}" for key in _gear_effects(getattr(rig, side))]
    for side in ("driver", "driven"):
        if getattr(rig.support, side).exponent:
            found.append(f"rig.support.{side}.exponent")
    found += [f"rig.drive.{key}" for key in _drive_effects(rig.drive)]
    for table in ("friction", "mesh", "sensors"):
        found += [f"rig.{table}.{key}" for key in _departures(getattr(rig, table))]
    return tuple(found)


def sound_gear(gear: Gear) -> Gear:
    """The gear without errors and cracks: what is meshed and condensed."""
    names = ("pitch_error", "runout", "runout_phase", "crack")
    return gear.model_copy(update={name: Gear.model_fields[name].default for name in names})


def _gear_effects(gear: Gear) -> list[str]:
    found = []
    if any(gear.pitch_error):
        found.append(key_of(Gear, "pitch_error"))
    if gear.runout:
        found.append(key_of(Gear, "runout"))
    if gear.crack and gear.crack.stiffness_loss:
        found.append("crack")
    return found


def _drive_effects(drive: Drive) -> list[str]:
    found = ["coupling"] if drive.coupling else []
    if drive.ripple and any(drive.ripple.amplitude):
        found.append("ripple")
    return found


def _departures(value: Value) -> list[str]:
    """Keys of the fields that differ from their default; a list counts when one item is not zero."""
    found = []
    for key, (name, info) in fields_of(type(value)).items():
        held = getattr(value, name)
        differs = any(held) if isinstance(held, tuple) else held != info.default
        if differs and name not in _SHAPES:
            found.append(key)
    return found

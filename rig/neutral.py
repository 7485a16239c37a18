"""Which effects a rig has: the fields that differ from their neutral values."""

from __future__ import annotations

from gearbench.rig.drive import Drive, Load
from gearbench.rig.gear import Gear
from gearbench.rig.rig import Rig
from gearbench.rig.value import Value, fields_of, key_of

# Fields that only shape an effect whose size another field gives: alone they change nothing.
_SHAPES = {"transition_speed", "reference_force", "encoder_runout_driver_phase", "encoder_runout_driven_phase"}
_GEAR_SHAPES = {
    "tip_relief_start_diameter",
    "tip_relief_shape",
    "root_relief_start_diameter",
    "root_relief_shape",
    "profile_form_diameter",
    "profile_form_roll",
    "profile_form_tooth",
    "wear_roll",
    "wear_tooth",
    "runout_phase",
    "iso_seed",
}

# Fields of a gear that take material off both flanks of all its teeth by design.
RELIEF_FIELDS = (
    "tip_relief",
    "tip_relief_start_diameter",
    "tip_relief_shape",
    "root_relief",
    "root_relief_start_diameter",
    "root_relief_shape",
)

# Fields of a gear that move its flanks, in the order of the gear's fields.
FLANK_FIELDS = (
    *RELIEF_FIELDS,
    "profile_slope",
    "profile_slope_tooth",
    "profile_form",
    "profile_form_diameter",
    "profile_form_roll",
    "profile_form_tooth",
    "wear",
    "wear_depth",
    "wear_roll",
    "wear_tooth",
    "pitch_error",
    "runout",
    "runout_phase",
    "iso_grade",
    "iso_seed",
)


# Of those, what differs from tooth to tooth.
_UNEVEN = ("profile_slope_tooth", "profile_form_tooth", "wear_tooth", "pitch_error", "runout", "iso_grade")


def effects_in(rig: Rig) -> tuple[str, ...]:
    """Dotted TOML keys ("rig.driver.runout_um") of all effects that the rig has, in the order of a dumped case.

    An effect is what an ideal rig lacks: tooth errors and cracks, non-linear supports and those across, a housing,
    what stands behind a coupling, boundaries other than torque on the driver and speed or balancing torque on the load,
    ripple, friction, damping that grows with the load, corrections of the mesh, errors of the sensors. A field with its
    neutral value is none, and neither is an error of zero, a shape without an amount, a crack without loss or length, a
    ripple of amplitude 0, or a rigid shaft to a load whose speed is prescribed.
    Backlash (thinning, centre distance) belongs to the geometry and is not listed.
    """
    found: list[str] = []
    for side in ("driver", "driven"):
        found += [f"rig.{side}.{key}" for key in _gear_effects(getattr(rig, side))]
    for side in ("driver", "driven"):
        support = getattr(rig.support, side)
        if support.exponent:
            found.append(f"rig.support.{side}.exponent")
        if support.across is not None:
            found.append(f"rig.support.{side}.across")
    if rig.housing is not None:
        found.append("rig.housing")
    found += [f"rig.drive.{key}" for key in _drive_effects(rig.drive)]
    found += [f"rig.load.{key}" for key in _load_effects(rig.load)]
    if rig.damping.mesh_exponent:
        found.append("rig.damping.mesh_exponent")
    for table in ("friction", "mesh", "sensors"):
        found += [f"rig.{table}.{key}" for key in _departures(getattr(rig, table))]
    return tuple(found)


def sound_gear(gear: Gear) -> Gear:
    """The gear without errors and cracks: what is meshed and condensed."""
    return gear.model_copy(update={name: Gear.model_fields[name].default for name in (*FLANK_FIELDS, "crack")})


def relieved_gear(gear: Gear) -> Gear:
    """The gear without errors and cracks, with the reliefs of its design."""
    return sound_gear(gear).model_copy(update={name: getattr(gear, name) for name in RELIEF_FIELDS})


def even_gear(gear: Gear) -> Gear:
    """The gear with all teeth alike: without cracks, and without errors that differ from tooth to tooth."""
    return gear.model_copy(update={name: Gear.model_fields[name].default for name in (*_UNEVEN, "crack")})


def without_reliefs(gear: Gear) -> Gear:
    """The gear without the reliefs of its design."""
    return gear.model_copy(update={name: Gear.model_fields[name].default for name in RELIEF_FIELDS})


def is_formed(gear: Gear) -> bool:
    """Whether all teeth of the gear depart from their involutes alike."""
    depths = (gear.tip_relief, gear.root_relief, gear.profile_slope, gear.wear, *gear.profile_form, *gear.wear_depth)
    return any(depths)


def _gear_effects(gear: Gear) -> list[str]:
    found = []
    for name in FLANK_FIELDS:
        held = getattr(gear, name)
        if name not in _GEAR_SHAPES and (any(held) if isinstance(held, tuple) else held):
            found.append(key_of(Gear, name))
    if gear.crack and gear.crack.stiffness_loss:
        found.append("crack")
    if gear.crack and gear.crack.meshed:
        found.append("crack.length_mm")
    return found


def has_sensors(rig: Rig) -> bool:
    """Whether sensors change anything in a record."""
    return bool(_departures(rig.sensors))


def _drive_effects(drive: Drive) -> list[str]:
    found = ["boundary"] if drive.boundary != "torque" else []
    found += ["coupling"] if drive.coupling else []
    if drive.ripple and any(drive.ripple.amplitude):
        found.append("ripple")
    return found


def _load_effects(load: Load) -> list[str]:
    found = ["boundary"] if load.boundary == "inertia" else []
    shaft = load.coupling
    turning = shaft is not None and shaft.inertia > 0 and load.boundary != "speed"
    if shaft is not None and (load.twists or turning):
        found.append("coupling")
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
